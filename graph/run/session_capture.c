/* The captures of a session: manifest, frames, lights, materials, graph, plan. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/model/materials_sets.h"
#include "graph/model/registry.h"
#include "graph/run/data_files.h"
#include "graph/run/session.h"

/* ---- the manifest ----------------------------------------------------------------------------------------
 */

static bool is_yaml(const char *path)
{
    const char *e = rl_path_extension(path);
    return !strcmp(e, ".yaml") || !strcmp(e, ".yml");
}

/* All channels of an open file, parts included. */
static rl_code list_channels(rl_arena *arena, const rl_exr *file, rl_channel **out, size_t *n, rl_error *err)
{
    size_t most = 0;
    for (int p = 0; p < rl_exr_parts(file); p++)
        most += rl_exr_part_at(file, p)->n_channels;
    *out = rl_arena_array(arena, most + 1, sizeof **out);
    if (!*out)
        return rl_fail_memory(err, most * sizeof **out);
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels; i++)
            (*out)[(*n)++] = (rl_channel){.part = part->name, .name = part->channels[i].name};
    }
    return RL_OK;
}

/* The preset that fits the first file of a bare pattern. */
static rl_code find_preset(rl_session *s, const char *files, const char *presets, const char **out,
                           rl_error *err)
{
    rl_manifest *m = NULL;
    rl_exr *file = NULL;
    rl_channel *channels = NULL;
    size_t n = 0;
    rl_preset_match match = {0};
    rl_code code = rl_manifest_bare(&s->arena, files, NULL, presets, NULL, &m, err);
    const rl_layer fake = {.pattern = 0};
    char *path = code ? NULL : rl_manifest_path(&s->arena, m, &fake, m->frames.n ? m->frames.numbers[0] : 1);
    if (!code)
        code = path ? rl_exr_open(path, s->options.memory_limit, &file, err) : rl_fail_memory(err, 1);
    if (!code)
        code = list_channels(&s->arena, file, &channels, &n, err);
    if (!code)
        code = rl_preset_find(&s->arena, presets, channels, n, &match, err);
    if (!code && (!match.name || match.missing_required > 0))
        code = rl_fail_file(err, RL_E_CONFIG, path,
                            "no known preset fits the channels of this file%s%s%s%s; write a capture.yaml "
                            "(`relit inspect %s` prints a start)",
                            match.name ? ": the nearest, '" : "", match.name ? match.name : "",
                            match.name ? "', misses " : "", match.name ? match.missing : "", files);
    *out = match.name;
    rl_exr_close(&file);
    return code;
}

static rl_code load_manifest(rl_session *s, const char *path, rl_sequence *q, rl_error *err)
{
    if (!path)
        return rl_fail_memory(err, 1);
    const char *presets = rl_data_path(&s->arena, "presets");
    if (rl_path_is_folder(path) || is_yaml(path))
        return rl_manifest_load(&s->arena, path, presets, s->log, &q->manifest, err);
    const char *preset = NULL;
    rl_code code = find_preset(s, path, presets, &preset, err);
    return code ? code : rl_manifest_bare(&s->arena, path, preset, presets, s->log, &q->manifest, err);
}

/* Chooses among a preset's alternatives by what one frame's files hold. */
static rl_code bind_frame(rl_session *s, rl_sequence *q, int frame, rl_error *err)
{
    rl_manifest *m = q->manifest;
    rl_code code = RL_OK;
    for (int p = 0; p < m->n_patterns && !code; p++) {
        const rl_layer fake = {.pattern = p};
        char *path = rl_manifest_path(&s->arena, m, &fake, frame);
        rl_exr *file = NULL;
        rl_channel *channels = NULL;
        size_t n = 0;
        code = path ? rl_exr_open(path, s->options.memory_limit, &file, err) : rl_fail_memory(err, 1);
        if (!code)
            code = list_channels(&s->arena, file, &channels, &n, err);
        if (!code)
            code = rl_manifest_bind(&s->arena, m, p, path, channels, n, err);
        rl_exr_close(&file);
    }
    return code;
}

/* By the first frame whose files are there: a frame that is missing is that frame's own error later on. */
static rl_code bind_manifest(rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_error first = {0};
    if (!q->manifest->preset)
        return RL_OK;
    for (size_t i = 0; i < q->frames.n; i++) {
        rl_error one = {0};
        rl_code code = bind_frame(s, q, q->frames.numbers[i], &one);
        if (!rl_reader_missed(code)) {
            *err = code ? one : *err;
            return code;
        }
        first = first.code ? first : one;
    }
    *err = first;
    return first.code;
}

static rl_code choose_frames(rl_session *s, rl_sequence *q, rl_error *err)
{
    q->frames = q->manifest->frames;
    if (!q->frames.n)
        return rl_fail(err, RL_E_CONFIG, q->manifest->where, "capture '%s' has no frames", q->manifest->name);
    if (!s->options.frames)
        return RL_OK;
    rl_where where = {.file = "--frames"};
    rl_code code = rl_frames_parse(&s->arena, s->options.frames, where, &q->frames, err);
    return code ? code : rl_frames_check(&q->manifest->frames, q->manifest->name, &q->frames, where, err);
}

