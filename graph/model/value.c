/* The tree of configuration values: looking, merging, setting, printing. Reading with checks is in
 * value_check.c, YAML in value_yaml.c. */
#include "graph/model/value.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/base/text.h"

/* ---- looking ---- */

static const rl_entry *find_n(const rl_value *v, const char *key, size_t length)
{
    if (!v || v->kind != RL_MAP)
        return NULL;
    for (size_t i = 0; i < v->n; i++)
        if (!strncmp(v->entries[i].key, key, length) && !v->entries[i].key[length])
            return &v->entries[i];
    return NULL;
}

const rl_value *rl_value_get(const rl_value *v, const char *key)
{
    const rl_entry *e = find_n(v, key, strlen(key));
    return e ? e->value : NULL;
}

/* The first `length` bytes of text as the index of one of n elements; false when they are none. */
static bool index_of(const char *text, size_t length, size_t n, size_t *out)
{
    size_t i = 0;
    if (length == 0 || length > 9)
        return false;
    for (size_t k = 0; k < length; k++) {
        if (text[k] < '0' || text[k] > '9')
            return false;
        i = i * 10 + (size_t)(text[k] - '0');
    }
    *out = i;
    return i < n;
}

const rl_value *rl_value_at(const rl_value *root, const char *path)
{
    const rl_value *v = root;
    for (;;) {
        size_t length = strcspn(path, "."), i;
        if (v && v->kind == RL_LIST) {
            v = index_of(path, length, v->n, &i) ? v->items[i] : NULL;
        } else {
            const rl_entry *e = find_n(v, path, length);
            v = e ? e->value : NULL;
        }
        if (!v || !path[length])
            return v;
        path += length + 1;
    }
}

char *rl_value_path(rl_arena *arena, const rl_value *v)
{
    bool option = v->where.file && !strncmp(v->where.file, "--", 2); /* "--set PATH=VALUE" */
    if (!v->where.file || v->where.line == 0 || option)
        return rl_arena_strdup(arena, v->text);
    char *folder = rl_path_folder(arena, v->where.file);
    return folder ? rl_path_join(arena, folder, v->text) : NULL;
}

/* ---- printing ---- */

static bool is_plain(const rl_value *v)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_";
    static const char others[] = "0123456789./-#%";
    static const char *const taken[] = {"null", "Null",  "NULL",  "true", "True",
                                        "TRUE", "false", "False", "FALSE"};
    const char *t = v->text;
    if (!t[0] || !strchr(letters, t[0]))
        return false;
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        if (!strcmp(t, taken[i]))
            return false;
    for (; *t; t++)
        if (!strchr(letters, *t) && !strchr(others, *t))
            return false;
    return true;
}

static void print_text(const rl_value *v, rl_str *out)
{
    if (is_plain(v)) {
        rl_str_add(out, v->text);
        return;
    }
    rl_str_add(out, "\"");
    for (const char *t = v->text; *t; t++) {
        if (*t == '"' || *t == '\\')
            rl_str_printf(out, "\\%c", *t);
        else if ((unsigned char)*t < 0x20 || *t == 0x7f)
            rl_str_printf(out, "\\x%02x", (unsigned)(unsigned char)*t);
        else
            rl_str_addn(out, t, 1);
    }
    rl_str_add(out, "\"");
}

static void print_number(const rl_value *v, rl_str *out)
{
    char buf[32];
    if (v->integral)
        rl_str_printf(out, "%lld", v->integer);
    else if (isnan(v->number))
        rl_str_add(out, ".nan");
    else if (isinf(v->number))
        rl_str_add(out, v->number < 0 ? "-.inf" : ".inf");
    else
        rl_str_add(out, rl_format_double(v->number, buf));
}

