/* Parameters told: a row's range and default for people, its value as YAML, its field for OpenCL. */
#include "graph/model/params_list.h"

#include <float.h>
#include <string.h>

/* Appends word `index` of "a|b|c"; false when there is none. */
static bool add_word(rl_str *s, const char *words, int index)
{
    for (; words && index > 0; index--) {
        words = strchr(words, '|');
        words = words ? words + 1 : NULL;
    }
    if (!words || index < 0)
        return false;
    rl_str_addn(s, words, strcspn(words, "|"));
    return true;
}

/* "0 … 1", "≥ 0", "≤ 1", or nothing: limits that the type has anyway are not worth a word. */
static void add_range(const rl_param *row, rl_str *s)
{
    double least = row->type == RL_I32 ? (double)INT32_MIN : (double)-FLT_MAX;
    double most = row->type == RL_I32 ? (double)INT32_MAX : (double)FLT_MAX;
    char min[32], max[32];
    rl_format_double(row->min, min);
    rl_format_double(row->max, max);
    if (row->min > least && row->max < most)
        rl_str_printf(s, "%s … %s", min, max);
    else if (row->min > least)
        rl_str_printf(s, "≥ %s", min);
    else if (row->max < most)
        rl_str_printf(s, "≤ %s", max);
}

void rl_param_expected(const rl_param *row, rl_str *s)
{
    if (row->type == RL_I32 && row->words)
        rl_str_printf(s, "%s or ", row->words);
    rl_str range = {0};
    add_range(row, &range);
    rl_str_add(s, row->type == RL_I32    ? "an integer"
                  : row->type == RL_RGBF ? "a number or a list of three"
                                         : "a number");
    if (range.length)
        rl_str_printf(s, "%s %s", row->type == RL_RGBF ? ", each" : "", rl_str_text(&range));
    s->failed |= range.failed;
    rl_str_free(&range);
    if (row->unit && row->unit[0])
        rl_str_printf(s, " (%s)", row->unit);
}

static float load_float(const void *value, size_t i)
{
    float v;
    memcpy(&v, (const char *)value + i * sizeof v, sizeof v);
    return v;
}

/* By dense index: names belong to a capture's materials. */
static void print_materials(const void *value, rl_str *s)
{
    uint32_t words[RL_SET_WORDS];
    const char *comma = "";
    memcpy(words, value, sizeof words);
    rl_str_add(s, "[");
    for (unsigned i = 0; i < 32 * RL_SET_WORDS; i++) {
        if (words[i / 32] >> i % 32 & 1) {
            rl_str_printf(s, "%s%u", comma, i);
            comma = ", ";
        }
    }
    rl_str_add(s, "]");
}

void rl_param_print(const rl_param *row, const void *value, rl_str *s)
{
    char text[3][32];
    int32_t v;
    memcpy(&v, value, sizeof v);
    switch (row->type) {
    case RL_F32:
        rl_str_add(s, rl_format_float(load_float(value, 0), text[0]));
        break;
    case RL_RGBF:
        for (size_t i = 0; i < 3; i++)
            rl_format_float(load_float(value, i), text[i]);
        rl_str_printf(s, "[%s, %s, %s]", text[0], text[1], text[2]);
        break;
    case RL_BOOL:
        rl_str_add(s, v ? "true" : "false");
        break;
    case RL_ENUM:
        add_word(s, row->words, v);
        break;
    case RL_I32:
        if (v >= 0 || !add_word(s, row->words, -1 - v))
            rl_str_printf(s, "%d", (int)v);
        break;
    case RL_ROWS:
        rl_list_print(row, value, s);
        break;
    case RL_MATERIALS:
        print_materials(value, s);
        break;
    }
}

void rl_param_describe(const rl_param *row, rl_str *s)
{
    float value[RL_SET_WORDS];
    const char *unit = row->unit && row->unit[0] ? row->unit : NULL;
    size_t before = s->length;
    if (row->type == RL_ROWS)
        rl_list_expected(row, s);
    else if (row->type == RL_MATERIALS)
        rl_str_add(s, "a list of materials, stencil names or ids");
    else if (row->type == RL_BOOL)
        rl_str_add(s, "true|false");
    else if (row->words)
        rl_str_add(s, row->words);
    if (row->type != RL_BOOL && row->type != RL_ENUM && row->type != RL_ROWS && row->type != RL_MATERIALS) {
        if (s->length > before)
            rl_str_add(s, "|");
        size_t words = s->length;
        add_range(row, s);
        if (s->length == words)
            rl_str_add(s, row->type == RL_I32 ? "an integer" : "a number");
    }
    if (row->no_default || row->required || row->type == RL_ROWS) {
        rl_str_printf(s, "%s%s, %s", unit ? " " : "", unit ? unit : "",
                      row->required ? "required" : "no default");
        if (row->required_with)
            rl_str_printf(s, ", required with %s", row->required_with);
        return;
    }
    rl_str_add(s, ", default ");
    rl_param_default(row, value);
    rl_param_print(row, value, s);
    if (unit)
        rl_str_printf(s, " %s", unit);
}

void rl_param_field(const rl_param *row, const char *prefix, rl_str *s)
{
    bool real = row->type == RL_F32 || row->type == RL_RGBF;
    if (row->type == RL_ROWS) {
        rl_list_field(row, prefix, s);
        return;
    }
    rl_str_printf(s, "%s %s%s%s;", real ? "float" : "int", prefix, row->name,
                  row->type == RL_RGBF        ? "[3]"
                  : row->type == RL_MATERIALS ? "[8]"
                                              : "");
}

void rl_params_struct_text(rl_params params, const char *name, rl_str *s)
{
    if (!params.n)
        return;
    rl_str_printf(s, "typedef struct %s {", name);
    for (size_t i = 0; i < params.n; i++) {
        rl_str_add(s, " ");
        rl_param_field(&params.rows[i], "", s);
    }
    rl_str_printf(s, " } %s;\n", name);
}
