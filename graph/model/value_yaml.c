/* YAML into a tree of values: libyaml scans and parses, value_scalar.c says what a plain scalar means. */
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/model/value.h"
#include "graph/model/value_scalar.h"

enum {
    DEEPEST = 64,         /* lists and maps within each other */
    MOST_ALIASED = 100000 /* values that aliases may stand for, together */
};

typedef struct anchor {
    const char *name;
    rl_value *value; /* NULL while its own content is being read */
    size_t size;     /* values in it, itself included, aliases expanded */
    struct anchor *next;
} anchor;

typedef struct reader {
    rl_arena *arena;
    rl_error *err;
    const char *name; /* in the arena */
    const char *text;
    size_t text_size;
    yaml_parser_t parser;
    anchor *anchors; /* newest first: a name may be used again */
    size_t values, aliased;
    int depth;
} reader;

static rl_code read_value(reader *r, yaml_event_t *event, rl_value **out);

static rl_where at(const reader *r, yaml_mark_t mark)
{
    return (rl_where){.file = r->name, .line = (int)mark.line + 1, .column = (int)mark.column + 1};
}

static rl_code no_memory(reader *r, size_t bytes)
{
    return rl_fail_memory(r->err, bytes);
}

/* ---- nodes ---- */

static const char tag_prefix[] = "tag:yaml.org,2002:";

static rl_code unknown_tag(reader *r, const char *tag, rl_where where)
{
    return rl_fail(r->err, RL_E_CONFIG, where,
                   "the tag '%s' is not known here; known: !!bool, !!float, !!int, "
                   "!!map, !!null, !!seq, !!str",
                   tag);
}

/* A scalar with a tag must be what the tag says. */
static rl_code apply_tag(reader *r, const char *tag, rl_value *v)
{
    size_t n = strlen(tag_prefix);
    if (!strcmp(tag, "!")) {
        v->kind = RL_TEXT;
        return RL_OK;
    }
    const char *name = strncmp(tag, tag_prefix, n) ? "" : tag + n;
    bool fits = true, text = !strcmp(name, "str");
    rl_kind kind = text ? RL_TEXT : rl_scalar_resolve(v);
    if (!strcmp(name, "int"))
        fits = kind == RL_NUMBER && v->integral;
    else if (!strcmp(name, "float"))
        fits = kind == RL_NUMBER;
    else if (!strcmp(name, "bool"))
        fits = kind == RL_TRUTH;
    else if (!strcmp(name, "null"))
        fits = kind == RL_NULL;
    else if (!text)
        return unknown_tag(r, tag, v->where);
    if (!fits)
        return rl_fail(r->err, RL_E_CONFIG, v->where, "'%s' is not what its tag !!%s says", v->text, name);
    v->kind = kind;
    return RL_OK;
}

static rl_code read_scalar(reader *r, const yaml_event_t *event, rl_value *v)
{
    const char *text = (const char *)event->data.scalar.value;
    size_t n = event->data.scalar.length;
    if (memchr(text, 0, n))
        return rl_fail(r->err, RL_E_CONFIG, v->where, "a text with a zero byte in it");
    v->text = rl_arena_strndup(r->arena, text, n);
    if (!v->text)
        return no_memory(r, n + 1);
    if (event->data.scalar.tag)
        return apply_tag(r, (const char *)event->data.scalar.tag, v);
    v->kind = event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE ? rl_scalar_resolve(v) : RL_TEXT;
    return RL_OK;
}

static rl_code next_event(reader *r, yaml_event_t *event)
{
    yaml_parser_t *p = &r->parser;
    if (yaml_parser_parse(p, event))
        return RL_OK;
    memset(event, 0, sizeof *event);
    if (p->error == YAML_MEMORY_ERROR)
        return no_memory(r, r->text_size);
    rl_where where = at(r, p->problem_mark);
    if (p->error == YAML_READER_ERROR) { /* has only a byte offset */
        where.line = where.column = 1;
        for (size_t i = 0; i < p->problem_offset && i < r->text_size; i++) {
            where.column =
                r->text[i] == '\n' ? 1 : where.column + (((unsigned char)r->text[i] & 0xC0) != 0x80);
            where.line += r->text[i] == '\n';
        }
    }
    return rl_fail(r->err, RL_E_CONFIG, where, "not YAML: %s%s%s", p->context ? p->context : "",
                   p->context ? ": " : "", p->problem ? p->problem : "unreadable");
}

