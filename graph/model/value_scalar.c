/* The core schema of YAML 1.2 (section 10.3). libyaml knows 1.1 only, where `no` is false, 1:30 is 90 and
 * 1e10 a text; so it hands over texts, and their meaning is found here. */
#include "graph/model/value_scalar.h"

#include <math.h>
#include <string.h>

#include "graph/base/text.h"

static bool one_of(const char *text, const char *const *words, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(text, words[i]))
            return true;
    return false;
}
#define ONE_OF(text, ...)                                                                                    \
    one_of(text, (const char *const[]){__VA_ARGS__},                                                         \
           sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *))

static size_t digits(const char *t)
{
    return strspn(t, "0123456789");
}

/* 0x and 0o; larger than long long is a number that is not `integral`. */
static bool read_radix(const char *t, rl_value *v)
{
    bool hex = t[1] == 'x';
    const char *set = hex ? "0123456789abcdefABCDEF" : "01234567";
    if (t[0] != '0' || !(hex || t[1] == 'o') || !t[2] || t[2 + strspn(t + 2, set)])
        return false;
    unsigned long long whole = 0;
    double sum = 0;
    v->integral = true;
    for (const char *d = t + 2; *d; d++) {
        unsigned digit = (unsigned)(*d <= '9' ? *d - '0' : (*d | 0x20) - 'a' + 10);
        unsigned base = hex ? 16 : 8;
        sum = sum * base + digit;
        whole = whole * base + digit;
        v->integral = v->integral && sum < 9.2e18;
    }
    v->number = sum;
    v->integer = v->integral ? (long long)whole : 0;
    return true;
}

/* [-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)? */
static bool read_decimal(const char *text, rl_value *v)
{
    const char *t = text + (*text == '-' || *text == '+');
    size_t before = digits(t), after = 0;
    t += before;
    bool integer = !*t && before > 0;
    if (*t == '.') {
        after = digits(++t);
        t += after;
    }
    if (before + after == 0)
        return false;
    if (*t == 'e' || *t == 'E') {
        t++;
        t += *t == '-' || *t == '+';
        size_t exponent = digits(t);
        if (!exponent)
            return false;
        t += exponent;
    }
    if (*t || !rl_parse_double(text, &v->number))
        return false;
    v->integral = integer && rl_parse_int(text, &v->integer);
    return true;
}

static bool read_number(const char *t, rl_value *v)
{
    const char *unsigned_ = t + (*t == '-' || *t == '+');
    if (ONE_OF(t, ".nan", ".NaN", ".NAN"))
        v->number = NAN;
    else if (ONE_OF(unsigned_, ".inf", ".Inf", ".INF"))
        v->number = *t == '-' ? -INFINITY : INFINITY;
    else
        return read_radix(t, v) || read_decimal(t, v);
    return true;
}

rl_kind rl_scalar_resolve(rl_value *v)
{
    if (ONE_OF(v->text, "", "~", "null", "Null", "NULL"))
        return RL_NULL;
    if (ONE_OF(v->text, "true", "True", "TRUE", "false", "False", "FALSE")) {
        v->truth = (v->text[0] | 0x20) == 't';
        return RL_TRUTH;
    }
    return read_number(v->text, v) ? RL_NUMBER : RL_TEXT;
}