/* ---- materials and graph ---------------------------------------------------------------------------------
 */

static rl_code make_materials(rl_session *s, rl_sequence *q, rl_error *err)
{
    const rl_manifest *m = q->manifest;
    const rl_pipeline *p = s->pipeline;
    rl_stencil_name *names = rl_arena_array(&s->arena, m->n_stencil_names + 1, sizeof *names);
    const rl_pass **used = rl_arena_array(&s->arena, p->n_nodes + 1, sizeof *used);
    if (!names || !used)
        return rl_fail_memory(err, p->n_nodes * sizeof *used);
    for (size_t i = 0; i < m->n_stencil_names; i++)
        names[i] = (rl_stencil_name){.id = m->stencil_names[i].id, .name = m->stencil_names[i].name};
    for (size_t i = 0; i < p->n_nodes; i++)
        used[i] = p->nodes[i].pass;
    rl_code code = rl_materials_resolve(&s->arena, p->profiles, p->shading, p->materials, names,
                                        m->n_stencil_names, used, p->n_nodes, s->log, &q->materials, err);
    return code ? code
                : rl_material_sets_fill(&s->arena, p->nodes, p->n_nodes, q->materials, names,
                                        m->n_stencil_names, &q->nodes, err);
}

/* The layers that the graph can bind: single ones, each light's, and the planes of the active lights
 * together. */
static rl_code list_layers(rl_session *s, const rl_sequence *q, rl_layer_info **out, size_t *n, rl_error *err)
{
    const rl_manifest *m = q->manifest;
    rl_layer_info *info = rl_arena_array(&s->arena, (size_t)m->n_layers + 2, sizeof *info);
    if (!info)
        return rl_fail_memory(err, (size_t)m->n_layers * sizeof *info);
    static const int planes[] = {[RL_RGB] = 3, [RL_NORMAL] = 3, [RL_VEC2] = 2, [RL_SCALAR] = 1, [RL_ID] = 1};
    for (int i = 0; i < m->n_layers; i++) {
        rl_format format = rl_layer_types[m->layers[i].id].format;
        if (m->layers[i].light || format == RL_LIGHTS)
            format = RL_SCALAR;
        info[(*n)++] = (rl_layer_info){m->layers[i].name, format, planes[format]};
    }
    if (q->shadow.n)
        info[(*n)++] = (rl_layer_info){"shadow", RL_LIGHTS, q->shadow.n};
    if (q->thickness.n)
        info[(*n)++] = (rl_layer_info){"shadow_thickness", RL_LIGHTS, q->thickness.n};
    *out = info;
    return RL_OK;
}

/* Image files other than EXR hold grey or colours. */
static rl_code check_formats(const rl_session *s, const rl_graph *graph, rl_error *err)
{
    for (size_t i = 0; i < s->n_outputs; i++) {
        const rl_output *o = s->outputs[i].spec;
        const rl_image *image = &graph->images[graph->outputs[i].images[0]];
        for (size_t k = 0; k < graph->outputs[i].n_images; k++)
            if (graph->images[graph->outputs[i].images[k]].format == RL_SUMS)
                return rl_fail(err, RL_E_CONFIG, o->layers[k].where,
                               "output '%s': '%s' is sums over a frame, no image; 'relit ab' writes them, as "
                               "the ledger of energy",
                               o->name, graph->images[graph->outputs[i].images[k]].name);
        bool many = image->planes > 3 || image->planes == 2;
        if (strcasecmp(rl_path_extension(o->file), ".exr") && (image->format == RL_ID || many))
            return rl_fail(err, RL_E_CONFIG, o->file_where,
                           "output '%s': a %s file cannot hold '%s' (%s, %d plane%s); write .exr", o->name,
                           rl_path_extension(o->file), image->name, rl_format_name(image->format),
                           image->planes, image->planes == 1 ? "" : "s");
    }
    return RL_OK;
}

static rl_code make_plan(rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_layer_info *layers = NULL;
    size_t n = 0;
    rl_code code = list_layers(s, q, &layers, &n, err);
    if (!code)
        code = rl_graph_build(&s->arena, q->nodes, s->pipeline->n_nodes, layers, n, s->wanted,
                              s->n_outputs + s->n_hidden, &q->graph, err);
    if (!code)
        code = check_formats(s, q->graph, err);
    if (!code)
        code = rl_graph_check_needs(&s->arena, q->graph, q->materials, err);
    if (!code)
        code = rl_plan_make(&s->arena, q->graph, &q->plan, err);
    if (!code)
        rl_session_note_absent(s, q);
    return code;
}

