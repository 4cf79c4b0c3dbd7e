/* What a pipeline and a manifest hold, with the files that they name, as hashes: for what pictures say of
 * where they come from, and for deciding whether one need not be made again. The same on every machine. */
#include <string.h>
#include <xxhash.h>

#include "graph/base/file.h"
#include "graph/run/file_hash.h"
#include "graph/run/kernel_source.h"
#include "graph/run/session.h"

static uint64_t add_text(uint64_t hash, const char *text)
{
    return XXH3_64bits_withSeed(text ? text : "", text ? strlen(text) : 0, hash + 1);
}

static uint64_t add_number(uint64_t hash, uint64_t number)
{
    return XXH3_64bits_withSeed(&number, sizeof number, hash + 1);
}

/* A file that cannot be read has said so before, or nobody needs it. */
static uint64_t add_file(uint64_t hash, const char *path)
{
    uint64_t content;
    rl_files_hash(&path, 1, &content);
    return add_number(hash, content);
}

/* The configuration, whatever folder it lies in. */
static rl_code hash_colors(const rl_session *s, uint64_t *out, rl_error *err)
{
    char text[256];
    rl_arena arena = {0};
    rl_ocio_names files = {0};
    rl_code code = rl_ocio_fingerprint(s->ocio, text, sizeof text, err);
    if (!code)
        code = rl_ocio_files(s->ocio, &arena, &files, err);
    *out = code ? 0 : add_text(0, text);
    for (size_t i = 0; i < files.n; i++)
        *out = add_file(*out, files.names[i]);
    rl_arena_free(&arena);
    return code;
}

/* The file that `key` of a map names, if it names one. */
static rl_code add_named(const rl_value *map, const char *key, uint64_t *hash, rl_error *err)
{
    const rl_value *v = rl_value_get(map, key);
    if (!v || v->kind != RL_TEXT)
        return RL_OK;
    rl_arena arena = {0};
    const char *path = rl_value_path(&arena, v);
    if (path)
        *hash = add_file(*hash, path);
    rl_arena_free(&arena);
    return path ? RL_OK : rl_fail_memory(err, strlen(v->text));
}

/* `lights` may be NULL. */
static rl_code add_lamps(const rl_value *lights, uint64_t *hash, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; lights && i < lights->n && !code; i++)
        code = add_named(lights->entries[i].value, "ies", hash, err);
    return code;
}

static rl_code hash_pipeline(const rl_session *s, uint64_t *out, rl_error *err)
{
    uint64_t h = add_number(add_number(0, s->pipeline->hash), s->colors);
    h = add_number(h, rl_kernel_files_hash());
    rl_code code = add_lamps(s->pipeline->lights, &h, err);
    if (!code)
        code = add_named(s->pipeline->ambient, "hdri", &h, err);
    *out = h;
    return code;
}

/* Files by their names alone. The frames that it lists are left out: a capture may grow. NULL: out of memory.
 */
static const rl_manifest *without_places(rl_arena *arena, const rl_manifest *m)
{
    rl_manifest *out = rl_arena_alloc(arena, sizeof *out);
    rl_pattern *patterns = rl_arena_array(arena, (size_t)m->n_patterns + 1, sizeof *patterns);
    rl_light_spec *lights = rl_arena_array(arena, m->lights.n + 1, sizeof *lights);
    if (!out || !patterns || !lights)
        return NULL;
    *out = *m;
    for (int i = 0; i < m->n_patterns; i++) {
        patterns[i] = m->patterns[i];
        patterns[i].path = rl_path_name(patterns[i].path);
    }
    for (size_t i = 0; i < m->lights.n; i++) {
        lights[i] = m->lights.light[i];
        lights[i].ies = lights[i].ies ? rl_path_name(lights[i].ies) : NULL;
    }
    out->patterns = patterns;
    out->lights.light = lights;
    out->frames = (rl_frames){0};
    return out;
}

static rl_code hash_capture(const rl_manifest *manifest, uint64_t *out, rl_error *err)
{
    rl_arena arena = {0};
    rl_str text = {0};
    const rl_manifest *m = without_places(&arena, manifest);
    if (m)
        rl_manifest_print(m, &text);
    rl_code code = !m || text.failed ? rl_fail_memory(err, sizeof *m) : RL_OK;
    *out = add_text(0, rl_str_text(&text));
    if (!code)
        code = add_lamps(manifest->lights_written, out, err);
    rl_str_free(&text);
    rl_arena_free(&arena);
    return code;
}

rl_code rl_session_content(rl_session *s, rl_error *err)
{
    rl_code code = hash_colors(s, &s->colors, err);
    if (!code)
        code = hash_pipeline(s, &s->content, err);
    for (size_t i = 0; i < s->n_sequences && !code; i++)
        code = hash_capture(s->sequences[i].manifest, &s->sequences[i].content, err);
    return code;
}
