#include "graph/tool/inspect_parts.h"

#include <math.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/run/camera_header.h"
#include "graph/run/data_files.h"

static const double pi = 3.14159265358979323846;

/* ---- layers ----------------------------------------------------------------------------------------------
 */

/* rl_guess_layer, with the channels' own names. */
static bool guess_layer(const rl_guesser *g, rl_layer_id id, rl_guess *out)
{
    if (!rl_guess_layer(id, g->channels, g->n, out))
        return false;
    for (int k = 0; k < 3 && out->names[k]; k++)
        for (size_t i = 0; i < g->n; i++)
            if (g->channels[i].name == out->names[k]) {
                const char *part = g->sources[i].part;
                out->names[k] = g->sources[i].name;
                out->part = part && part[0] ? part : NULL;
                out->pattern = g->sources[i].pattern;
                break;
            }
    return true;
}

/* A layer by the likeliest names, with the conventions that most renderers have. */
static rl_code add_layer(rl_guesser *g, rl_layer_id id, rl_error *err)
{
    rl_guess guess = {0};
    bool found = guess_layer(g, id, &guess);
    if (!found && id != RL_LAYER_STENCIL)
        return RL_OK;
    rl_manifest *m = g->m;
    const rl_layer_type *type = &rl_layer_types[id];
    rl_layer *layers = rl_arena_array(g->arena, (size_t)m->n_layers + 1, sizeof *layers);
    const char **names = rl_arena_array(g->arena, 3, sizeof *names);
    if (!layers || !names)
        return rl_fail_memory(err, 256);
    memcpy(names, guess.names, sizeof guess.names);
    memcpy(layers, m->layers, (size_t)m->n_layers * sizeof *layers);
    layers[m->n_layers++] = (rl_layer){.id = id,
                                       .name = type->name,
                                       .channels = names,
                                       .n_channels = found ? type->channels : 0,
                                       .n_alternatives = found,
                                       .constant = 1,
                                       .part = guess.part,
                                       .pattern = guess.pattern,
                                       .hashed = guess.hashed,
                                       .colorspace = type->format == RL_RGB ? "lin_rec709" : NULL,
                                       .axes = {1, 2, 3},
                                       .empty = id == RL_LAYER_DEPTH ? 1e10 : INFINITY,
                                       .scale = m->unit};
    m->layers = layers;
    g->named |= 1u << id;
    return RL_OK;
}

/* Which way a camera looks whose matrix mirrors: a world is right-handed as a rule. */
static bool looks_along_z(const rl_exr *file)
{
    double m[16];
    const char *from = rl_camera_header_matrix(file, 0, false, m);
    double det = m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                 m[2] * (m[4] * m[9] - m[5] * m[8]);
    return from && !strcmp(from, "worldToCamera") && det < 0;
}

/* What is required and not there yet. */
static rl_code add_layers(rl_guesser *g, rl_error *err)
{
    rl_code code = RL_OK;
    for (int id = 0; id < RL_LAYER_COUNT && !code; id++)
        if (rl_layer_types[id].required && !rl_manifest_layer(g->m, rl_layer_types[id].name))
            code = add_layer(g, (rl_layer_id)id, err);
    return code;
}

/* The manifest of a file that lacks something, or that no preset knows. */
static rl_code make_manifest(rl_guesser *g, const rl_exr *file, rl_error *err)
{
    const char *presets = rl_data_path(g->arena, "presets"), *path = g->m->patterns[0].path;
    rl_preset_match match;
    rl_code code = rl_preset_find(g->arena, presets, g->channels, g->n, &match, err);
    if (!code && match.name && match.layers >= 2 && match.missing_required <= 2)
        g->preset = match.name;
    if (!code)
        code = rl_manifest_bare(g->arena, path, g->preset, presets, NULL, &g->m, err);
    if (!code && g->preset)
        code = rl_manifest_bind_found(g->arena, g->m, g->channels, g->n, err);
    if (!code && !g->preset)
        g->m->camera.forward_z = looks_along_z(file);
    return code ? code : add_layers(g, err);
}

/* ---- the camera ------------------------------------------------------------------------------------------
 */

static bool same_camera(const rl_solved_camera *a, const rl_solved_camera *b)
{
    bool same = fabs(a->focal / b->focal - 1) < 1e-3;
    for (int i = 0; i < 12; i++)
        same = same && fabs(a->matrix[i] - b->matrix[i]) < 1e-3 * (1 + fabs(a->matrix[i]));
    return same;
}

