/* The manifest as a whole. Layers, camera and files are read in files of their own. */
#include "graph/model/manifest_parts.h"

#include <ctype.h>
#include <float.h>
#include <limits.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/model/value_scalar.h"

rl_code rl_manifest_unit(const rl_value *v, double *metres, rl_error *err)
{
    static const double lengths[] = {1, 0.01, 0.001};
    int word;
    if (v->kind == RL_NUMBER)
        return rl_value_number(v, "unit", DBL_MIN, DBL_MAX, metres, err);
    rl_code code = rl_value_word(v, "unit", "m|cm|mm", &word, err);
    if (!code)
        *metres = lengths[word];
    return code;
}

/* A number, or a ratio such as 24000/1001. */
static rl_code read_fps(rl_manifest_reader *r, const rl_value *v)
{
    if (v->kind == RL_NUMBER)
        return rl_value_number(v, "fps", DBL_MIN, 1e6, &r->m->fps, r->err);
    const char *slash = v->kind == RL_TEXT ? strchr(v->text, '/') : NULL;
    char *over = slash ? rl_arena_strndup(r->arena, v->text, (size_t)(slash - v->text)) : NULL;
    double n, d;
    if (!over || !rl_parse_double(over, &n) || !rl_parse_double(slash + 1, &d) ||
        !(n > 0 && d > 0 && n / d <= 1e6))
        return rl_value_wrong(v, "fps", "frames a second, such as 24 or 24000/1001", r->err);
    r->m->fps = n / d;
    return RL_OK;
}

static rl_code read_stencil_names(rl_manifest_reader *r, const rl_value *v)
{
    rl_manifest *m = r->m;
    if (v->kind != RL_MAP)
        return rl_value_wrong(v, "stencil_names", "a map, id: name", r->err);
    m->stencil_names = rl_arena_array(r->arena, v->n, sizeof *m->stencil_names);
    if (!m->stencil_names)
        return rl_fail_memory(r->err, v->n * sizeof *m->stencil_names);
    for (size_t i = 0; i < v->n; i++) {
        const rl_entry *e = &v->entries[i];
        rl_value key = {.text = e->key};
        long long id = rl_scalar_resolve(&key) == RL_NUMBER && key.integral ? key.integer : LLONG_MAX;
        if (id < INT32_MIN || id > UINT32_MAX)
            return rl_fail(r->err, RL_E_CONFIG, e->where, "stencil_names: '%s' is no 32-bit integer", e->key);
        const char *name;
        rl_code code = rl_value_text(e->value, "stencil_names", &name, r->err);
        if (code)
            return code;
        if (rl_manifest_stencil_name(m, (uint32_t)id))
            return rl_fail(r->err, RL_E_CONFIG, e->where, "stencil_names: the id %s is named twice", e->key);
        m->stencil_names[m->n_stencil_names++] = (rl_stencil_label){(uint32_t)id, name};
    }
    return RL_OK;
}

static rl_code read_texts(rl_manifest_reader *r, const rl_value *v)
{
    rl_manifest *m = r->m;
    const struct {
        const char *key;
        const char **out;
    } texts[] = {{"name", &m->name}, {"description", &m->description}, {"license", &m->license}};
    for (size_t i = 0; i < 3; i++) {
        const rl_value *t = rl_value_get(v, texts[i].key);
        rl_code code = t ? rl_value_text(t, texts[i].key, texts[i].out, r->err) : RL_OK;
        if (code)
            return code;
    }
    const rl_value *name = rl_value_get(v, "name");
    if (name && (!m->name[0] || strchr(m->name, '/')))
        return rl_fail(r->err, RL_E_CONFIG, name->where,
                       "'name' becomes part of file names: no '/', not empty");
    if (!m->name && !(m->name = rl_manifest_stem(r->arena, m->n_patterns ? m->patterns[0].path : "memory")))
        return rl_fail_memory(r->err, 64);
    return RL_OK;
}

static rl_code read_version(rl_manifest_reader *r, const rl_value *v)
{
    const rl_value *version = rl_value_get(v, "relit_capture");
    long long n;
    if (!version)
        return RL_OK;
    rl_code code = rl_value_integer(version, "relit_capture", 0, 1000000, &n, r->err);
    if (!code && n != 1)
        code = rl_fail(r->err, RL_E_CONFIG, version->where,
                       "relit_capture: %lld is not known here; this relit reads 1", n);
    return code;
}

