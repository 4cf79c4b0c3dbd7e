/* Parameters from YAML: one row, a pass's struct. */
#include "graph/model/params_list.h"

#include <float.h>
#include <math.h>
#include <string.h>

rl_code rl_fail_suggest(rl_error *err, rl_where where, const char *text, const char *name,
                        const char *const *known, size_t n)
{
    rl_str more = {0};
    rl_suggest(&more, name, known, n, "known");
    rl_code code = !text || more.failed ? rl_fail_memory(err, more.length)
                                        : rl_fail(err, RL_E_CONFIG, where, "%s%s", text, rl_str_text(&more));
    rl_str_free(&more);
    return code;
}

/* ---- words
 * -------------------------------------------------------------------------------------------------- */

/* The index of the n characters of `text` among "a|b|c", or -1. */
static int find_wordn(const char *words, const char *text, size_t n)
{
    for (int i = 0; n && words; i++) {
        if (strcspn(words, "|") == n && !strncmp(words, text, n))
            return i;
        words = strchr(words, '|');
        words = words ? words + 1 : NULL;
    }
    return -1;
}

static int find_word(const char *words, const char *text)
{
    return find_wordn(words, text, strlen(text));
}

bool rl_param_is(const rl_param *row, const void *value, const char *words)
{
    int32_t v;
    memcpy(&v, value, sizeof v);
    while (words) {
        if (find_wordn(row->words, words, strcspn(words, "|")) == v)
            return true;
        words = strchr(words, '|');
        words = words ? words + 1 : NULL;
    }
    return false;
}

/* ---- reading
 * ------------------------------------------------------------------------------------------------- */

static void store_int(void *out, double value)
{
    int32_t v = (int32_t)value;
    memcpy(out, &v, sizeof v);
}

static void store_float(void *out, size_t i, double value)
{
    float v = (float)value;
    memcpy((char *)out + i * sizeof v, &v, sizeof v);
}

size_t rl_param_bytes(const rl_param *row)
{
    return row->type == RL_ROWS ? rl_list_bytes(row) : RL_PARAM_BYTES(row->type);
}

void rl_param_default(const rl_param *row, void *out)
{
    if (row->type == RL_ROWS || row->type == RL_MATERIALS) {
        memset(out, 0, rl_param_bytes(row));
    } else if (row->type == RL_RGBF) {
        for (size_t i = 0; i < 3; i++)
            store_float(out, i, row->no_default ? -1 : row->def[i]);
    } else if (row->type == RL_F32) {
        store_float(out, 0, row->no_default ? -1 : row->def[0]);
    } else {
        store_int(out, row->no_default ? -1 : row->def[0]);
    }
}

static rl_code wrong(const rl_param *row, const rl_value *v, rl_error *err)
{
    rl_str expected = {0};
    rl_param_expected(row, &expected);
    rl_code code = expected.failed ? rl_fail_memory(err, expected.length)
                                   : rl_value_wrong(v, row->name, rl_str_text(&expected), err);
    rl_str_free(&expected);
    return code;
}

/* The comparisons are false for NaN. */
static bool fits(const rl_param *row, const rl_value *v)
{
    return v->kind == RL_NUMBER && v->number >= row->min && v->number <= row->max &&
           fabs(v->number) <= FLT_MAX;
}

static rl_code read_int(const rl_param *row, const rl_value *v, void *out, rl_error *err)
{
    int word = v->kind == RL_TEXT && row->words ? find_word(row->words, v->text) : -1;
    if (v->kind == RL_NUMBER && fabs(v->number) > INT32_MAX &&
        row->max >= INT32_MAX) /* a limit worth a word */
        return rl_value_wrong(v, row->name, "an integer of at most 2147483647 (32 bits)", err);
    if (word < 0 && (!fits(row, v) || v->number != floor(v->number) || fabs(v->number) > INT32_MAX))
        return wrong(row, v, err);
    store_int(out, word >= 0 ? -1.0 - word : v->number);
    return RL_OK;
}

static rl_code read_rgb(const rl_param *row, const rl_value *v, void *out, rl_error *err)
{
    if (v->kind == RL_LIST && v->n != 3)
        return wrong(row, v, err);
    for (size_t i = 0; i < 3; i++) {
        const rl_value *channel = v->kind == RL_LIST ? v->items[i] : v;
        if (!fits(row, channel))
            return wrong(row, channel, err);
        store_float(out, i, channel->number);
    }
    return RL_OK;
}

static rl_code check_material(const rl_param *row, const rl_value *v, rl_error *err)
{
    bool id = v->kind == RL_NUMBER && v->integral && v->integer >= INT32_MIN && v->integer <= UINT32_MAX;
    return id || v->kind == RL_TEXT
               ? RL_OK
               : rl_value_wrong(v, row->name, "materials: names, stencil names or ids, or a list of them",
                                err);
}

