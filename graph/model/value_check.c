/* Reading configuration values with checks: one place that words the complaints. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/value.h"

static rl_where where_of(const rl_value *v)
{
    return v ? v->where : RL_NOWHERE;
}

rl_code rl_value_wrong(const rl_value *v, const char *name, const char *expected, rl_error *err)
{
    char buf[96];
    return rl_fail(err, RL_E_CONFIG, where_of(v), "'%s': expected %s, found %s", name, expected,
                   rl_value_describe(v, buf));
}

rl_code rl_fail_unknown(rl_error *err, rl_where where, const char *head, const char *name,
                        const char *const *known, size_t n)
{
    rl_str text = {0};
    rl_str_printf(&text, "%s '%s'", head, name);
    rl_suggest(&text, name, known, n, "known");
    rl_code code = text.failed ? rl_fail_memory(err, text.room)
                               : rl_fail(err, RL_E_CONFIG, where, "%s", rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

rl_code rl_fail_absent(rl_error *err, const rl_value *all, const rl_entry *e, const char *head,
                       const char *needs)
{
    const char *known[64];
    size_t n = 0;
    rl_str text = {0};
    for (size_t i = 0; i < all->n && n < sizeof known / sizeof *known; i++)
        if (&all->entries[i] != e)
            known[n++] = all->entries[i].key;
    rl_suggest(&text, e->key, known, n, "known");
    rl_code code = text.failed ? rl_fail_memory(err, text.room)
                               : rl_fail(err, RL_E_CONFIG, e->value->where, "%s '%s'%s (a new one needs %s)",
                                         head, e->key, rl_str_text(&text), needs);
    rl_str_free(&text);
    return code;
}

rl_code rl_value_keys(const rl_value *v, const char *what, const char *const *known, size_t n, rl_error *err)
{
    char buf[96];
    if (!v || v->kind != RL_MAP)
        return rl_fail(err, RL_E_CONFIG, where_of(v), "%s: expected a map, found %s", what,
                       rl_value_describe(v, buf));
    for (size_t i = 0; i < v->n; i++) {
        const rl_entry *e = &v->entries[i];
        bool found = false;
        for (size_t k = 0; k < n && !found; k++)
            found = !strcmp(e->key, known[k]);
        if (found)
            continue;
        rl_str head = {0};
        rl_str_printf(&head, "%s has no key", what);
        rl_code code = head.failed ? rl_fail_memory(err, head.room)
                                   : rl_fail_unknown(err, e->where, rl_str_text(&head), e->key, known, n);
        rl_str_free(&head);
        return code;
    }
    return RL_OK;
}

static rl_code out_of_range(const rl_value *v, const char *name, const char *number, const char *least,
                            const char *most, rl_error *err)
{
    if (least && most)
        return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: out of range, %s to %s", name, number, least,
                       most);
    return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: out of range, %s %s", name, number,
                   least ? "at least" : "at most", least ? least : most);
}

/* The range as users read it: DBL_MIN as the least stands for "above 0", DBL_MAX and infinities for no bound.
 */
static rl_code check_range(const rl_value *v, const char *name, double x, double min, double max,
                           rl_error *err)
{
    char least[32], most[32];
    if (x >= min && x <= max)
        return RL_OK;
    if (isnan(x))
        return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: a number is needed", name, v->text);
    bool bounded = max < DBL_MAX;
    if (isinf(x) && !bounded && max < INFINITY && x > 0)
        return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: a finite number is needed", name, v->text);
    if (min == DBL_MIN && bounded)
        return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: out of range, above 0 and at most %s", name,
                       v->text, rl_format_double(max, most));
    if (min == DBL_MIN)
        return rl_fail(err, RL_E_CONFIG, v->where, "'%s' is %s: out of range, above 0", name, v->text);
    return out_of_range(v, name, v->text, min > -DBL_MAX ? rl_format_double(min, least) : NULL,
                        bounded ? rl_format_double(max, most) : NULL, err);
}