bool rl_session_keeps_ids(const rl_session *s)
{
    for (size_t i = 0; i < s->n_outputs; i++)
        for (size_t k = 0; k < s->wanted[i].n_layers; k++)
            if (!strcmp(s->wanted[i].layers[k].image, "capture.stencil"))
                return true;
    return false;
}

/* What reading the files of a frame takes besides its buffers: they are read one after the other. */
static uint64_t decode_bytes(const rl_frame *f, int threads)
{
    uint64_t most = 0;
    for (int i = 0; i < RL_MOST_FILES; i++)
        for (int part = 0; f->files[i] && part < rl_exr_parts(f->files[i]); part++) {
            uint64_t bytes = rl_exr_read_scratch(f->files[i], part, threads);
            most = bytes > most ? bytes : most;
        }
    return most;
}

static bool meets(const int *crop, rl_exr_box b)
{
    return crop[0] <= b.x1 && b.x0 <= crop[0] + crop[2] - 1 && crop[1] <= b.y1 &&
           b.y0 <= crop[1] + crop[3] - 1;
}

/* A region that has nothing of the image is a slip of the command line. One that a frame has no data for,
 * though it is in its display window, is that frame's error. */
static rl_code check_crop(const rl_session *s, const rl_frame *f, rl_error *err)
{
    const int *c = s->options.crop;
    rl_exr_box d = f->display_window;
    if (c[2] <= 0 || meets(c, d) || meets(c, f->data_window))
        return RL_OK;
    return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                   "--crop %d,%d,%d,%d lies outside of the image, which is %d,%d,%d,%d", c[0], c[1], c[2],
                   c[3], d.x0, d.y0, d.x1 - d.x0 + 1, d.y1 - d.y0 + 1);
}

/* The size of the first frame that can be opened; when none can, the error of the first. */
static rl_code measure(const rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_error first = {0};
    for (size_t i = 0; i < q->frames.n; i++) {
        rl_frame f = {.number = q->frames.numbers[i]};
        rl_error one = {0};
        rl_code code = rl_reader_open(q->reader, f.number, &f, &one);
        if (!code)
            code = check_crop(s, &f, &one);
        q->geometry = f.geometry;
        q->decode_bytes = code ? 0 : decode_bytes(&f, s->threads);
        rl_frame_free(&f);
        if (!rl_reader_missed(code)) {
            *err = code ? one : *err;
            return code;
        }
        first = first.code ? first : one;
    }
    *err = first;
    return first.code;
}

rl_code rl_sequence_read_for(rl_session *s, rl_sequence *q, const rl_plan *plan, bool keep_ids, rl_error *err)
{
    rl_reader_setup setup = {.manifest = q->manifest,
                             .plan = plan,
                             .materials = q->materials,
                             .shadow = q->shadow,
                             .shadow_thickness = q->thickness,
                             .ocio = s->ocio,
                             .working = s->working,
                             .keep_ids = keep_ids,
                             .limit = s->options.memory_limit,
                             .log = s->log};
    rl_reader_free(&q->reader);
    return rl_reader_new(&setup, &q->reader, err);
}

static rl_code make_reader(rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_code code = rl_sequence_read_for(s, q, q->plan, rl_session_keeps_ids(s), err);
    return code || q->manifest->n_patterns == 0 ? code : measure(s, q, err);
}

static rl_code open_sequence(rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_code code = choose_frames(s, q, err);
    if (!code)
        code = bind_manifest(s, q, err);
    if (!code)
        code = rl_session_lights(s, q, err);
    if (!code)
        code = make_materials(s, q, err);
    if (!code)
        code = make_plan(s, q, err);
    if (!code)
        code = make_reader(s, q, err);
    return code;
}

void rl_sequence_close(rl_sequence *q)
{
    rl_executor_free(&q->executor);
    rl_reader_free(&q->reader);
}

rl_code rl_session_sequences(rl_session *s, rl_error *err)
{
    const rl_options *o = &s->options;
    const rl_value *own = s->pipeline->capture;
    size_t n = o->n_captures ? o->n_captures : 1;
    s->sequences = rl_arena_array(&s->arena, n, sizeof *s->sequences);
    if (!s->sequences)
        return rl_fail_memory(err, n * sizeof *s->sequences);
    if (!o->n_captures && !own)
        return rl_fail_file(err, RL_E_CONFIG, s->pipeline->file,
                            "no capture: give 'capture:' in the pipeline or --capture PATH");
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++) {
        rl_sequence *q = &s->sequences[s->n_sequences++];
        const char *presets = rl_data_path(&s->arena, "presets");
        if (o->n_captures)
            code = load_manifest(s, o->captures[i], q, err);
        else if (own->kind == RL_TEXT)
            code = load_manifest(s, rl_value_path(&s->arena, own), q, err);
        else
            code = rl_manifest_parse(&s->arena, own, presets, s->log, &q->manifest, err);
        if (!code)
            code = open_sequence(s, q, err);
    }
    return code;
}