/* Cameras found from positions go into the manifest: one, or one a frame where they differ. */
static rl_code set_cameras(rl_guesser *g, rl_error *err)
{
    rl_camera_spec *c = &g->m->camera;
    size_t n = g->m->frames.n;
    bool still = true, zooms = false;
    rl_manifest one = *g->m;
    c->matrix = rl_arena_array(g->arena, n, sizeof *c->matrix);
    c->fov_x = rl_arena_array(g->arena, n, sizeof *c->fov_x);
    if (!c->matrix || !c->fov_x)
        return rl_fail_memory(err, n * sizeof *c->matrix);
    for (size_t i = 0; i < n; i++) {
        rl_probe p = g->probe;
        one.frames = (rl_frames){.numbers = &g->m->frames.numbers[i], .n = 1};
        rl_code code = i ? rl_probe_run(&one, &g->position, g->arena, &p, err) : RL_OK;
        if (code)
            return code;
        if (!p.solved) {
            g->probe.solved = false;
            return RL_OK;
        }
        still = still && same_camera(&p.camera, &g->probe.camera);
        for (int k = 0; k < 16; k++) {
            double v = p.camera.matrix[k] * (k / 4 == 2 && c->forward_z ? -1 : 1);
            c->matrix[i][k] = round(v * 1e7) / 1e7 + 0.0; /* no -0 */
        }
        c->fov_x[i] = 2 * atan(p.width / 2 / p.camera.focal);
        zooms = zooms || fabs(p.camera.focal / g->probe.camera.focal - 1) > 1e-3;
        c->fov_x[i] = round(c->fov_x[i] * 180 / pi * 1e5) / 1e5 * pi / 180;
    }
    c->matrix_source = still ? RL_SOURCE_ONE : RL_SOURCE_LIST;
    c->n_matrix = still ? 1 : n;
    c->fov_source = zooms ? RL_SOURCE_LIST : RL_SOURCE_ONE;
    c->n_fov = zooms ? n : 1;
    const rl_probe *p = &g->probe;
    double shift[2] = {(p->x + p->width / 2 - p->camera.centre[0]) / p->width,
                       (p->camera.centre[1] - p->y - p->height / 2) / p->width};
    c->has_shift = fabs(shift[0]) > 1e-4 || fabs(shift[1]) > 1e-4;
    for (int k = 0; k < 2; k++)
        c->shift[k] = round(shift[k] * 1e5) / 1e5;
    return RL_OK;
}

/* What the pixels tell; when they cannot be read, that is all that they tell. */
static void look(rl_guesser *g)
{
    rl_error *err = &g->unread;
    g->positions = guess_layer(g, RL_LAYER_COUNT, &g->position);
    rl_code code = rl_probe_run(g->m, g->positions ? &g->position : NULL, g->arena, &g->probe, err);
    if (code || !g->probe.solved || g->probe.matrix_source || g->m->camera.matrix_source != RL_SOURCE_HEADER)
        return;
    code = set_cameras(g, err);
    if (code || !g->probe.solved)
        return;
    rl_solved_camera found = g->probe.camera; /* once more, now that normals can be looked at */
    rl_probe_run(g->m, NULL, g->arena, &g->probe, err);
    g->probe.solved = true;
    g->probe.camera = found;
}

/* The channels of the first file of one of the patterns. With `word`, what a channel without a layer in its
 * name is called: "R" of shot_normal.0001.exr is looked for as normal.R. */
static rl_code add_channels(rl_guesser *g, int pattern, const rl_exr *file, const char *word, rl_error *err)
{
    rl_channel *found;
    size_t n;
    rl_code code = rl_capture_channels(g->arena, file, &found, &n, err);
    rl_channel *channels = code ? NULL : rl_arena_array(g->arena, g->n + n + 1, sizeof *channels);
    rl_guess_source *sources = code ? NULL : rl_arena_array(g->arena, g->n + n + 1, sizeof *sources);
    if (code || !channels || !sources)
        return code ? code : rl_fail_memory(err, (g->n + n) * sizeof *channels);
    if (g->n) {
        memcpy(channels, g->channels, g->n * sizeof *channels);
        memcpy(sources, g->sources, g->n * sizeof *sources);
    }
    for (size_t i = 0; i < n; i++) {
        const char *name = rl_arena_strdup(g->arena, found[i].name);
        const char *part = rl_arena_strdup(g->arena, found[i].part ? found[i].part : "");
        const char *called = word && !strchr(found[i].name, '.')
                                 ? rl_arena_printf(g->arena, "%s.%s", word, found[i].name)
                                 : rl_arena_strdup(g->arena, found[i].name);
        const char *place = word ? rl_arena_printf(g->arena, "%d:%s", pattern, part ? part : "") : part;
        if (!name || !part || !called || !place)
            return rl_fail_memory(err, 64);
        channels[g->n] = (rl_channel){place, called};
        sources[g->n++] = (rl_guess_source){pattern, part, name};
    }
    g->channels = channels;
    g->sources = sources;
    return RL_OK;
}

