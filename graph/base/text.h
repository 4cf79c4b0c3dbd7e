/* Text: growing strings, numbers in the C locale whatever the process's locale is, nearest names. */
#ifndef RL_BASE_TEXT_H
#define RL_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A growing string. All zero is empty. After an allocation failed, `failed` is set and appends do nothing:
 * check once at the end. */
typedef struct rl_str {
    char *text; /* terminated, or NULL while empty; owned, freed by rl_str_free */
    size_t length, room;
    bool failed;
} rl_str;

void rl_str_add(rl_str *s, const char *text);
void rl_str_addn(rl_str *s, const char *text, size_t n);
void rl_str_printf(rl_str *s, const char *fmt, ...) RL_PRINTF(2, 3);
const char *rl_str_text(const rl_str *s); /* never NULL */
void rl_str_free(rl_str *s);

/* The whole of `text` as a number in the C locale ("1e10", "-3", ".5"); false when anything else is there. */
bool rl_parse_double(const char *text, double *out);
bool rl_parse_int(const char *text, long long *out);

/* The shortest text that reads back as the same float / double ("0.05", not "0.0500000007"); C locale.
 * `out` holds at least 32 bytes. Returns out. */
char *rl_format_float(float value, char *out);
char *rl_format_double(double value, char *out);

/* "4G", "512M", "1.5GiB", "1000000": bytes (powers of 1024). */
bool rl_parse_bytes(const char *text, unsigned long long *out);
/* "1.4 GiB". `out` holds at least 32 bytes. Returns out. */
char *rl_format_bytes(unsigned long long bytes, char *out);

/* The candidate nearest to `name` (Damerau-Levenshtein, at most a third of the length away), or NULL. */
const char *rl_nearest(const char *name, const char *const *candidates, size_t n);

/* Adds "; did you mean 'x'? known: a, b, c" (the first part only when something is near, or `name` is the
 * beginning of one candidate, three letters at least; names sorted).
 * `what` is the word before the list, e.g. "known". */
void rl_suggest(rl_str *s, const char *name, const char *const *candidates, size_t n, const char *what);

#ifdef __cplusplus
}
#endif
#endif
