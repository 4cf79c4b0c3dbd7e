#include "graph/base/text.h"

#include <ctype.h>
#include <errno.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "graph/base/alloc.h"

static locale_t c_locale;
static pthread_once_t c_locale_once = PTHREAD_ONCE_INIT;

static void make_c_locale(void)
{
    c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

void rl_str_addn(rl_str *s, const char *text, size_t n)
{
    if (s->failed)
        return;
    if (s->length + n + 1 > s->room) {
        size_t room = (s->length + n + 1) * 2;
        char *grown = rl_realloc(s->text, room);
        if (!grown) {
            s->failed = true;
            return;
        }
        s->text = grown;
        s->room = room;
    }
    memcpy(s->text + s->length, text, n);
    s->length += n;
    s->text[s->length] = 0;
}

void rl_str_add(rl_str *s, const char *text)
{
    rl_str_addn(s, text, strlen(text));
}

void rl_str_printf(rl_str *s, const char *fmt, ...)
{
    char small[256];
    va_list args, again;
    va_start(args, fmt);
    va_copy(again, args);
    int n = vsnprintf(small, sizeof small, fmt, args);
    va_end(args);
    if (n >= 0 && (size_t)n < sizeof small) {
        rl_str_addn(s, small, (size_t)n);
    } else if (n >= 0) {
        char *large = rl_malloc((size_t)n + 1);
        if (large) {
            vsnprintf(large, (size_t)n + 1, fmt, again);
            rl_str_addn(s, large, (size_t)n);
        } else {
            s->failed = true;
        }
        rl_free(large);
    }
    va_end(again);
}

const char *rl_str_text(const rl_str *s)
{
    return s->text ? s->text : "";
}

void rl_str_free(rl_str *s)
{
    rl_free(s->text);
    *s = (rl_str){0};
}

bool rl_parse_double(const char *text, double *out)
{
    pthread_once(&c_locale_once, make_c_locale);
    char *end;
    if (!*text || isspace((unsigned char)*text))
        return false;
    double v = strtod_l(text, &end, c_locale);
    if (*end || end == text)
        return false;
    *out = v;
    return true;
}

bool rl_parse_int(const char *text, long long *out)
{
    char *end;
    if (!*text || isspace((unsigned char)*text))
        return false;
    errno = 0;
    long long v = strtoll(text, &end, 10);
    if (*end || end == text || errno)
        return false;
    *out = v;
    return true;
}

/* "1e+10" -> "1e10", "1e-05" -> "1e-5" */
static void trim_exponent(char *text)
{
    char *e = strchr(text, 'e');
    if (!e)
        return;
    char *to = e + 1, *from = e + 1;
    if (*from == '-')
        *to++ = *from++;
    else if (*from == '+')
        from++;
    while (*from == '0' && from[1])
        from++;
    memmove(to, from, strlen(from) + 1);
}

static char *format_shortest(double value, int last, bool single, char *out)
{
    pthread_once(&c_locale_once, make_c_locale);
    locale_t before = uselocale(c_locale);
    for (int digits = 1; digits <= last; digits++) {
        snprintf(out, 32, "%.*g", digits, value);
        double back = strtod(out, NULL);
        if (single ? (float)back == (float)value : back == value)
            break;
    }
    /* 100 and not 1e+02: what %g writes with an exponent of 0 or more is an integer, and below 1e6 exact */
    if (strchr(out, 'e') && fabs(value) >= 1 && fabs(value) < 1e6)
        snprintf(out, 32, "%.0f", value);
    uselocale(before);
    trim_exponent(out);
    return out;
}

char *rl_format_float(float value, char *out)
{
    return format_shortest((double)value, 9, true, out);
}

char *rl_format_double(double value, char *out)
{
    return format_shortest(value, 17, false, out);
}

bool rl_parse_bytes(const char *text, unsigned long long *out)
{
    pthread_once(&c_locale_once, make_c_locale);
    char *end;
    double v = strtod_l(text, &end, c_locale);
    if (end == text || !(v > 0))
        return false;
    static const char units[] = "KMGT";
    const char *unit = *end ? strchr(units, toupper((unsigned char)*end)) : NULL;
    if (unit) {
        v *= exp2(10.0 * (double)(unit - units + 1));
        end++;
        if (*end == 'i')
            end++;
    }
    if (*end == 'B')
        end++;
    if (*end || !(v < 1e18))
        return false;
    *out = (unsigned long long)v;
    return true;
}

char *rl_format_bytes(unsigned long long bytes, char *out)
{
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    double v = (double)bytes;
    int u = 0;
    for (; v >= 1024 && u < 4; u++)
        v /= 1024;
    pthread_once(&c_locale_once, make_c_locale);
    locale_t before = uselocale(c_locale);
    snprintf(out, 32, u ? "%.1f %s" : "%.0f %s", v, units[u]);
    uselocale(before);
    return out;
}

/* Damerau-Levenshtein distance (adjacent swaps count one), case-insensitive; long names are cut. */
static size_t distance(const char *a, const char *b)
{
    enum { MOST = 63 };
    size_t na = strnlen(a, MOST), nb = strnlen(b, MOST);
    size_t d[MOST + 1][MOST + 1];
    for (size_t i = 0; i <= na; i++)
        d[i][0] = i;
    for (size_t j = 0; j <= nb; j++)
        d[0][j] = j;
    for (size_t i = 1; i <= na; i++) {
        for (size_t j = 1; j <= nb; j++) {
            int x = tolower((unsigned char)a[i - 1]), y = tolower((unsigned char)b[j - 1]);
            size_t best = d[i - 1][j - 1] + (x != y);
            if (d[i - 1][j] + 1 < best)
                best = d[i - 1][j] + 1;
            if (d[i][j - 1] + 1 < best)
                best = d[i][j - 1] + 1;
            if (i > 1 && j > 1 && x == tolower((unsigned char)b[j - 2]) &&
                y == tolower((unsigned char)a[i - 2]) && d[i - 2][j - 2] + 1 < best)
                best = d[i - 2][j - 2] + 1;
            d[i][j] = best;
        }
    }
    return d[na][nb];
}

const char *rl_nearest(const char *name, const char *const *candidates, size_t n)
{
    const char *best = NULL;
    size_t length = strlen(name);
    size_t least = (length < 3 ? 1 : (length + 2) / 3) + 1;
    for (size_t i = 0; i < n; i++) {
        size_t d = distance(name, candidates[i]);
        if (d < least && d < strlen(candidates[i])) {
            least = d;
            best = candidates[i];
        }
    }
    return best;
}

/* The only candidate that begins as `name` does, which has at least three letters ("lamb" for "lambert"). */
static const char *completed(const char *name, const char *const *candidates, size_t n)
{
    const char *found = NULL;
    size_t length = strlen(name);
    for (size_t i = 0; i < n && length >= 3; i++) {
        if (strncasecmp(candidates[i], name, length))
            continue;
        if (found)
            return NULL;
        found = candidates[i];
    }
    return found;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

void rl_suggest(rl_str *s, const char *name, const char *const *candidates, size_t n, const char *what)
{
    const char *near = rl_nearest(name, candidates, n);
    near = near ? near : completed(name, candidates, n);
    if (near)
        rl_str_printf(s, "; did you mean '%s'?", near);
    if (!n)
        return;
    const char **sorted = rl_malloc(n * sizeof *sorted);
    if (!sorted) {
        s->failed = true;
        return;
    }
    memcpy(sorted, candidates, n * sizeof *sorted);
    qsort(sorted, n, sizeof *sorted, by_name);
    rl_str_printf(s, "%s %s: ", near ? "" : ";", what);
    for (size_t i = 0; i < n; i++)
        rl_str_printf(s, "%s%s", i ? ", " : "", sorted[i]);
    rl_free(sorted);
}