rl_code rl_value_number(const rl_value *v, const char *name, double min, double max, double *out,
                        rl_error *err)
{
    if (!v || v->kind != RL_NUMBER)
        return rl_value_wrong(v, name, "a number", err);
    rl_code code = check_range(v, name, v->number, min, max, err);
    if (!code)
        *out = v->number;
    return code;
}

rl_code rl_value_integer(const rl_value *v, const char *name, long long min, long long max, long long *out,
                         rl_error *err)
{
    const double exact = 9007199254740992.0; /* 2^53: up to here 1e4 and 10000 are the same */
    if (!v || v->kind != RL_NUMBER)
        return rl_value_wrong(v, name, "an integer", err);
    long long i = v->integer;
    if (!v->integral) {
        if (!(fabs(v->number) <= exact) || v->number != floor(v->number))
            return rl_value_wrong(v, name, "an integer", err);
        i = (long long)v->number;
    }
    if (i < min || i > max) {
        char least[32], most[32];
        snprintf(least, sizeof least, "%lld", min);
        snprintf(most, sizeof most, "%lld", max);
        return out_of_range(v, name, v->text, min > LLONG_MIN ? least : NULL, max < LLONG_MAX ? most : NULL,
                            err);
    }
    *out = i;
    return RL_OK;
}

rl_code rl_value_truth(const rl_value *v, const char *name, bool *out, rl_error *err)
{
    if (!v || v->kind != RL_TRUTH)
        return rl_value_wrong(v, name, "true or false", err);
    *out = v->truth;
    return RL_OK;
}

rl_code rl_value_text(const rl_value *v, const char *name, const char **out, rl_error *err)
{
    if (!v || v->kind != RL_TEXT)
        return rl_value_wrong(v, name, "a text", err);
    *out = v->text;
    return RL_OK;
}

static rl_code unknown_word(const rl_value *v, const char *name, const char *words, rl_error *err)
{
    enum { MOST = 64 };
    const char *known[MOST];
    size_t n = 0;
    char *copy = rl_strdup(words), *rest = NULL;
    if (!copy)
        return rl_fail_memory(err, strlen(words) + 1);
    for (char *w = strtok_r(copy, "|", &rest); w && n < MOST; w = strtok_r(NULL, "|", &rest))
        known[n++] = w;
    rl_str head = {0};
    rl_str_printf(&head, "'%s' cannot be", name);
    rl_code code = head.failed ? rl_fail_memory(err, head.room)
                               : rl_fail_unknown(err, v->where, rl_str_text(&head), v->text, known, n);
    rl_str_free(&head);
    rl_free(copy);
    return code;
}

rl_code rl_value_word(const rl_value *v, const char *name, const char *words, int *out, rl_error *err)
{
    if (!v || !v->text || v->kind == RL_NULL) {
        char expected[256];
        snprintf(expected, sizeof expected, "one of %s", words);
        return rl_value_wrong(v, name, expected, err);
    }
    int i = 0;
    for (const char *w = words;; i++) {
        size_t length = strcspn(w, "|");
        if (strlen(v->text) == length && !strncmp(w, v->text, length)) {
            *out = i;
            return RL_OK;
        }
        if (!w[length])
            return unknown_word(v, name, words, err);
        w += length + 1;
    }
}

rl_code rl_value_numbers(const rl_value *v, const char *name, size_t n, double *out, rl_error *err)
{
    char expected[48];
    snprintf(expected, sizeof expected, "a list of %zu numbers", n);
    if (!v || v->kind != RL_LIST || v->n != n)
        return rl_value_wrong(v, name, expected, err);
    for (size_t i = 0; i < n; i++)
        if (rl_value_number(v->items[i], name, -DBL_MAX, DBL_MAX, &out[i], err))
            return err ? err->code : RL_E_CONFIG;
    return RL_OK;
}