/* Room for one more element; arrays double, what they leave behind stays in the arena. */
static void *grown(reader *r, void *old, size_t n, size_t *room, size_t size)
{
    if (n < *room)
        return old;
    size_t more = *room ? *room * 2 : 4;
    void *fresh = rl_arena_array(r->arena, more, size);
    if (!fresh)
        return NULL;
    if (n)
        memcpy(fresh, old, n * size);
    *room = more;
    return fresh;
}

static rl_code read_list(reader *r, rl_value *v)
{
    size_t room = 0;
    for (;;) {
        yaml_event_t event;
        rl_code code = next_event(r, &event);
        if (code || event.type == YAML_SEQUENCE_END_EVENT) {
            yaml_event_delete(&event);
            return code;
        }
        rl_value **items = grown(r, v->items, v->n, &room, sizeof *items);
        if (items) {
            v->items = items;
            code = read_value(r, &event, &items[v->n]);
        } else {
            code = no_memory(r, 2 * room * sizeof *items);
        }
        yaml_event_delete(&event);
        if (code)
            return code;
        v->n++;
    }
}

static int by_key_then_place(const void *a, const void *b)
{
    const rl_entry *x = *(const rl_entry *const *)a, *y = *(const rl_entry *const *)b;
    int c = strcmp(x->key, y->key);
    return c ? c : (x > y) - (x < y);
}

/* By sorting, since a file may be large and hostile. */
static rl_code check_duplicates(reader *r, const rl_value *v)
{
    if (v->n < 2)
        return RL_OK;
    const rl_entry **sorted = rl_malloc(v->n * sizeof *sorted);
    if (!sorted)
        return no_memory(r, v->n * sizeof *sorted);
    for (size_t i = 0; i < v->n; i++)
        sorted[i] = &v->entries[i];
    qsort(sorted, v->n, sizeof *sorted, by_key_then_place);
    const rl_entry *first = NULL, *again = NULL;
    for (size_t i = 1; i < v->n; i++)
        if (!strcmp(sorted[i]->key, sorted[i - 1]->key) && (!again || sorted[i] < again)) {
            first = sorted[i - 1];
            again = sorted[i];
        }
    rl_free(sorted);
    if (!again)
        return RL_OK;
    return rl_fail(r->err, RL_E_CONFIG, again->where, "the key '%s' is given twice, first in line %d",
                   again->key, first->where.line);
}

static rl_code read_key(reader *r, yaml_event_t *event, rl_entry *e)
{
    rl_value *key = NULL;
    rl_where where = at(r, event->start_mark);
    rl_code code = read_value(r, event, &key);
    if (code)
        return code;
    if (!key->text)
        return rl_fail(r->err, RL_E_CONFIG, where, "a key must be a word or a number, not %s",
                       key->kind == RL_LIST ? "a list" : "a map");
    if (key->kind == RL_NULL && !key->text[0])
        return rl_fail(r->err, RL_E_CONFIG, where, "a key is missing before ':'");
    e->key = key->text;
    e->where = where;
    return RL_OK;
}

static rl_code read_map(reader *r, rl_value *v)
{
    size_t room = 0;
    for (;;) {
        yaml_event_t event;
        rl_code code = next_event(r, &event);
        if (code || event.type == YAML_MAPPING_END_EVENT) {
            yaml_event_delete(&event);
            return code ? code : check_duplicates(r, v);
        }
        rl_entry *entries = grown(r, v->entries, v->n, &room, sizeof *entries);
        if (entries) {
            v->entries = entries;
            code = read_key(r, &event, &entries[v->n]);
        } else {
            code = no_memory(r, 2 * room * sizeof *entries);
        }
        yaml_event_delete(&event);
        if (code || (code = next_event(r, &event)))
            return code;
        code = read_value(r, &event, &v->entries[v->n].value);
        yaml_event_delete(&event);
        if (code)
            return code;
        v->n++;
    }
}

static rl_code read_alias(reader *r, const yaml_event_t *event, rl_value **out)
{
    const char *name = (const char *)event->data.alias.anchor;
    rl_where where = at(r, event->start_mark);
    anchor *a = r->anchors;
    while (a && strcmp(a->name, name))
        a = a->next;
    if (!a)
        return rl_fail(r->err, RL_E_CONFIG, where, "the alias '*%s' has no anchor '&%s' before it", name,
                       name);
    if (!a->value)
        return rl_fail(r->err, RL_E_CONFIG, where, "the alias '*%s' stands inside its own anchor", name);
    r->values += a->size;
    r->aliased += a->size;
    if (r->aliased > MOST_ALIASED)
        return rl_fail(r->err, RL_E_CONFIG, where, "the aliases stand for more than %d values", MOST_ALIASED);
    *out = a->value;
    return RL_OK;
}

