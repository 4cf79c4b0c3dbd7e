/* The comments of the manifest that `relit inspect` proposes. */
#include "graph/tool/inspect_parts.h"

#include <string.h>

#include "graph/base/file.h"
#include "graph/run/data_files.h"

static void say_camera(const rl_guesser *g, rl_str *out)
{
    const rl_probe *p = &g->probe;
    const rl_camera_spec *c = &g->m->camera;
    if (!p->lens_source) /* no header was read */
        return;
    if (p->solved && c->matrix_source != RL_SOURCE_HEADER) {
        rl_str_printf(out, "#   camera: found from depth and %s, %.2g pixels off\n",
                      g->m->n_patterns > 1 ? rl_path_name(g->m->patterns[g->position.pattern].path)
                                           : g->position.names[0],
                      p->camera.error);
        return;
    }
    if (c->matrix_source == RL_SOURCE_HEADER && p->matrix_source)
        rl_str_printf(out, "#   camera.matrix: the header has %s\n", p->matrix_source);
    else if (c->matrix_source == RL_SOURCE_HEADER)
        rl_str_add(
            out,
            "#   camera.matrix: the file does not say where the camera is. In place of `header` write 16 "
            "numbers, world to camera,\n"
            "#     rows listed, for column vectors; or render the world position, too, and inspect "
            "finds the camera\n");
    if (c->fov_source != RL_SOURCE_HEADER)
        return;
    if (!strcmp(p->lens_source, "screenWindowWidth") && p->lens_width == 1)
        rl_str_add(out,
                   "#   camera.fov_x: the file does not say it (screenWindowWidth is 1, what writers leave "
                   "there). In place of `header` write degrees\n");
    else
        rl_str_printf(out, "#   camera.fov_x: the header has %s\n", p->lens_source);
}

static void say_depth(const rl_guesser *g, rl_str *out)
{
    const rl_probe *p = &g->probe;
    const rl_layer *depth = rl_manifest_layer(g->m, "depth");
    if (!(p->covered > 0) && depth && !g->unread.code) {
        rl_str_printf(out, "#   depth: no pixel shows a surface: the channel goes from %.4g to %.4g",
                      p->least, p->most);
        rl_str_add(out, p->most <= 0 && p->least < 0 && !depth->negated
                            ? "; with layers.depth.negated: true, -z becomes z\n"
                            : "; check layers.depth (channels, empty, negated)\n");
    }
    if (!(p->covered > 0))
        return;
    rl_str_printf(
        out, "#   unit: depth goes from %.4g to %.4g, median %.4g, over %.0f %% of the picture; with `unit: ",
        p->nearest, p->far, p->median, 100 * p->covered);
    if (g->m->unit == 1)
        rl_str_add(out, "m` these are metres\n");
    else
        rl_str_printf(out, "%g` the median is %.4g m\n", g->m->unit, p->median * g->m->unit);
}

/* No surface sends back more than it gets; and few pictures are of soot alone. */
static void say_albedo(const rl_guesser *g, rl_str *out)
{
    const rl_probe *p = &g->probe;
    if (!p->has_albedo)
        return;
    rl_str_printf(out, "#   albedo: mean %.3g, greatest %.3g", p->albedo_mean, p->albedo_most);
    if (p->albedo_most > 1.02)
        rl_str_add(out, ": more than 1 is clamped; is it lit, or another colour space?");
    else if (p->albedo_mean < 0.005)
        rl_str_add(out, ": nearly black; is it exposed, or another layer?");
    rl_str_add(out, "\n");
}

static void say_normals(const rl_guesser *g, rl_str *out)
{
    const rl_layer *normal = rl_manifest_layer(g->m, "normal"), *depth = rl_manifest_layer(g->m, "depth");
    if (!g->probe.looked_at_normals || !normal || !depth)
        return;
    rl_str_add(out, "#   normal: ");
    if (!rl_normal_check_advice(&g->probe.check, normal, depth, g->m->camera.forward_z, out))
        rl_str_printf(out, "fits depth and camera, mean cosine %.3f at %zu smooth places",
                      g->probe.check.cosine, g->probe.check.samples);
    rl_str_add(out, "\n");
}

