/* Names of variants, and of their folders. */
#include "graph/model/vary.h"

#include <string.h>
#include <strings.h>

#include "graph/base/file.h"
#include "graph/base/text.h"

enum { LONGEST_PART = 32, LONGEST_NAME = 120 };

static bool is_letter(unsigned char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c >= 0x80;
}

static bool is_letter_or_digit(unsigned char c)
{
    return is_letter(c) || (c >= '0' && c <= '9');
}

/* The text with '_' for every run of bytes that a file name should not have; none at its ends. */
static void add_slug(rl_str *s, const char *text)
{
    size_t from = s->length, end = s->length;
    for (const char *c = text; *c; c++) {
        bool good = is_letter_or_digit((unsigned char)*c) || *c == '.' || *c == '-' || *c == '_';
        if (!good && (end == from || s->text[end - 1] == '_'))
            continue;
        if (end - from >= LONGEST_PART && ((unsigned char)*c & 0xC0) != 0x80)
            break; /* not inside of a character */
        rl_str_addn(s, good ? c : "_", 1);
        if (s->failed)
            return;
        end = s->length;
    }
    while (s->length > from && s->text[s->length - 1] == '_')
        s->text[--s->length] = 0;
}

/* Where the name of what is varied begins: "taps", "scatter_distance_mm.0". */
static const char *key_of(const char *path)
{
    const char *from = path + strlen(path);
    while (from > path) {
        do
            from--;
        while (from > path && from[-1] != '.');
        if (!(*from >= '0' && *from <= '9'))
            return from;
        from -= from > path; /* an index of a list */
    }
    return path;
}

/* true, null, and what would begin a name with a digit or a sign: "taps_21" says more than "21", and "-1"
 * would be an option to other programs. */
static void add_value(rl_str *s, const rl_vary *vary, size_t choice, bool begins)
{
    const rl_value *v = vary->values[choice];
    rl_str value = {0};
    add_slug(&value, v->kind == RL_TEXT ? v->text : vary->texts[choice]);
    if (!value.length) /* a text of blanks, or '+' */
        rl_str_printf(&value, "value%zu", choice + 1);
    const char *text = rl_str_text(&value);
    if (v->kind == RL_NULL || v->kind == RL_TRUTH || (begins && !is_letter((unsigned char)text[0]))) {
        add_slug(s, key_of(vary->path));
        rl_str_add(s, "_");
    }
    rl_str_add(s, text);
    s->failed |= value.failed;
    rl_str_free(&value);
}

static void add_pipeline(rl_str *s, const char *file)
{
    const char *name = rl_path_name(file);
    size_t n = strlen(name) - strlen(rl_path_extension(file)), from = s->length;
    rl_str stem = {0};
    rl_str_addn(&stem, name, n);
    s->failed |= stem.failed;
    add_slug(s, rl_str_text(&stem));
    rl_str_free(&stem);
    if (s->length == from)
        rl_str_add(s, "pipeline");
}

/* Without what makes it unique. */
static void add_name(rl_str *s, const rl_grid *grid, size_t variant)
{
    bool any = grid->n_pipelines > 1;
    if (any)
        add_pipeline(s, grid->pipelines[rl_grid_choice(grid, variant, 0)]);
    for (size_t i = 0; i < grid->n_varies; i++) {
        if (grid->varies[i].n < 2 && grid->n > 1)
            continue; /* the same in all */
        bool begins = !s->length;
        if (!begins)
            rl_str_add(s, "_");
        add_value(s, &grid->varies[i], rl_grid_choice(grid, variant, i + 1), begins);
        any = true;
    }
    if (!any)
        add_pipeline(s, grid->pipelines[0]);
    size_t n = s->length;
    if (n > LONGEST_NAME) {
        for (n = LONGEST_NAME; n && ((unsigned char)s->text[n] & 0xC0) == 0x80;)
            n--;
        s->text[s->length = n] = 0;
    }
}

static bool is_taken(const char *name, const char *const *names, size_t n, const char *const *taken,
                     size_t n_taken)
{
    for (size_t i = 0; i < n; i++)
        if (!strcasecmp(name, names[i]))
            return true;
    for (size_t i = 0; i < n_taken; i++)
        if (!strcasecmp(name, taken[i]))
            return true;
    return false;
}

rl_code rl_grid_names(rl_arena *arena, const rl_grid *grid, const char *const *taken, size_t n_taken,
                      const char *const **names, rl_error *err)
{
    const char **out = rl_arena_array(arena, grid->n, sizeof *out);
    if (!out)
        return rl_fail_memory(err, grid->n * sizeof *out);
    for (size_t i = 0; i < grid->n; i++) {
        rl_str s = {0};
        add_name(&s, grid, i);
        const char *plain = rl_str_text(&s);
        /* a file like ".yaml" */
        const char *lead = is_letter_or_digit((unsigned char)plain[0]) ? "" : "v";
        out[i] = s.failed ? NULL : rl_arena_printf(arena, "%s%s", lead, plain);
        for (int k = 2; out[i] && is_taken(out[i], out, i, taken, n_taken); k++)
            out[i] = rl_arena_printf(arena, "%s%s_%d", lead, plain, k);
        rl_str_free(&s);
        if (!out[i])
            return rl_fail_memory(err, LONGEST_NAME);
    }
    *names = out;
    return RL_OK;
}