static rl_code read_collection(reader *r, const yaml_event_t *event, rl_value *v)
{
    bool list = event->type == YAML_SEQUENCE_START_EVENT;
    const char *tag = (const char *)(list ? event->data.sequence_start.tag : event->data.mapping_start.tag);
    const char *own = list ? "tag:yaml.org,2002:seq" : "tag:yaml.org,2002:map";
    v->kind = list ? RL_LIST : RL_MAP;
    if (tag && strcmp(tag, own) && strcmp(tag, "!"))
        return unknown_tag(r, tag, v->where);
    if (r->depth == DEEPEST)
        return rl_fail(r->err, RL_E_CONFIG, v->where, "lists and maps within each other more than %d deep",
                       DEEPEST);
    r->depth++;
    rl_code code = list ? read_list(r, v) : read_map(r, v);
    r->depth--;
    return code;
}

/* The value that starts with `event`, which the caller deletes. */
static rl_code read_value(reader *r, yaml_event_t *event, rl_value **out)
{
    if (event->type == YAML_ALIAS_EVENT)
        return read_alias(r, event, out);
    rl_value *v = rl_arena_alloc(r->arena, sizeof *v);
    if (!v)
        return no_memory(r, sizeof *v);
    v->where = at(r, event->start_mark);
    bool scalar = event->type == YAML_SCALAR_EVENT, list = event->type == YAML_SEQUENCE_START_EVENT;
    const yaml_char_t *name = scalar ? event->data.scalar.anchor
                              : list ? event->data.sequence_start.anchor
                                     : event->data.mapping_start.anchor;
    size_t before = r->values++;
    anchor *a = NULL;
    if (name) {
        a = rl_arena_alloc(r->arena, sizeof *a);
        if (!a || !(a->name = rl_arena_strdup(r->arena, (const char *)name)))
            return no_memory(r, sizeof *a);
        a->next = r->anchors;
        r->anchors = a;
    }
    rl_code code = scalar ? read_scalar(r, event, v) : read_collection(r, event, v);
    if (code)
        return code;
    if (a) {
        a->value = v;
        a->size = r->values - before;
    }
    *out = v;
    return RL_OK;
}

static rl_code read_document(reader *r, rl_value **out)
{
    for (;;) {
        yaml_event_t event;
        rl_code code = next_event(r, &event);
        yaml_event_type_t type = event.type;
        if (code || type == YAML_STREAM_END_EVENT) {
            yaml_event_delete(&event);
            return code;
        }
        if (type == YAML_DOCUMENT_START_EVENT && *out)
            code =
                rl_fail(r->err, RL_E_CONFIG, at(r, event.start_mark), "a second document; a file holds one");
        else if (type != YAML_STREAM_START_EVENT && type != YAML_DOCUMENT_START_EVENT &&
                 type != YAML_DOCUMENT_END_EVENT)
            code = read_value(r, &event, out);
        yaml_event_delete(&event);
        if (code)
            return code;
    }
}

rl_code rl_yaml_parse(rl_arena *arena, const char *text, size_t size, const char *name, rl_value **out,
                      rl_error *err)
{
    reader r = {.arena = arena, .err = err, .text = text, .text_size = size};
    *out = NULL;
    r.name = rl_arena_strdup(arena, name);
    if (!r.name)
        return rl_fail_memory(err, strlen(name) + 1);
    if (!yaml_parser_initialize(&r.parser))
        return rl_fail_memory(err, sizeof r.parser);
    yaml_parser_set_input_string(&r.parser, (const unsigned char *)text, size);
    rl_value *v = NULL;
    rl_code code = read_document(&r, &v);
    yaml_parser_delete(&r.parser);
    if (!code && !v) { /* an empty file is the empty value */
        v = rl_arena_alloc(arena, sizeof *v);
        if (!v)
            return rl_fail_memory(err, sizeof *v);
        v->where = (rl_where){.file = r.name, .line = 1, .column = 1};
        v->text = "";
    }
    if (!code)
        *out = v;
    return code;
}

rl_code rl_yaml_load(rl_arena *arena, const char *path, rl_value **out, rl_error *err)
{
    char *text;
    size_t size;
    *out = NULL;
    rl_code code = rl_file_read(path, &text, &size, err);
    if (code)
        return code;
    if (size > 4 && !memcmp(text, "\x76\x2f\x31\x01", 4)) /* the slip that is most likely */
        code =
            rl_fail_file(err, RL_E_CONFIG, path,
                         "this is an OpenEXR file, not YAML (`relit init` prints a pipeline for a capture, "
                         "`relit inspect` a manifest)");
    else
        code = rl_yaml_parse(arena, text, size, path, out, err);
    rl_free(text);
    return code;
}
