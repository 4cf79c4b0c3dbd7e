/* Patterns of output files: {capture}, {variant}, {frame}, {frame:04}. */
#include "graph/model/pipeline_parts.h"

#include <stdio.h>
#include <string.h>

typedef struct pattern {
    const char *text; /* the whole, for errors */
    rl_where where;
    const char *capture, *variant;
    long long frame;
    rl_error *err;
} pattern;

static rl_code add_name(const pattern *p, const char *value, const char *field, rl_str *s)
{
    if (!value)
        return rl_fail(p->err, RL_E_CONFIG, p->where, "file '%s': {%s} has no value here", p->text, field);
    rl_str_add(s, value);
    return RL_OK;
}

/* {frame}, {frame:4}, {frame:04}: what printf does with %lld, %4lld, %04lld. */
static rl_code add_frame(const pattern *p, const char *format, size_t n, rl_str *s)
{
    bool zeros = n > 0 && format[0] == '0';
    int width = 0;
    for (size_t i = 0; i < n && width < 100; i++) {
        if (format[i] < '0' || format[i] > '9')
            width = 100;
        else
            width = width * 10 + (format[i] - '0');
    }
    if (width > 18)
        return rl_fail(p->err, RL_E_CONFIG, p->where,
                       "file '%s': after '{frame:' comes a width to 18, such as 4 or 04, not '%.*s'", p->text,
                       (int)n, format);
    rl_str_printf(s, zeros ? "%0*lld" : "%*lld", width, p->frame);
    return RL_OK;
}

/* One field, without its braces. */
static rl_code add_field(const pattern *p, const char *field, size_t n, rl_str *s)
{
    static const char *const known[] = {"capture", "frame", "variant"};
    size_t name = 0;
    while (name < n && field[name] != ':')
        name++;
    bool bare = name == n;
    if (bare && n == 7 && !strncmp(field, "capture", n))
        return add_name(p, p->capture, "capture", s);
    if (bare && n == 7 && !strncmp(field, "variant", n))
        return add_name(p, p->variant, "variant", s);
    if (name == 5 && !strncmp(field, "frame", name) && (bare || name + 1 < n))
        return add_frame(p, field + name + !bare, n - name - !bare, s);
    char word[64], text[256];
    snprintf(word, sizeof word, "%.*s", (int)name, field);
    snprintf(text, sizeof text, "file '%.120s' has the unknown field '{%.*s}'", p->text, n < 60 ? (int)n : 60,
             field);
    return rl_fail_suggest(p->err, p->where, text, word, known, RL_ARRAY_LENGTH(known));
}

static rl_code expand(const pattern *p, rl_str *s)
{
    for (const char *c = p->text; *c;) {
        size_t n = strcspn(c, "{}");
        rl_str_addn(s, c, n);
        c += n;
        if (!*c)
            break;
        size_t field = strcspn(c + 1, "{}");
        if (*c == '}' || c[1 + field] != '}')
            return rl_fail(p->err, RL_E_CONFIG, p->where,
                           "file '%s': '%c' without its partner; fields look like {frame:04}", p->text, *c);
        rl_code code = add_field(p, c + 1, field, s);
        if (code)
            return code;
        c += field + 2;
    }
    return RL_OK;
}

rl_code rl_pattern_expand(rl_arena *arena, const char *text, rl_where where, const char *capture,
                          long long frame, const char *variant, const char **out, rl_error *err)
{
    const pattern p = {text, where, capture, variant, frame, err};
    rl_str s = {0};
    rl_code code = expand(&p, &s);
    if (!code && (s.failed || !(*out = rl_arena_strdup(arena, rl_str_text(&s)))))
        code = rl_fail_memory(err, s.length);
    rl_str_free(&s);
    return code;
}

rl_code rl_output_path(rl_arena *arena, const rl_output *output, const char *capture, long long frame,
                       const char *variant, const char **out, rl_error *err)
{
    return rl_pattern_expand(arena, output->file, output->file_where, capture, frame, variant, out, err);
}
