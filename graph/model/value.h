/* A tree of configuration values, each with the place that it was read from. YAML comes in through
 * rl_yaml_load; nothing behind this header knows about YAML. Trees live in an arena and are constant once
 * they are merged; the functions here that change a tree are used by the loader, by includes and by --set. */
#ifndef RL_MODEL_VALUE_H
#define RL_MODEL_VALUE_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rl_kind { RL_NULL, RL_TRUTH, RL_NUMBER, RL_TEXT, RL_LIST, RL_MAP } rl_kind;

typedef struct rl_value rl_value;

typedef struct rl_entry {
    const char *key;
    rl_where where; /* of the key */
    rl_value *value;
} rl_entry;

struct rl_value {
    rl_kind kind;
    rl_where where; /* of the value; .file lives in the arena. "--set graph.sss.taps" for values from there */
    const char *text; /* scalars: exactly what was written, quotes removed; else NULL */
    bool truth;       /* RL_TRUTH */
    bool implied;     /* RL_MAP: nobody wrote it; rl_value_set made it on the way to a value below */
    bool integral;    /* RL_NUMBER: written as an integer (decimal, 0x or 0o) that fits `integer` */
    long long integer;
    double number;     /* RL_NUMBER; .nan and .inf are numbers */
    size_t n;          /* RL_LIST, RL_MAP */
    rl_value **items;  /* RL_LIST */
    rl_entry *entries; /* RL_MAP, in the order of the file */
};

/* ---- reading (value_yaml.c) ---- */

/* One YAML 1.2 document (core schema; anchors and aliases, expansion bounded; duplicate keys, tags other than
 * the core's, several documents and non-scalar keys are errors with a place). `name` is what errors call it.
 */
rl_code rl_yaml_parse(rl_arena *arena, const char *text, size_t size, const char *name, rl_value **out,
                      rl_error *err);
rl_code rl_yaml_load(rl_arena *arena, const char *path, rl_value **out, rl_error *err);

/* The same, with `include: [path, …]` (or one path) at the top merged first, recursively; paths are relative
 * to the file that names them; a loop is an error that prints the chain. The `include` key itself is dropped.
 */
rl_code rl_config_load(rl_arena *arena, const char *path, rl_value **out, rl_error *err);

/* ---- looking (value.c) ---- */

/* NULL when v is not a map or has no such key. */
const rl_value *rl_value_get(const rl_value *v, const char *key);
/* By a dotted path, list elements by index: "profiles.skin.gaussians.0.weight". NULL when it leads nowhere.
 */
const rl_value *rl_value_at(const rl_value *root, const char *path);
/* "a number", "a list", "the text 'foo'", "null": for "expected …, found …". Uses buf (>= 96 bytes). */
const char *rl_value_describe(const rl_value *v, char *buf);
/* The value as compact YAML flow text, keys in order, numbers shortest: for reports and content hashes. */
struct rl_str; /* graph/base/text.h */
void rl_value_print(const rl_value *v, struct rl_str *out);

/* The text of v as a path: relative to the file that v was read from; for a value of the command line (it has
 * no line) relative to the working folder. NULL when memory is out. */
char *rl_value_path(rl_arena *arena, const rl_value *v);

/* ---- changing (value.c) ---- */

/* over wins: maps merge key by key, everything else (lists too) replaces; null removes the key. Returns the
 * merged tree, which shares parts with both; NULL when memory is out. */
rl_value *rl_value_merge(rl_arena *arena, rl_value *base, rl_value *over);
/* --set: puts v at a dotted path of *root, creating maps on the way; RL_NULL removes. List elements can be
 * replaced by index, not added. `where` names the option in errors. */
rl_code rl_value_set(rl_arena *arena, rl_value **root, const char *path, rl_value *v, rl_error *err);

/* ---- checked reading of maps, for every parser of a config (value.c) ---- */

/* All keys of the map are among `known` (n names), else an error at the first other key: "<what> has no key
 * 'x'; did you mean 'y'? known: …". v must be a map (an error says what was found). */
rl_code rl_value_keys(const rl_value *v, const char *what, const char *const *known, size_t n, rl_error *err);

/* "<head> 'name'; did you mean 'y'? known: …", e.g. head "pass 'sss' (sss_burley) has no parameter". */
rl_code rl_fail_unknown(rl_error *err, rl_where where, const char *head, const char *name,
                        const char *const *known, size_t n);

/* "expected <expected>, found <describe>" at the place of v, with `name` in front: "'fov_x': expected …". */
rl_code rl_value_wrong(const rl_value *v, const char *name, const char *expected, rl_error *err);

/* Scalars with their range in double, NaN refused; `name` is the key, for errors. */
rl_code rl_value_number(const rl_value *v, const char *name, double min, double max, double *out,
                        rl_error *err);
rl_code rl_value_integer(const rl_value *v, const char *name, long long min, long long max, long long *out,
                         rl_error *err);
rl_code rl_value_truth(const rl_value *v, const char *name, bool *out, rl_error *err);
rl_code rl_value_text(const rl_value *v, const char *name, const char **out, rl_error *err);
/* One of the words "a|b|c": its index. Suggests the nearest. */
rl_code rl_value_word(const rl_value *v, const char *name, const char *words, int *out, rl_error *err);
/* Exactly n numbers. */
rl_code rl_value_numbers(const rl_value *v, const char *name, size_t n, double *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
