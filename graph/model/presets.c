/* Presets: what renderers call their channels, as YAML files of a folder (configs/presets), so that users add
 * their own. A preset is a piece of manifest with `relit_preset: 1`, `help` and `source` on top; in it, the
 * names of a layer's channels may hold a '*' (the view layer's name, the same for all layers), and `channels`
 * may list alternatives, the first of which that a file has is taken. `check` lists what `relit inspect`
 * tells those who use it to look after. */
#include "graph/model/manifest_parts.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

/* ---- names ---- */

/* Whether the name fits the pattern; `star` gets what '*' stands for (length in *n), or stays if there is
 * none. */
static bool fits(const char *pattern, const char *name, const char **star, size_t *n)
{
    const char *p = strchr(pattern, '*');
    if (!p)
        return !strcmp(pattern, name);
    size_t head = (size_t)(p - pattern), tail = strlen(p + 1), length = strlen(name);
    if (length < head + tail || strncmp(pattern, name, head) || strcmp(name + length - tail, p + 1))
        return false;
    *star = name + head;
    *n = length - head - tail;
    return true;
}

static bool same_part(const char *part, const rl_channel *c)
{
    return !part || !strcmp(part, c->part ? c->part : "");
}

/* One file's channels, and the '*' that its layers share. */
typedef struct binder {
    rl_arena *arena;
    rl_manifest *m;
    const rl_channel *channels;
    size_t n;
    const char *star; /* NULL until the first layer that has one is bound */
    size_t star_length;
} binder;

/* The channel that a pattern names when '*' is `star`. */
static const rl_channel *find(const binder *b, const char *pattern, const char *part, const char *star,
                              size_t length)
{
    for (size_t i = 0; i < b->n; i++) {
        const char *s = star;
        size_t n = length;
        const rl_channel *c = &b->channels[i];
        if (same_part(part, c) && fits(pattern, c->name, &s, &n) && n == length && !strncmp(s, star, n))
            return c;
    }
    return NULL;
}

/* All channels of one alternative, in the part of the first, '*' being `star`. */
static bool has_all(const binder *b, const rl_layer *layer, const char **names, const rl_channel *first,
                    const char *star, size_t length)
{
    const char *part = layer->part ? layer->part : first->part ? first->part : "";
    for (int i = 0; i < layer->n_channels; i++)
        if (!find(b, names[i], part, star, length))
            return false;
    return true;
}

/* Binds a copy of `layer` to one alternative with one '*'; false when memory is out. */
static bool take(const binder *b, rl_layer *layer, const char **names, const char *part, const char *star,
                 size_t length)
{
    const char **channels = rl_arena_array(b->arena, (size_t)layer->n_channels, sizeof *channels);
    if (!channels)
        return false;
    for (int i = 0; i < layer->n_channels; i++) {
        const rl_channel *c = find(b, names[i], part, star, length);
        channels[i] = rl_arena_strdup(b->arena, c->name);
        if (!channels[i])
            return false;
    }
    layer->channels = channels;
    layer->n_alternatives = 1;
    if (!layer->part && part[0] && !(layer->part = rl_arena_strdup(b->arena, part)))
        return false;
    return true;
}

/* Binds one layer that is not per light; *found tells whether the file has it. */
static rl_code bind_layer(binder *b, rl_layer *layer, bool *found, rl_error *err)
{
    *found = false;
    for (int a = 0; a < layer->n_alternatives; a++) {
        const char **names = layer->channels + a * layer->n_channels;
        for (size_t i = 0; i < b->n; i++) {
            const rl_channel *c = &b->channels[i];
            const char *star = b->star ? b->star : "";
            size_t length = b->star ? b->star_length : 0;
            if (!same_part(layer->part, c) || !fits(names[0], c->name, &star, &length))
                continue;
            bool starred = strchr(names[0], '*') != NULL;
            if (starred && b->star && (length != b->star_length || strncmp(star, b->star, length)))
                continue;
            if (!has_all(b, layer, names, c, star, length))
                continue;
            if (starred && !b->star) {
                b->star = star;
                b->star_length = length;
            }
            *found = true;
            return take(b, layer, names, c->part ? c->part : "", star, length) ? RL_OK
                                                                               : rl_fail_memory(err, 64);
        }
    }
    return RL_OK;
}

/* "*: shadow.*" becomes one layer for each channel that fits, its light named by what '*' stands for. */
static rl_code bind_lights(const binder *b, const rl_layer *layer, rl_layer *out, int *n, rl_error *err)
{
    for (size_t i = 0; i < b->n; i++) {
        const char *star = "";
        size_t length = 0;
        const rl_channel *c = &b->channels[i];
        if (!same_part(layer->part, c) || !fits(layer->channels[0], c->name, &star, &length) || !length)
            continue;
        rl_layer *one = &out[(*n)++];
        *one = *layer;
        one->light = rl_arena_strndup(b->arena, star, length);
        one->name = one->light
                        ? rl_arena_printf(b->arena, "%s.%s", rl_layer_types[layer->id].name, one->light)
                        : NULL;
        if (!one->name || !take(b, one, layer->channels, c->part ? c->part : "", star, length))
            return rl_fail_memory(err, 64);
    }
    return RL_OK;
}