void rl_value_print(const rl_value *v, rl_str *out)
{
    switch (v ? v->kind : RL_NULL) {
    case RL_NULL:
        rl_str_add(out, "null");
        break;
    case RL_TRUTH:
        rl_str_add(out, v->truth ? "true" : "false");
        break;
    case RL_NUMBER:
        print_number(v, out);
        break;
    case RL_TEXT:
        print_text(v, out);
        break;
    case RL_LIST:
        for (size_t i = 0; i < v->n; i++) {
            rl_str_add(out, i ? ", " : "[");
            rl_value_print(v->items[i], out);
        }
        rl_str_add(out, v->n ? "]" : "[]");
        break;
    case RL_MAP:
        for (size_t i = 0; i < v->n; i++) {
            rl_str_add(out, i ? ", " : "{");
            print_text(&(rl_value){.kind = RL_TEXT, .text = v->entries[i].key}, out);
            rl_str_add(out, ": ");
            rl_value_print(v->entries[i].value, out);
        }
        rl_str_add(out, v->n ? "}" : "{}");
        break;
    }
}

/* The longest start of text that takes at most `most` bytes and cuts no UTF-8 character. */
static size_t whole_characters(const char *text, size_t most)
{
    size_t n = strnlen(text, most + 1);
    if (n <= most)
        return n;
    n = most;
    while (n > 0 && ((unsigned char)text[n] & 0xC0) == 0x80)
        n--;
    return n;
}

const char *rl_value_describe(const rl_value *v, char *buf)
{
    enum { ROOM = 96, SHOWN = 60 };
    size_t n;
    switch (v ? v->kind : RL_NULL) {
    case RL_NULL:
        snprintf(buf, ROOM, "%s", v ? "null" : "nothing");
        break;
    case RL_TRUTH:
        snprintf(buf, ROOM, "%s", v->truth ? "true" : "false");
        break;
    case RL_NUMBER:
    case RL_TEXT:
        n = whole_characters(v->text ? v->text : "", SHOWN);
        snprintf(buf, ROOM, "the %s '%.*s%s'", v->kind == RL_TEXT ? "text" : "number", (int)n,
                 v->text ? v->text : "", v->text && v->text[n] ? "..." : "");
        break;
    case RL_LIST:
        snprintf(buf, ROOM, v->n ? "a list of %zu" : "an empty list", v->n);
        break;
    case RL_MAP:
        snprintf(buf, ROOM, "%s", v->n ? "a map" : "an empty map");
        break;
    }
    return buf;
}

/* ---- changing ---- */

static rl_value *copy_with_room(rl_arena *arena, const rl_value *v, size_t more)
{
    rl_value *copy = rl_arena_alloc(arena, sizeof *copy);
    if (!copy)
        return NULL;
    *copy = *v;
    if (v->kind == RL_MAP) {
        copy->entries = rl_arena_array(arena, v->n + more, sizeof *copy->entries);
        if (!copy->entries)
            return NULL;
        if (v->n)
            memcpy(copy->entries, v->entries, v->n * sizeof *v->entries);
    } else if (v->kind == RL_LIST) {
        copy->items = rl_arena_array(arena, v->n + more, sizeof(rl_value *));
        if (!copy->items)
            return NULL;
        if (v->n)
            memcpy(copy->items, v->items, v->n * sizeof *v->items);
    }
    return copy;
}

static void remove_entry(rl_value *map, rl_entry *e)
{
    size_t i = (size_t)(e - map->entries);
    memmove(e, e + 1, (map->n - i - 1) * sizeof *e);
    map->n--;
}

/* RFC 7396's rule ("JSON merge patch"), which is also what removes a null that has nothing to remove. */
rl_value *rl_value_merge(rl_arena *arena, rl_value *base, rl_value *over)
{
    if (!over || over->kind != RL_MAP)
        return over ? over : base;
    rl_value none = {.kind = RL_MAP, .implied = over->implied};
    rl_value *merged = copy_with_room(arena, base && base->kind == RL_MAP ? base : &none, over->n);
    if (!merged)
        return NULL;
    merged->where = over->where;
    for (size_t i = 0; i < over->n; i++) {
        const rl_entry *from = &over->entries[i];
        rl_entry *e = (rl_entry *)find_n(merged, from->key, strlen(from->key));
        if (from->value->kind == RL_NULL) {
            if (e)
                remove_entry(merged, e);
            continue;
        }
        rl_value *v = rl_value_merge(arena, e ? e->value : NULL, from->value);
        if (!v)
            return NULL;
        if (!e)
            e = &merged->entries[merged->n++];
        *e = (rl_entry){.key = from->key, .where = from->where, .value = v};
    }
    return merged;
}