static void say_names(const rl_guesser *g, rl_str *out)
{
    static const char *const care[RL_LAYER_COUNT] = {
        [RL_LAYER_ALBEDO] = "the surface's colour, 0..1 and linear, without light",
        [RL_LAYER_NORMAL] = "space, encoding and axes are what most renderers have",
        [RL_LAYER_DEPTH] = "kind and empty are what most renderers have",
    };
    for (int i = 0; i < g->m->n_layers; i++) {
        const rl_layer *l = &g->m->layers[i];
        if (!(g->named & 1u << l->id))
            continue;
        if (!l->n_channels)
            rl_str_add(out, "#   stencil: no channel is named like an id; so all is one material\n");
        else
            rl_str_printf(out, "#   %s: by its name alone%s%s\n", l->name, care[l->id] ? ": " : "",
                          care[l->id] ? care[l->id] : "");
    }
}

static rl_code say_preset(const rl_guesser *g, rl_str *out, rl_error *err)
{
    rl_preset_words words;
    if (!g->preset)
        return RL_OK;
    rl_code code = rl_preset_about(g->arena, rl_data_path(g->arena, "presets"), g->preset, &words, err);
    for (size_t i = 0; i < words.n_check && !code; i++)
        rl_str_printf(out, "#   %s\n", words.check[i]);
    return code;
}

/* Required layers that are in no channel. */
static void say_missing(const rl_guesser *g, rl_str *out)
{
    int missing = 0;
    for (int id = 0; id < RL_LAYER_COUNT; id++) {
        const rl_layer_type *type = &rl_layer_types[id];
        if (!type->required || rl_manifest_layer(g->m, type->name))
            continue;
        if (!missing++)
            rl_str_add(
                out,
                "# relit cannot do without these, and no channel is named like them. Where one is, add it "
                "to layers; else render it:\n");
        rl_str_printf(out, "#   %s: {channels: [%s]%s}    # %s\n", type->name,
                      type->channels == 1 ? "NAME" : "NAME.R, NAME.G, NAME.B",
                      id == RL_LAYER_NORMAL  ? ", space: world, encoding: signed"
                      : id == RL_LAYER_DEPTH ? ", kind: planar"
                                             : "",
                      type->help);
    }
}

/* To be saved beside the files: their names in it are without a folder. */
static rl_code print_manifest(const rl_guesser *g, rl_str *out, rl_error *err)
{
    rl_manifest m = *g->m;
    rl_pattern *patterns = rl_arena_array(g->arena, (size_t)m.n_patterns + 1, sizeof *patterns);
    if (!patterns)
        return rl_fail_memory(err, sizeof *patterns);
    for (int i = 0; i < m.n_patterns; i++) {
        patterns[i] = m.patterns[i];
        patterns[i].path = rl_path_name(m.patterns[i].path);
    }
    m.patterns = patterns;
    rl_manifest_print(&m, out);
    return RL_OK;
}

void rl_inspect_say_pixels(const rl_guesser *g, rl_str *out)
{
    if (g->unread.code)
        rl_str_printf(out, "#   the first frame's pixels cannot be looked at: %s\n", g->unread.text);
    say_camera(g, out);
    say_depth(g, out);
    say_albedo(g, out);
    say_normals(g, out);
}

rl_code rl_inspect_say(const rl_guesser *g, rl_str *out, rl_error *err)
{
    const char *folder = rl_path_folder(g->arena, g->m->patterns[0].path);
    if (!folder)
        return rl_fail_memory(err, 64);
    if (g->preset)
        rl_str_printf(out, "# guessed by preset '%s'%s: ", g->preset, g->named ? " and by names" : "");
    else
        rl_str_printf(out, "# no preset fits %s; guessed by names: ",
                      g->m->n_patterns > 1 ? "these files" : "this file");
    rl_str_printf(out, "check what follows, then save it as %s/capture.yaml\n", folder);
    rl_inspect_say_pixels(g, out);
    say_names(g, out);
    rl_code code = say_preset(g, out, err);
    if (!code)
        code = print_manifest(g, out, err);
    if (!code)
        say_missing(g, out);
    return code;
}