rl_code rl_inspect_guess(rl_tool *tool, const rl_capture *capture, rl_str *out, rl_error *err)
{
    rl_guesser g = {
        .arena = tool->arena, .m = capture->manifest, .preset = capture->missing ? NULL : capture->preset};
    rl_exr *file = NULL;
    char *path = rl_capture_first(tool->arena, capture->manifest, 0);
    rl_code code = path ? rl_exr_open(path, 0, &file, err) : rl_fail_memory(err, 1);
    if (!code)
        code = add_channels(&g, 0, file, NULL, err);
    if (!code && capture->missing)
        code = make_manifest(&g, file, err);
    rl_exr_close(&file);
    if (!code && capture->missing)
        rl_capture_name_ids(tool->arena, g.m, &(rl_error){0});
    if (!code)
        look(&g);
    return code ? code : rl_inspect_say(&g, out, err);
}

/* "shot_world-normal" -> "normal": what a file is called after the last separator. */
static const char *last_word(const char *name)
{
    const char *word = name;
    for (; *name; name++)
        word = strchr("._- ", *name) ? name + 1 : word;
    return word;
}

/* What the names of all files begin with, up to a separator; NULL when that is nothing. */
static const char *common_name(rl_guesser *g, const char *a, const char *b)
{
    size_t n = 0;
    while (a && b && a[n] && a[n] == b[n])
        n++;
    while (n > 0 && a[n] && !strchr("._- ", a[n]))
        n--;
    return n ? rl_arena_strndup(g->arena, a, n) : NULL;
}

/* Layers of the same frames in several files: one manifest for all. */
static rl_code make_map(rl_guesser *g, const char *const *paths, size_t n, const char *name, rl_error *err)
{
    rl_guess depth = {0};
    rl_pattern *patterns = rl_arena_array(g->arena, n, sizeof *patterns);
    bool found = guess_layer(g, RL_LAYER_DEPTH, &depth), ahead = false;
    rl_code code = patterns ? RL_OK : rl_fail_memory(err, n * sizeof *patterns);
    if (!code) /* frames, and the name, of the depth's */
        code = rl_manifest_bare(g->arena, paths[found ? depth.pattern : 0], NULL, NULL, NULL, &g->m, err);
    if (code)
        return code;
    for (size_t i = 0; i < n; i++)
        patterns[i] =
            (rl_pattern){.path = paths[i], .where = g->m->where, .numbered = g->m->patterns[0].numbered};
    g->m->patterns = patterns;
    g->m->n_patterns = (int)n;
    g->m->name = name ? name : g->m->name;
    rl_exr *file = NULL;
    char *first = rl_capture_first(g->arena, g->m, found ? depth.pattern : 0);
    code = first ? rl_exr_open(first, 0, &file, err) : rl_fail_memory(err, 1);
    ahead = !code && looks_along_z(file);
    rl_exr_close(&file);
    g->m->camera.forward_z = ahead;
    return code ? code : add_layers(g, err);
}

rl_code rl_inspect_guess_files(rl_tool *tool, const char *const *paths, size_t n, rl_str *out, rl_error *err)
{
    rl_guesser g = {.arena = tool->arena};
    const char *name = NULL;
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++) {
        rl_manifest *one;
        rl_exr *file = NULL;
        code = rl_manifest_bare(g.arena, paths[i], NULL, NULL, NULL, &one, err);
        char *path = code ? NULL : rl_capture_first(g.arena, one, 0);
        if (!code)
            code = path ? rl_exr_open(path, 0, &file, err) : rl_fail_memory(err, 1);
        if (!code)
            code = add_channels(&g, (int)i, file, last_word(one->name), err);
        if (!code)
            name = i ? common_name(&g, name, one->name) : one->name;
        rl_exr_close(&file);
    }
    if (!code)
        code = make_map(&g, paths, n, name, err);
    if (!code) {
        rl_capture_name_ids(g.arena, g.m, &(rl_error){0});
        look(&g);
    }
    return code ? code : rl_inspect_say(&g, out, err);
}

/* As a run does it; a file that is missing or lacks something is what a run would complain about. */
static void bind(rl_tool *tool, rl_manifest *m)
{
    for (int p = 0; p < m->n_patterns && m->preset; p++) {
        rl_exr *file = NULL;
        rl_channel *channels;
        size_t n;
        rl_error ignored = {0};
        char *path = rl_capture_first(tool->arena, m, p);
        if (path && !rl_exr_open(path, 0, &file, &ignored) &&
            !rl_capture_channels(tool->arena, file, &channels, &n, &ignored))
            rl_manifest_bind(tool->arena, m, p, path, channels, n, &ignored);
        rl_exr_close(&file);
    }
}

void rl_inspect_look(rl_tool *tool, rl_manifest *m, rl_str *out)
{
    rl_guesser g = {.arena = tool->arena, .m = m};
    if (!m->n_patterns)
        return;
    bind(tool, m);
    rl_probe_run(m, NULL, tool->arena, &g.probe, &g.unread);
    rl_inspect_say_pixels(&g, out);
}