rl_code rl_layer_missing(const rl_layer *layer, const char *file, const rl_channel *channels, size_t n,
                         rl_error *err)
{
    rl_str text = {0};
    rl_str_printf(&text, "layer '%s' needs channel", layer->name);
    for (int i = 0; i < layer->n_channels; i++)
        rl_str_printf(&text, "%s '%s'", i ? "," : layer->n_channels > 1 ? "s" : "", layer->channels[i]);
    if (layer->part)
        rl_str_printf(&text, " in part '%s'", layer->part);
    rl_str_add(&text, "; the file has:");
    for (size_t i = 0; i < n && text.length < 1200; i++) {
        bool parted = channels[i].part && channels[i].part[0];
        rl_str_printf(&text, " %s%s%s", parted ? channels[i].part : "", parted ? ":" : "", channels[i].name);
    }
    if (text.length >= 1200)
        rl_str_add(&text, " ...");
    rl_str_printf(&text, " (set layers.%s in capture.yaml)", rl_layer_types[layer->id].name);
    rl_code code = text.failed ? rl_fail_memory(err, text.room)
                               : rl_fail_file(err, RL_E_FORMAT, file, "%s", rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

static bool is_open(const rl_layer *layer)
{
    bool open = layer->n_alternatives > 1;
    for (int i = 0; i < layer->n_channels; i++)
        open = open || strchr(layer->channels[i], '*');
    return open || layer->from_preset;
}

/* Binds all layers of a pattern; those of a preset that are not there go. `strict`: a required one that is
 * not there is an error. */
static rl_code bind_all(binder *b, int pattern, const char *file, bool strict, rl_error *err)
{
    rl_manifest *m = b->m;
    rl_layer *bound = rl_arena_array(b->arena, (size_t)m->n_layers * (b->n + 1), sizeof *bound);
    int n = 0;
    if (!bound)
        return rl_fail_memory(err, (size_t)m->n_layers * (b->n + 1) * sizeof *bound);
    for (int i = 0; i < m->n_layers; i++) {
        rl_layer layer = m->layers[i];
        bool found = true;
        rl_code code = RL_OK;
        if (layer.pattern != pattern || !is_open(&layer) || !layer.n_channels) {
            bound[n++] = layer;
            continue;
        }
        if (layer.light && strchr(layer.light, '*')) {
            code = bind_lights(b, &layer, bound, &n, err);
            found = false;
        } else {
            code = bind_layer(b, &layer, &found, err);
            bool needed = rl_layer_types[layer.id].required || !layer.from_preset;
            if (!code && !found && strict && needed)
                code = rl_layer_missing(&layer, file, b->channels, b->n, err);
        }
        if (code)
            return code;
        if (found)
            bound[n++] = layer;
    }
    m->layers = bound;
    m->n_layers = n;
    return RL_OK;
}

rl_code rl_manifest_bind(rl_arena *arena, rl_manifest *m, int pattern, const char *file,
                         const rl_channel *channels, size_t n, rl_error *err)
{
    binder b = {.arena = arena, .m = m, .channels = channels, .n = n};
    return bind_all(&b, pattern, file ? file : "", file != NULL, err);
}

rl_code rl_manifest_bind_found(rl_arena *arena, rl_manifest *m, const rl_channel *channels, size_t n,
                               rl_error *err)
{
    binder b = {.arena = arena, .m = m, .channels = channels, .n = n};
    return bind_all(&b, 0, "", false, err);
}

/* ---- the folder of presets ---- */

/* Names of the presets, sorted; at most 256. */
static rl_code list_presets(rl_arena *arena, const char *folder, const char **names, size_t *n, rl_error *err)
{
    enum { MOST = 256 };
    *n = 0;
    DIR *dir = folder ? opendir(folder) : NULL;
    if (!dir)
        return rl_fail_file(err, RL_E_IO, folder ? folder : "presets",
                            "the folder of presets cannot be read: %s",
                            folder ? strerror(errno) : "none is set");
    rl_code code = RL_OK;
    for (struct dirent *e; !code && *n < MOST && (e = readdir(dir));) {
        const char *dot = rl_path_extension(e->d_name);
        if (strcmp(dot, ".yaml"))
            continue;
        size_t at = (*n)++;
        names[at] = rl_arena_strndup(arena, e->d_name, (size_t)(dot - e->d_name));
        for (; names[at] && at > 0 && strcmp(names[at], names[at - 1]) < 0; at--) {
            const char *swap = names[at];
            names[at] = names[at - 1];
            names[at - 1] = swap;
        }
        if (!names[at])
            code = rl_fail_memory(err, 64);
    }
    closedir(dir);
    return code;
}

static rl_code unknown_preset(rl_arena *arena, const char *presets, const char *name, rl_where where,
                              rl_error *err)
{
    const char *names[256];
    size_t n;
    rl_code code = list_presets(arena, presets, names, &n, err);
    return code ? code : rl_fail_unknown(err, where, "there is no preset", name, names, n);
}

rl_code rl_preset_load(rl_arena *arena, const char *presets, const char *name, rl_where where, rl_value **out,
                       rl_error *err)
{
    static const char *const known[] = {"relit_preset", "help",   "source", "check",        "unit",
                                        "camera",       "layers", "fps",    "stencil_names"};
    rl_value gone = {.kind = RL_NULL};
    *out = NULL;
    char *path = rl_arena_printf(arena, "%s/%s.yaml", presets ? presets : "", name);
    if (!path)
        return rl_fail_memory(err, strlen(name));
    if (!presets || strchr(name, '/') || !rl_path_exists(path))
        return unknown_preset(arena, presets, name, where, err);
    rl_value *v;
    long long version;
    rl_code code = rl_yaml_load(arena, path, &v, err);
    if (!code)
        code = rl_value_keys(v, "a preset", known, sizeof known / sizeof *known, err);
    if (!code)
        code = rl_value_integer(rl_value_get(v, "relit_preset"), "relit_preset", 1, 1, &version, err);
    for (int i = 0; i < 4 && !code; i++)
        code = rl_value_set(arena, &v, known[i], &gone, err);
    if (!code)
        *out = v;
    return code;
}

rl_code rl_preset_about(rl_arena *arena, const char *presets, const char *name, rl_preset_words *out,
                        rl_error *err)
{
    rl_value *v;
    *out = (rl_preset_words){0};
    char *path = rl_arena_printf(arena, "%s/%s.yaml", presets, name);
    rl_code code = path ? rl_yaml_load(arena, path, &v, err) : rl_fail_memory(err, strlen(name));
    if (code)
        return code;
    const rl_value *help = rl_value_get(v, "help"), *check = rl_value_get(v, "check");
    size_t n = check && check->kind == RL_LIST ? check->n : 0;
    out->help = help && help->text ? help->text : "";
    out->check = rl_arena_array(arena, n + 1, sizeof *out->check);
    if (!out->check)
        return rl_fail_memory(err, n * sizeof *out->check);
    for (size_t i = 0; i < n; i++)
        if (check->items[i]->text)
            out->check[out->n_check++] = check->items[i]->text;
    return RL_OK;
}

/* How well one preset fits; *out is overwritten. */
static rl_code judge(rl_arena *scratch, const char *presets, const char *name, const rl_channel *channels,
                     size_t n, rl_str *missing, rl_preset_match *out, rl_error *err)
{
    rl_manifest m = {.unit = 1};
    rl_manifest_reader r = {.arena = scratch, .err = err, .m = &m};
    binder b = {.arena = scratch, .m = &m, .channels = channels, .n = n};
    rl_value *v;
    rl_code code = rl_preset_load(scratch, presets, name, RL_NOWHERE, &v, err);
    if (code)
        return code;
    r.preset_file = v->where.file;
    code = rl_manifest_read_layers(&r, rl_value_get(v, "layers"));
    if (!code)
        code = bind_all(&b, 0, "", false, err);
    *out = (rl_preset_match){0};
    for (int i = 0; i < m.n_layers && !code; i++)
        out->layers += m.layers[i].n_channels > 0; /* a constant is no sign of a renderer */
    for (int i = 0; i < RL_LAYER_COUNT && !code; i++) {
        if (!rl_layer_types[i].required || rl_manifest_layer(&m, rl_layer_types[i].name))
            continue;
        rl_str_printf(missing, "%s%s", out->missing_required++ ? ", " : "", rl_layer_types[i].name);
    }
    return code;
}

rl_code rl_preset_find(rl_arena *arena, const char *presets, const rl_channel *channels, size_t n,
                       rl_preset_match *out, rl_error *err)
{
    const char *names[256];
    size_t n_names;
    *out = (rl_preset_match){.missing_required = RL_LAYER_COUNT};
    rl_code code = list_presets(arena, presets, names, &n_names, err);
    for (size_t i = 0; i < n_names && !code; i++) {
        rl_arena scratch = {0};
        rl_str missing = {0};
        rl_preset_match one;
        code = judge(&scratch, presets, names[i], channels, n, &missing, &one, err);
        bool better = one.missing_required < out->missing_required ||
                      (one.missing_required == out->missing_required && one.layers > out->layers);
        if (!code && one.layers > 0 && better) {
            *out = one;
            out->name = names[i];
            out->missing = rl_arena_strdup(arena, rl_str_text(&missing));
            if (!out->missing || missing.failed)
                code = rl_fail_memory(err, 64);
        }
        rl_str_free(&missing);
        rl_arena_free(&scratch);
    }
    return code;
}
