#include "graph/model/params_list.h"

#include <string.h>

/* Keys of an element; more would not fit the list of known ones in an error. */
enum { MOST_KEYS = 16 };

static size_t room_of(const rl_param *row)
{
    return (size_t)row->max;
}

size_t rl_list_bytes(const rl_param *row)
{
    size_t bytes = sizeof(int32_t);
    for (size_t k = 0; k < row->list.n; k++)
        bytes += room_of(row) * rl_param_bytes(&row->list.rows[k]);
    return bytes;
}

/* Bytes from the start of the value. */
static size_t element_offset(const rl_param *row, size_t i, size_t k)
{
    size_t at = sizeof(int32_t);
    for (size_t j = 0; j < k; j++)
        at += room_of(row) * rl_param_bytes(&row->list.rows[j]);
    return at + i * rl_param_bytes(&row->list.rows[k]);
}

const void *rl_param_element(const rl_param *row, const void *value, size_t i, size_t k)
{
    return (const char *)value + element_offset(row, i, k);
}

void rl_list_expected(const rl_param *row, rl_str *s)
{
    if (row->min == row->max)
        rl_str_printf(s, "a list of %g maps {", row->max);
    else
        rl_str_printf(s, "a list of %g … %g maps {", row->min, row->max);
    for (size_t k = 0; k < row->list.n; k++)
        rl_str_printf(s, "%s%s", k ? ", " : "", row->list.rows[k].name);
    rl_str_add(s, "}");
}

void rl_list_field(const rl_param *row, const char *prefix, rl_str *s)
{
    rl_str_printf(s, "int %s%s_n;", prefix, row->name);
    for (size_t k = 0; k < row->list.n; k++) {
        const rl_param *key = &row->list.rows[k];
        bool real = key->type == RL_F32 || key->type == RL_RGBF;
        rl_str_printf(s, " %s %s%s_%s[%zu];", real ? "float" : "int", prefix, row->name, key->name,
                      room_of(row) * rl_param_bytes(key) / sizeof(int32_t));
    }
}

void rl_list_print(const rl_param *row, const void *value, rl_str *s)
{
    int32_t n;
    memcpy(&n, value, sizeof n);
    rl_str_add(s, "[");
    for (size_t i = 0; i < (size_t)n; i++) {
        rl_str_add(s, i ? ", {" : "{");
        for (size_t k = 0; k < row->list.n; k++) {
            rl_str_printf(s, "%s%s: ", k ? ", " : "", row->list.rows[k].name);
            rl_param_print(&row->list.rows[k], rl_param_element(row, value, i, k), s);
        }
        rl_str_add(s, "}");
    }
    rl_str_add(s, "]");
}

/* ---- reading
 * ------------------------------------------------------------------------------------------------- */

static rl_code wrong(const rl_param *row, const rl_value *v, rl_error *err)
{
    rl_str expected = {0};
    rl_list_expected(row, &expected);
    rl_code code = expected.failed ? rl_fail_memory(err, expected.length)
                                   : rl_value_wrong(v, row->name, rl_str_text(&expected), err);
    rl_str_free(&expected);
    return code;
}

static rl_code check_keys(const rl_param *row, const rl_value *element, rl_error *err)
{
    const char *known[MOST_KEYS];
    if (row->list.n > MOST_KEYS)
        return rl_fail(err, RL_E_INTERNAL, element->where, "'%s' has too many keys", row->name);
    for (size_t k = 0; k < row->list.n; k++)
        known[k] = row->list.rows[k].name;
    rl_str what = {0};
    rl_str_printf(&what, "an element of '%s'", row->name);
    rl_code code = what.failed ? rl_fail_memory(err, what.length)
                               : rl_value_keys(element, rl_str_text(&what), known, row->list.n, err);
    rl_str_free(&what);
    return code;
}

static rl_code read_element(const rl_param *row, const rl_value *element, size_t i, char *out, rl_error *err)
{
    rl_code code = check_keys(row, element, err);
    for (size_t k = 0; !code && k < row->list.n; k++) {
        const rl_param *key = &row->list.rows[k];
        const rl_value *v = rl_value_get(element, key->name);
        char *to = out + element_offset(row, i, k);
        if (v)
            code = rl_param_read(key, v, to, err);
        else if (key->required)
            code = rl_fail(err, RL_E_CONFIG, element->where, "an element of '%s' needs '%s': %s", row->name,
                           key->name, key->help);
        else
            rl_param_default(key, to);
    }
    return code;
}

/* Where a list went wrong as a whole: at the value that --set put into it, else where the list begins. */
static rl_where changed_element(const rl_value *list, const char *key)
{
    for (size_t i = list->n; i-- > 0;) {
        const rl_value *v = rl_value_get(list->items[i], key);
        if (v && v->where.file && list->where.file && strcmp(v->where.file, list->where.file))
            return v->where;
    }
    return list->where;
}

/* The elements of one key together, each channel. */
static rl_code check_sum(const rl_param *row, const rl_value *v, size_t k, const void *value, rl_error *err)
{
    const rl_param *key = &row->list.rows[k];
    size_t channels = rl_param_bytes(key) / sizeof(float);
    double sum[3] = {0};
    bool beyond = false;
    for (size_t c = 0; c < channels; c++) {
        for (size_t i = 0; i < v->n; i++) {
            float x;
            memcpy(&x, (const char *)rl_param_element(row, value, i, k) + c * sizeof x, sizeof x);
            sum[c] += (double)x;
        }
        beyond |= !(sum[c] <= key->most_sum + 1e-6);
    }
    if (!beyond)
        return RL_OK;
    const rl_where where = changed_element(v, key->name);
    if (channels == 1)
        return rl_fail(err, RL_E_CONFIG, where, "'%s': '%s' adds up to %.7g, at most %g is allowed",
                       row->name, key->name, sum[0], key->most_sum);
    return rl_fail(err, RL_E_CONFIG, where,
                   "'%s': '%s' adds up to [%.7g, %.7g, %.7g], at most %g a channel is allowed", row->name,
                   key->name, sum[0], sum[1], sum[2], key->most_sum);
}

rl_code rl_list_read(const rl_param *row, const rl_value *v, void *out, rl_error *err)
{
    if (v->kind != RL_LIST || (double)v->n < row->min || (double)v->n > row->max)
        return wrong(row, v, err);
    int32_t n = (int32_t)v->n;
    memset(out, 0, rl_list_bytes(row));
    memcpy(out, &n, sizeof n);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < v->n; i++)
        code = read_element(row, v->items[i], i, out, err);
    return code;
}

rl_code rl_list_check_sums(const rl_param *row, const rl_value *v, const void *value, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t k = 0; !code && k < row->list.n; k++)
        if (row->list.rows[k].most_sum > 0)
            code = check_sum(row, v, k, value, err);
    return code;
}
