/* The files of a manifest, and its frames. */
#include "graph/model/manifest_parts.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

/* Where the next frame number of a pattern stands: "####" (at least as many digits), "%d" or "%04d". */
typedef struct slot {
    const char *at;
    size_t length;
    int width;
} slot;

static bool find_slot(const char *text, slot *out)
{
    for (const char *p = text; *p; p++) {
        size_t hashes = strspn(p, "#");
        if (hashes) {
            *out = (slot){p, hashes, hashes < 20 ? (int)hashes : 20};
            return true;
        }
        if (*p != '%')
            continue;
        const char *d = p + 1;
        int width = 0;
        for (; isdigit((unsigned char)*d) && width < 20; d++)
            width = width * 10 + (*d - '0');
        if (*d != 'd')
            continue;
        *out = (slot){p, (size_t)(d + 1 - p), width < 20 ? width : 20};
        return true;
    }
    return false;
}

/* The pattern with every slot filled; as printf's %0Nd, so -1 in #### is -001. */
static void expand(rl_str *out, const char *pattern, int frame)
{
    slot s;
    while (find_slot(pattern, &s)) {
        rl_str_addn(out, pattern, (size_t)(s.at - pattern));
        rl_str_printf(out, "%0*d", s.width, frame);
        pattern = s.at + s.length;
    }
    rl_str_add(out, pattern);
}

char *rl_manifest_path(rl_arena *arena, const rl_manifest *m, const rl_layer *layer, int frame)
{
    rl_str s = {0};
    expand(&s, m->patterns[layer->pattern].path, frame);
    char *path = s.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&s));
    rl_str_free(&s);
    return path;
}

char *rl_manifest_stem(rl_arena *arena, const char *path)
{
    const char *name = rl_path_name(path);
    size_t n = strlen(name) - strlen(rl_path_extension(path));
    slot s;
    if (find_slot(name, &s) && (size_t)(s.at - name) < n)
        n = (size_t)(s.at - name);
    size_t digits = n; /* a number without separator, as in take2, is part of the name */
    while (digits > 0 && isdigit((unsigned char)name[digits - 1]))
        digits--;
    if (digits > 0 && strchr("._-", name[digits - 1]))
        n = digits;
    while (n > 0 && strchr("._- ", name[n - 1]))
        n--;
    return n ? rl_arena_strndup(arena, name, n) : rl_arena_strdup(arena, "capture");
}

static rl_code add_pattern(rl_manifest_reader *r, const rl_value *v, int *index)
{
    rl_manifest *m = r->m;
    if (v->kind != RL_TEXT || !v->text[0])
        return rl_value_wrong(v, "files", "a path, such as shot.####.exr", r->err);
    char *path = rl_value_path(r->arena, v);
    if (!path)
        return rl_fail_memory(r->err, strlen(v->text));
    slot s;
    *index = m->n_patterns++;
    m->patterns[*index] = (rl_pattern){.path = path, .where = v->where, .numbered = find_slot(path, &s)};
    return RL_OK;
}

static bool is_for(const rl_layer *layer, const char *key)
{
    return !strcmp(key, layer->name) || !strcmp(key, rl_layer_types[layer->id].name) ||
           !strcmp(key, "default");
}

/* The entry for a layer: its own name before its kind's ("shadow" for all lights) before "default". */
static const rl_entry *entry_for(const rl_value *v, const rl_layer *layer)
{
    const char *names[] = {layer->name, rl_layer_types[layer->id].name, "default"};
    for (int i = 0; i < 3; i++)
        for (size_t k = 0; k < v->n; k++)
            if (!strcmp(v->entries[k].key, names[i]))
                return &v->entries[k];
    return NULL;
}

static rl_code unknown_layer(rl_manifest_reader *r, const rl_entry *e)
{
    const rl_manifest *m = r->m;
    const char **names = rl_arena_array(r->arena, (size_t)m->n_layers + 1, sizeof *names);
    if (!names)
        return rl_fail_memory(r->err, 64);
    for (int i = 0; i < m->n_layers; i++)
        names[i] = m->layers[i].name;
    names[m->n_layers] = "default";
    return rl_fail_unknown(r->err, e->where, "files: the capture has no layer", e->key, names,
                           (size_t)m->n_layers + 1);
}

static rl_code read_file_map(rl_manifest_reader *r, const rl_value *v)
{
    rl_manifest *m = r->m;
    for (size_t i = 0; i < v->n; i++) {
        int index;
        bool used = !strcmp(v->entries[i].key, "default");
        for (int k = 0; k < m->n_layers && !used; k++)
            used = is_for(&m->layers[k], v->entries[i].key);
        rl_code code = used ? add_pattern(r, v->entries[i].value, &index) : unknown_layer(r, &v->entries[i]);
        if (code)
            return code;
    }
    for (int k = 0; k < m->n_layers; k++) {
        const rl_entry *e = entry_for(v, &m->layers[k]);
        if (!e && !m->layers[k].n_channels) /* a constant is in no file */
            continue;
        if (!e)
            return rl_fail(r->err, RL_E_CONFIG, v->where,
                           "files: no file is given for layer '%s' (nor a default)", m->layers[k].name);
        m->layers[k].pattern = (int)(e - v->entries);
    }
    return RL_OK;
}