/* One value a frame means as many as frames. */
static rl_code check_lengths(rl_manifest_reader *r)
{
    const rl_camera_spec *c = &r->m->camera;
    const struct {
        const char *name;
        rl_source source;
        size_t n;
    } lists[] = {{"matrix", c->matrix_source, c->n_matrix},
                 {"fov_x", c->fov_source, c->n_fov},
                 {"jitter", c->jitter_source, c->n_jitter}};
    for (size_t i = 0; i < 3; i++)
        if (lists[i].source == RL_SOURCE_LIST && lists[i].n != r->m->frames.n)
            return rl_fail(r->err, RL_E_CONFIG, c->where,
                           "camera: '%s' lists %zu, but the capture has %zu frame%s", lists[i].name,
                           lists[i].n, r->m->frames.n, r->m->frames.n == 1 ? "" : "s");
    return RL_OK;
}

static rl_code read_all(rl_manifest_reader *r, const rl_value *v)
{
    static const char *const known[] = {"relit_capture", "preset", "name",        "files",  "frames",
                                        "fps",           "unit",   "camera",      "layers", "lights",
                                        "stencil_names", "cuts",   "description", "license"};
    rl_manifest *m = r->m;
    const rl_value *x;
    rl_code code = rl_value_keys(v, "a capture", known, sizeof known / sizeof *known, r->err);
    if (!code)
        code = read_version(r, v);
    m->unit = 1;
    if (!code && (x = rl_value_get(v, "unit")))
        code = rl_manifest_unit(x, &m->unit, r->err);
    else if (!code)
        rl_report(r->log, RL_NOTE, m->where, "the capture's 'unit' is not given; assuming metres");
    if (!code && (x = rl_value_get(v, "fps")))
        code = read_fps(r, x);
    if (!code)
        code = rl_manifest_read_camera(r, rl_value_get(v, "camera"));
    if (!code)
        code = rl_manifest_read_layers(r, rl_value_get(v, "layers"));
    if (!code)
        code = rl_manifest_read_files(r, rl_value_get(v, "files"));
    if (!code)
        code = read_texts(r, v);
    if (!code && (x = rl_value_get(v, "lights"))) {
        m->lights_written = (rl_value *)x;
        code = rl_lights_parse(r->arena, x, m->unit, &m->lights, r->err);
    }
    if (!code && (x = rl_value_get(v, "stencil_names")))
        code = read_stencil_names(r, x);
    if (!code && (x = rl_value_get(v, "cuts")))
        code = rl_manifest_read_frames(r, x, "cuts", &m->cuts);
    if (!code && (x = rl_value_get(v, "frames")))
        code = rl_manifest_read_frames(r, x, "frames", &m->frames);
    else if (!code)
        code = rl_manifest_find_frames(r);
    if (!code && !m->frames.n)
        code = rl_fail(r->err, RL_E_CONFIG, m->where, "the capture has no frames");
    return code ? code : check_lengths(r);
}

/* Every layer that passes cannot do without. */
static rl_code check_required(rl_manifest_reader *r)
{
    for (int i = 0; i < RL_LAYER_COUNT; i++)
        if (rl_layer_types[i].required && !rl_manifest_layer(r->m, rl_layer_types[i].name))
            return rl_fail(r->err, RL_E_CONFIG, r->m->where, "a capture needs the layer '%s' (%s)",
                           rl_layer_types[i].name, rl_layer_types[i].help);
    return RL_OK;
}

/* `whole`: every layer that is required must be there. */
static rl_code parse(rl_arena *arena, const rl_value *v, const char *presets, bool whole, const rl_log *log,
                     rl_manifest **out, rl_error *err)
{
    *out = NULL;
    rl_manifest *m = rl_arena_alloc(arena, sizeof *m);
    if (!m)
        return rl_fail_memory(err, sizeof *m);
    rl_manifest_reader r = {.arena = arena, .log = log, .err = err, .m = m, .presets = presets};
    m->where = v->where;
    const rl_value *preset = rl_value_get(v, "preset");
    rl_value *base = NULL;
    rl_code code = preset ? rl_value_text(preset, "preset", &m->preset, err) : RL_OK;
    if (!code && preset)
        code = rl_preset_load(arena, presets, m->preset, preset->where, &base, err);
    if (!code && base) {
        r.preset_file = base->where.file;
        v = rl_value_merge(arena, base, (rl_value *)v);
        if (!v)
            return rl_fail_memory(err, sizeof *v);
    }
    if (!code)
        code = read_all(&r, v);
    if (!code && whole)
        code = check_required(&r);
    if (!code)
        *out = m;
    return code;
}

