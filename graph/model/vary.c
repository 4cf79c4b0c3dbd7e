#include "graph/model/vary.h"

#include <string.h>

#include "graph/base/text.h"

/* ---- one --vary ---------------------------------------------------------------------------------------- */

static rl_code print_value(rl_arena *arena, const rl_value *v, const char **out, rl_error *err)
{
    rl_str text = {0};
    rl_value_print(v, &text);
    *out = text.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&text));
    rl_str_free(&text);
    return *out ? RL_OK : rl_fail_memory(err, 64);
}

static rl_code check_different(const rl_vary *v, rl_error *err)
{
    for (size_t i = 0; i < v->n; i++)
        for (size_t k = 0; k < i; k++)
            if (!strcmp(v->texts[i], v->texts[k]))
                return rl_fail(err, RL_E_USAGE, v->values[i]->where,
                               "value %zu of '%s' is %s again, as value %zu: each may be there once", i + 1,
                               v->path, v->texts[i], k + 1);
    return RL_OK;
}

/* The values in brackets, with as many blanks in front as the path is long: so that the column of an error is
 * that of the option's text, where '=' stands in the place of '['. */
static rl_code parse_list(rl_arena *arena, const char *text, size_t path, const char *option, rl_value **out,
                          rl_error *err)
{
    char *list = rl_arena_printf(arena, "%*s[%s]", (int)path, "", text + path + 1);
    rl_error inner = {0};
    if (!list)
        return rl_fail_memory(err, strlen(text));
    rl_code code = rl_yaml_parse(arena, list, strlen(list), option, out, &inner);
    if (code == RL_E_CONFIG || code == RL_E_FORMAT)
        return rl_fail(err, RL_E_USAGE, /* the end of the text is line 2 to the parser */
                       (rl_where){inner.file, 1, inner.line > 1 ? (int)strlen(text) + 1 : inner.column},
                       "behind '=' the inside of a YAML list is expected, such as 8,16 or [3, 1.2, 0.7],[6, "
                       "5, 3]: %s",
                       inner.text);
    return code ? rl_fail(err, code, RL_NOWHERE, "%s", inner.text) : RL_OK;
}

rl_code rl_vary_parse(rl_arena *arena, const char *text, rl_vary *out, rl_error *err)
{
    size_t length = strcspn(text, "=");
    rl_value *list = NULL;
    *out = (rl_vary){.option = rl_arena_printf(arena, "--vary %s", text),
                     .path = rl_arena_strndup(arena, text, length)};
    if (!out->option || !out->path)
        return rl_fail_memory(err, strlen(text));
    if (!length || !text[length])
        return rl_fail_file(err, RL_E_USAGE, out->option,
                            "option '--vary' takes PATH=V1,V2,…, such as graph.sss.taps=8,16, found '%s'",
                            text);
    rl_code code = parse_list(arena, text, length, out->option, &list, err);
    if (code)
        return code;
    if (list->kind != RL_LIST || !list->n)
        return rl_fail(err, RL_E_USAGE, list->where, "there is no value behind '%s='", out->path);
    const char **texts = rl_arena_array(arena, list->n, sizeof *texts);
    if (!texts)
        return rl_fail_memory(err, list->n * sizeof *texts);
    for (size_t i = 0; i < list->n && !code; i++)
        code = print_value(arena, list->items[i], &texts[i], err);
    out->values = list->items;
    out->texts = texts;
    out->n = list->n;
    return code ? code : check_different(out, err);
}

/* ---- the grid ------------------------------------------------------------------------------------------ */

/* One path leads into the other, or both are the same. */
static bool overlap(const char *a, const char *b)
{
    size_t n = strlen(a), m = strlen(b), least = n < m ? n : m;
    return !strncmp(a, b, least) && (n == m || (n < m ? b : a)[least] == '.');
}

rl_code rl_grid_count(rl_grid *grid, rl_error *err)
{
    grid->n = grid->n_pipelines;
    for (size_t i = 0; i < grid->n_varies; i++) {
        const rl_vary *v = &grid->varies[i];
        for (size_t k = 0; k < i; k++)
            if (overlap(v->path, grid->varies[k].path))
                return rl_fail_file(err, RL_E_USAGE, v->option, "'%s' is varied already, by '%s'", v->path,
                                    grid->varies[k].option);
        if (grid->n <= RL_MOST_VARIANTS) /* no overflow: a command line has less than 2^32 bytes */
            grid->n *= v->n;
    }
    if (grid->n > RL_MOST_VARIANTS)
        return rl_fail_file(err, RL_E_USAGE, "--vary", "this makes %zu variants or more; the most is %d",
                            grid->n, RL_MOST_VARIANTS);
    return RL_OK;
}

size_t rl_grid_axes(const rl_grid *grid)
{
    return 1 + grid->n_varies;
}

static size_t stride_of(const rl_grid *grid, size_t axis)
{
    size_t stride = 1;
    for (size_t i = axis; i < grid->n_varies; i++)
        stride *= grid->varies[i].n;
    return stride;
}

size_t rl_grid_choice(const rl_grid *grid, size_t variant, size_t axis)
{
    return variant / stride_of(grid, axis) % (axis ? grid->varies[axis - 1].n : grid->n_pipelines);
}

bool rl_grid_before(const rl_grid *grid, size_t variant, size_t axis, size_t *out)
{
    if (!rl_grid_choice(grid, variant, axis))
        return false;
    *out = variant - stride_of(grid, axis);
    return true;
}