rl_code rl_manifest_read_files(rl_manifest_reader *r, const rl_value *v)
{
    rl_manifest *m = r->m;
    int index;
    if (!v)
        return rl_fail(r->err, RL_E_CONFIG, m->where, "a capture needs 'files', such as shot.####.exr");
    if (v->kind == RL_MAP && !v->n)
        return rl_value_wrong(v, "files", "a path or a map, layer: path", r->err);
    if (v->kind == RL_TEXT &&
        !strcmp(v->text, "memory")) /* frames come through the C API: no file, no pattern */
        return RL_OK;
    size_t n = v->kind == RL_MAP ? v->n : 1;
    m->patterns = rl_arena_array(r->arena, n, sizeof *m->patterns);
    if (!m->patterns)
        return rl_fail_memory(r->err, n * sizeof *m->patterns);
    return v->kind == RL_MAP ? read_file_map(r, v) : add_pattern(r, v, &index);
}

/* ---- frames ---- */

rl_code rl_manifest_read_frames(rl_manifest_reader *r, const rl_value *v, const char *name, rl_frames *out)
{
    if (v->kind == RL_TEXT || (v->kind == RL_NUMBER && v->integral))
        return rl_frames_parse(r->arena, v->text, v->where, out, r->err);
    if (v->kind != RL_LIST || v->n > RL_FRAMES_MOST)
        return rl_value_wrong(v, name, "frames, such as 1-24 or [1, 5, 9]", r->err);
    int *numbers = rl_arena_array(r->arena, v->n, sizeof *numbers);
    if (!numbers)
        return rl_fail_memory(r->err, v->n * sizeof *numbers);
    for (size_t i = 0; i < v->n; i++) {
        long long n;
        rl_code code = rl_value_integer(v->items[i], name, -2000000000, 2000000000, &n, r->err);
        if (code)
            return code;
        numbers[i] = (int)n;
    }
    *out = rl_frames_from(numbers, v->n);
    return RL_OK;
}

/* The frame number for which the pattern expands to exactly this file name. */
static bool frame_of(const char *pattern, const char *name, int *frame)
{
    slot s;
    if (!find_slot(pattern, &s) || strncmp(pattern, name, (size_t)(s.at - pattern)))
        return false;
    char *end;
    errno = 0;
    const char *digits = name + (s.at - pattern);
    if (!isdigit((unsigned char)*digits) && *digits != '-')
        return false;
    long n = strtol(digits, &end, 10);
    if (errno || end == digits || n > INT_MAX || n < -INT_MAX)
        return false;
    rl_str full = {0};
    expand(&full, pattern, (int)n);
    bool same = !full.failed && !strcmp(rl_str_text(&full), name);
    rl_str_free(&full);
    *frame = (int)n;
    return same;
}

/* Frame numbers as they are found; owned by malloc until they move to the arena. */
typedef struct found {
    int *numbers;
    size_t n, room;
} found;

static bool add_found(found *f, int number)
{
    if (f->n == f->room) {
        size_t room = f->room ? f->room * 2 : 64;
        int *grown = rl_realloc(f->numbers, room * sizeof *grown);
        if (!grown)
            return false;
        f->numbers = grown;
        f->room = room;
    }
    f->numbers[f->n++] = number;
    return true;
}

static rl_code look(rl_manifest_reader *r, const rl_pattern *p, found *f)
{
    char *folder = rl_path_folder(r->arena, p->path);
    slot s;
    if (!folder)
        return rl_fail_memory(r->err, strlen(p->path));
    if (find_slot(folder, &s))
        return rl_fail(r->err, RL_E_CONFIG, p->where,
                       "frame numbers in the folder's name: give 'frames' too");
    DIR *dir = opendir(folder);
    if (!dir)
        return rl_fail(r->err, RL_E_CONFIG, p->where, "the folder '%s' cannot be read: %s", folder,
                       strerror(errno));
    rl_code code = RL_OK;
    size_t before = f->n;
    for (struct dirent *e; !code && (e = readdir(dir));) {
        int frame;
        if (!frame_of(rl_path_name(p->path), e->d_name, &frame))
            continue;
        if (f->n >= RL_FRAMES_MOST)
            code = rl_fail(r->err, RL_E_CONFIG, p->where, "more than %d files match '%s'", RL_FRAMES_MOST,
                           p->path);
        else if (!add_found(f, frame))
            code = rl_fail_memory(r->err, f->room * 2 * sizeof(int));
    }
    closedir(dir);
    if (!code && f->n == before)
        code = rl_fail(r->err, RL_E_CONFIG, p->where, "no file matches '%s'", p->path);
    return code;
}

/* Frames of any pattern count: a layer that lacks some is then an error of those frames, not a silent gap. */
rl_code rl_manifest_find_frames(rl_manifest_reader *r)
{
    rl_manifest *m = r->m;
    found f = {0};
    rl_code code = RL_OK;
    for (int i = 0; i < m->n_patterns && !code; i++)
        if (m->patterns[i].numbered)
            code = look(r, &m->patterns[i], &f);
    m->frames_found = f.n > 0;
    if (!code && !f.n && !add_found(&f, 1))
        code = rl_fail_memory(r->err, sizeof(int));
    int *numbers = code ? NULL : rl_arena_array(r->arena, f.n, sizeof *numbers);
    if (numbers) {
        memcpy(numbers, f.numbers, f.n * sizeof *numbers);
        m->frames = rl_frames_from(numbers, f.n);
    } else if (!code) {
        code = rl_fail_memory(r->err, f.n * sizeof *numbers);
    }
    rl_free(f.numbers);
    return code;
}