rl_code rl_manifest_parse(rl_arena *arena, const rl_value *v, const char *presets, const rl_log *log,
                          rl_manifest **out, rl_error *err)
{
    return parse(arena, v, presets, true, log, out, err);
}

rl_code rl_manifest_load(rl_arena *arena, const char *path, const char *presets, const rl_log *log,
                         rl_manifest **out, rl_error *err)
{
    rl_value *v;
    *out = NULL;
    const char *folder = rl_path_is_folder(path) ? path : NULL;
    if (folder && !(path = rl_path_join(arena, folder, "capture.yaml")))
        return rl_fail_memory(err, 64);
    if (folder && !rl_path_exists(path))
        return rl_fail_file(err, RL_E_IO, folder,
                            "the folder holds no capture.yaml; `relit inspect %s` prints one to begin with",
                            folder);
    rl_code code = rl_config_load(arena, path, &v, err);
    if (!code && rl_value_get(v, "relit") && !rl_value_get(v, "relit_capture"))
        return rl_fail_file(err, RL_E_CONFIG, path,
                            "this is a pipeline, not the manifest of a capture (its `capture:` names one)");
    return code ? code : rl_manifest_parse(arena, v, presets, log, out, err);
}

/* {files: …, preset: …, frames: N}, with the path as its own place in errors */
rl_code rl_manifest_bare(rl_arena *arena, const char *files, const char *preset, const char *presets,
                         const rl_log *log, rl_manifest **out, rl_error *err)
{
    *out = NULL;
    rl_value *map = rl_arena_alloc(arena, sizeof *map), *texts = rl_arena_array(arena, 4, sizeof *texts);
    rl_entry *entries = rl_arena_array(arena, 4, sizeof *entries);
    if (!map || !texts || !entries)
        return rl_fail_memory(err, sizeof *map);
    const char *name = rl_path_name(files);
    const char *last = name + strlen(name) - strlen(rl_path_extension(files)), *digits = last;
    while (digits > name && last - digits < 9 && isdigit((unsigned char)digits[-1]))
        digits--;
    rl_where where = {.file = rl_arena_strdup(arena, files)};
    char *number = rl_arena_strndup(arena, digits, (size_t)(last - digits));
    if (!where.file || !number)
        return rl_fail_memory(err, strlen(files));
    bool numbered = strchr(name, '#') || strchr(name, '%');
    const char *keys[] = {"files", "preset", "frames"};
    const char *values[] = {where.file, preset, !numbered && number[0] ? number : NULL};
    *map = (rl_value){.kind = RL_MAP, .where = where, .entries = entries};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(keys); i++) {
        if (!values[i])
            continue;
        texts[i] = (rl_value){.kind = RL_TEXT, .where = where, .text = values[i]};
        entries[map->n++] = (rl_entry){.key = keys[i], .where = where, .value = &texts[i]};
    }
    if (!preset) {
        texts[3] = (rl_value){.kind = RL_MAP, .where = where};
        entries[map->n++] = (rl_entry){.key = "layers", .where = where, .value = &texts[3]};
    }
    return parse(arena, map, presets, preset != NULL, log, out, err);
}

const rl_layer *rl_manifest_layer(const rl_manifest *m, const char *name)
{
    for (int i = 0; i < m->n_layers; i++)
        if (!strcmp(m->layers[i].name, name))
            return &m->layers[i];
    return NULL;
}

const char *rl_manifest_stencil_name(const rl_manifest *m, uint32_t id)
{
    for (size_t i = 0; i < m->n_stencil_names; i++)
        if (m->stencil_names[i].id == id)
            return m->stencil_names[i].name;
    return NULL;
}

bool rl_manifest_stencil_id(const rl_manifest *m, const char *name, uint32_t *id)
{
    for (size_t i = 0; i < m->n_stencil_names; i++)
        if (!strcmp(m->stencil_names[i].name, name)) {
            *id = m->stencil_names[i].id;
            return true;
        }
    return false;
}