/* One rl_value_set. Everything on the way is copied, since anchors and merges share parts of trees. */
typedef struct setting {
    rl_arena *arena;
    const char *path; /* the whole */
    rl_value *v;
    rl_error *err;
} setting;

static rl_code set_at(const setting *s, rl_value **at, const char *rest);

static rl_code set_in_list(const setting *s, rl_value *list, const char *rest, size_t length)
{
    size_t i;
    int done = (int)(rest - s->path) - 1;
    if (!index_of(rest, length, list->n, &i))
        return rl_fail(s->err, RL_E_CONFIG, s->v->where,
                       "'%.*s' is a list of %zu (from 0): it has no element '%.*s'", done, s->path, list->n,
                       (int)length, rest);
    if (rest[length])
        return set_at(s, &list->items[i], rest + length + 1);
    if (s->v->kind == RL_NULL)
        return rl_fail(s->err, RL_E_CONFIG, s->v->where,
                       "an element of the list '%.*s' cannot be removed; set the whole list", done, s->path);
    list->items[i] = s->v;
    return RL_OK;
}

static rl_code set_in_map(const setting *s, rl_value *map, const char *rest, size_t length)
{
    rl_entry *e = (rl_entry *)find_n(map, rest, length);
    bool last = !rest[length];
    if (s->v->kind == RL_NULL && !e)
        return RL_OK;
    if (s->v->kind == RL_NULL && last) {
        remove_entry(map, e);
        return RL_OK;
    }
    if (!e) {
        e = &map->entries[map->n];
        *e = (rl_entry){.key = rl_arena_strndup(s->arena, rest, length), .where = s->v->where};
        if (!e->key)
            return rl_fail_memory(s->err, length + 1);
        map->n++;
    }
    if (!last)
        return set_at(s, &e->value, rest + length + 1);
    e->where = s->v->where;
    e->value = s->v;
    return RL_OK;
}

static rl_code set_at(const setting *s, rl_value **at, const char *rest)
{
    size_t length = strcspn(rest, ".");
    rl_value none = {.kind = RL_MAP, .implied = true, .where = s->v->where};
    const rl_value *old = *at && (*at)->kind != RL_NULL ? *at : &none;
    char buf[96];
    if (old->kind != RL_MAP && old->kind != RL_LIST)
        return rl_fail(s->err, RL_E_CONFIG, s->v->where, "'%.*s' is %s: it has no '%s'",
                       rest > s->path ? (int)(rest - s->path) - 1 : 0, s->path, rl_value_describe(old, buf),
                       rest);
    rl_value *copy = copy_with_room(s->arena, old, 1);
    if (!copy)
        return rl_fail_memory(s->err, sizeof *copy + (old->n + 1) * sizeof(rl_entry));
    rl_code code =
        copy->kind == RL_LIST ? set_in_list(s, copy, rest, length) : set_in_map(s, copy, rest, length);
    if (!code)
        *at = copy;
    return code;
}

rl_code rl_value_set(rl_arena *arena, rl_value **root, const char *path, rl_value *v, rl_error *err)
{
    enum { DEEPEST = 32 }; /* far beyond any schema; keeps recursion over trees bounded */
    int depth = 1;
    for (const char *p = path; *p; p++)
        depth += *p == '.';
    size_t n = strlen(path);
    if (!n || path[0] == '.' || path[n - 1] == '.' || strstr(path, ".."))
        return rl_fail(err, RL_E_USAGE, v->where, "'%s' is no dotted path, such as graph.sss.taps", path);
    if (depth > DEEPEST)
        return rl_fail(err, RL_E_USAGE, v->where, "the path has %d parts; the most is %d", depth, DEEPEST);
    setting s = {.arena = arena, .path = path, .v = v, .err = err};
    return set_at(&s, root, path);
}