rl_code rl_param_read(const rl_param *row, const rl_value *v, void *out, rl_error *err)
{
    rl_code code = RL_OK;
    bool truth = false;
    int word = 0;
    switch (row->type) {
    case RL_F32:
        if (!fits(row, v))
            return wrong(row, v, err);
        store_float(out, 0, v->number);
        break;
    case RL_I32:
        code = read_int(row, v, out, err);
        break;
    case RL_RGBF:
        code = read_rgb(row, v, out, err);
        break;
    case RL_BOOL:
        code = rl_value_truth(v, row->name, &truth, err);
        if (!code)
            store_int(out, truth);
        break;
    case RL_ENUM:
        code = rl_value_word(v, row->name, row->words, &word, err);
        if (!code)
            store_int(out, word);
        break;
    case RL_ROWS:
        code = rl_list_read(row, v, out, err);
        if (!code)
            code = rl_list_check_sums(row, v, out, err);
        break;
    case RL_MATERIALS:
        memset(out, 0, rl_param_bytes(row)); /* rl_material_sets_fill, when the capture is known */
        for (size_t i = 0; i < v->n && v->kind == RL_LIST && !code; i++)
            code = check_material(row, v->items[i], err);
        if (v->kind != RL_LIST)
            code = check_material(row, v, err);
        break;
    }
    return code;
}

static bool is_among(const char *const *names, size_t n, const char *name)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(names[i], name))
            return true;
    return false;
}

static rl_code unknown_key(rl_arena *arena, const rl_pass *pass, const char *node, const rl_entry *entry,
                           const char *const *also, size_t n_also, rl_error *err)
{
    size_t n = pass->params.n;
    const char **names = rl_arena_array(arena, n + 1, sizeof *names);
    if (!names)
        return rl_fail_memory(err, n * sizeof *names);
    for (size_t i = 0; i < n; i++)
        names[i] = pass->params.rows[i].name;
    char *text = rl_arena_printf(arena, "pass '%s' (%s) has no parameter '%s'", node, pass->name, entry->key);
    /* A slip in `in` or `pass` gets its hint too, but only parameters are listed. Not so `taps`, which is two
     * letters away from `pass`: more likely it is another pass's. */
    const char *other = rl_nearest(entry->key, names, n) ? NULL : rl_nearest(entry->key, also, n_also);
    if (other && entry->key[0] != other[0])
        other = NULL;
    if (text && other)
        text = rl_arena_printf(arena, "%s; did you mean '%s'?", text, other);
    else if (text && !n)
        text = rl_arena_printf(arena, "%s; it has none", text);
    return rl_fail_suggest(err, entry->where, text, entry->key, names, other ? 0 : n);
}

static const rl_param *find_row(rl_params params, const char *name)
{
    for (size_t i = 0; i < params.n; i++)
        if (!strcmp(params.rows[i].name, name))
            return &params.rows[i];
    return NULL;
}

rl_code rl_params_read(rl_arena *arena, const rl_pass *pass, const char *node, const rl_value *map,
                       const char *const *also, size_t n_also, const void **out, rl_error *err)
{
    char *data = rl_arena_alloc(arena, pass->params_size);
    if (!data)
        return rl_fail_memory(err, pass->params_size);
    for (size_t i = 0; i < pass->params.n; i++)
        rl_param_default(&pass->params.rows[i], data + pass->params.rows[i].offset);
    if (map && map->kind != RL_MAP)
        return rl_value_wrong(map, node, "a map", err);
    for (size_t i = 0; map && i < map->n; i++) {
        const rl_entry *entry = &map->entries[i];
        if (is_among(also, n_also, entry->key))
            continue;
        const rl_param *row = find_row(pass->params, entry->key);
        rl_code code = row ? rl_param_read(row, entry->value, data + row->offset, err)
                           : unknown_key(arena, pass, node, entry, also, n_also, err);
        if (code)
            return code;
    }
    *out = data;
    return RL_OK;
}

static bool is_when(const rl_pass *pass, const void *params, const char *when, int32_t is)
{
    const rl_param *row = when ? find_row(pass->params, when) : NULL;
    int32_t v;
    if (!row)
        return true;
    memcpy(&v, (const char *)params + row->offset, sizeof v);
    return v == is;
}

bool rl_step_runs(const rl_pass *pass, const rl_step *step, const void *params)
{
    return is_when(pass, params, step->when, step->is);
}

bool rl_port_exists(const rl_pass *pass, const rl_port *port, const void *params)
{
    return is_when(pass, params, port->when, port->is);
}
