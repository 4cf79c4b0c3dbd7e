/* Colour of a session: the OCIO configuration, the working space, and a pass for each output that needs one.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/data_files.h"
#include "graph/run/session.h"

static rl_code open_config(rl_session *s, rl_error *err)
{
    const char *env = getenv("OCIO");
    const char *path = s->options.ocio                           ? s->options.ocio
                       : s->pipeline && s->pipeline->ocio_config ? s->pipeline->ocio_config
                       : env && *env                             ? env
                                     : rl_data_path(&s->arena, "color/relit.ocio");
    if (!path)
        return rl_fail(
            err, RL_E_COLOR, RL_NOWHERE,
            "relit's own colour config color/relit.ocio is not found; give --ocio FILE or set $RELIT_DATA to "
            "the folder that holds it");
    return rl_ocio_open(path, &s->ocio, err);
}

/* Only rgb images are colours; the graph knows formats later, so a converting output must name images that
 * turn out to be rgb: the graph's format check says so. */
rl_code rl_session_make_output(rl_session *s, const rl_output *spec, rl_sink_output *out, rl_wanted *wanted,
                               rl_error *err)
{
    rl_color_pass pass = {0};
    const char *target = s->working;
    *out = (rl_sink_output){.spec = spec};
    bool exposed = spec->exposure != 0;
    rl_ocio_request request = {.from = s->working, .look = spec->look};
    rl_code code = RL_OK;
    if (spec->display) {
        const char *view = spec->view;
        rl_ocio_names views = {0};
        if (!view)
            code = rl_ocio_list_names(s->ocio, RL_OCIO_VIEWS, spec->display, &s->arena, &views, err);
        if (views.n > 0) /* OpenColorIO lists the default first */
            view = views.names[0];
        if (!code)
            code = rl_color_view(s->ocio, spec->display, view, spec->look, spec->color_where, err);
        request.display = spec->display;
        request.view = view;
        out->space = code ? NULL : rl_arena_printf(&s->arena, "%s / %s", spec->display, view);
        if (!code && !out->space)
            code = rl_fail_memory(err, strlen(view));
    } else {
        if (spec->colorspace)
            code = rl_color_space(s->ocio, spec->colorspace, spec->color_where, &target, err);
        request.to = target;
        out->space = target;
        if (!code)
            code = rl_color_primaries(s->ocio, target, spec->color_where, &out->primaries, err);
    }
    bool converts =
        !code && (spec->display || spec->look || exposed || (spec->colorspace && strcmp(target, s->working)));
    if (converts)
        code =
            rl_color_pass_new(s->ocio, &request, exposed, spec->color_where, &s->arena, s->log, &pass, err);
    if (code)
        return code;
    const rl_pass **convert = rl_arena_array(&s->arena, spec->n_layers, sizeof *convert);
    const void **params = rl_arena_array(&s->arena, spec->n_layers, sizeof *params);
    rl_color_params *p = rl_arena_alloc(&s->arena, sizeof *p);
    if (!convert || !params || !p)
        return rl_fail_memory(err, sizeof *p);
    p->exposure = (float)spec->exposure;
    for (size_t i = 0; i < spec->n_layers; i++) {
        convert[i] = pass.pass;
        params[i] = p;
    }
    *wanted = (rl_wanted){.name = spec->name,
                          .where = spec->where,
                          .layers = spec->layers,
                          .convert = convert,
                          .convert_params = params,
                          .n_layers = spec->n_layers};
    return RL_OK;
}

/* The linear-light tone scale between lights given in lin_rec709 and the working space is a 3x3 matrix; OCIO
 * gives its columns as the images of the unit colours. */
rl_code rl_session_light_matrix(const rl_session *s, const char *space, rl_where where, float m[9],
                                rl_error *err)
{
    const char *from;
    rl_code code = rl_color_space(s->ocio, space, where, &from, err);
    if (code)
        return code;
    float r[3] = {1, 0, 0}, g[3] = {0, 1, 0}, b[3] = {0, 0, 1};
    if (strcmp(from, s->working)) {
        rl_ocio_transform *t = NULL;
        rl_ocio_request request = {.from = from, .to = s->working};
        code = rl_ocio_transform_new(s->ocio, &request, &t, err);
        if (!code)
            code = rl_ocio_apply(t, r, g, b, 3, err);
        rl_ocio_transform_free(&t);
    }
    for (int i = 0; i < 3; i++) {
        m[i] = r[i];
        m[3 + i] = g[i];
        m[6 + i] = b[i];
    }
    return code;
}

static bool selected(const rl_session *s, const char *name)
{
    for (size_t i = 0; i < s->options.n_only; i++)
        if (!strcmp(s->options.only[i], name))
            return true;
    return s->options.n_only == 0;
}

static rl_code check_only(const rl_session *s, rl_error *err)
{
    const rl_pipeline *p = s->pipeline;
    for (size_t i = 0; i < s->options.n_only; i++) {
        bool found = false;
        for (size_t k = 0; k < p->n_outputs; k++)
            found |= !strcmp(p->outputs[k].name, s->options.only[i]);
        if (found)
            continue;
        rl_str text = {0};
        const char *names[64];
        size_t n = 0;
        for (; n < p->n_outputs && n < 64; n++)
            names[n] = p->outputs[n].name;
        rl_suggest(&text, s->options.only[i], names, n, "known");
        rl_code code = rl_fail(err, RL_E_USAGE, RL_NOWHERE, "--only: the pipeline has no output '%s'%s",
                               s->options.only[i], rl_str_text(&text));
        rl_str_free(&text);
        return code;
    }
    return RL_OK;
}

/* --dump IMAGE: an EXR of that image beside the outputs, float, in the working space. */
static const rl_output *dump_spec(rl_session *s, const char *image)
{
    rl_output *o = rl_arena_alloc(&s->arena, sizeof *o);
    rl_output_layer *layer = rl_arena_alloc(&s->arena, sizeof *layer);
    if (!o || !layer)
        return NULL;
    *layer = (rl_output_layer){.name = "", .image = image, .where = {.file = "--dump"}};
    *o = (rl_output){.name = rl_arena_printf(&s->arena, "dump.%s", image),
                     .where = layer->where,
                     .layers = layer,
                     .n_layers = 1,
                     .file = rl_arena_printf(&s->arena, "{capture}.%s.{frame:04}.exr", image),
                     .type = RL_FLOAT,
                     .compression = "zip",
                     .quality = -1};
    return o->name && o->file ? o : NULL;
}

/* Depth and stencil are read for every frame: emptiness, coverage and unknown ids are told from them. */
static void add_required(rl_wanted *wanted)
{
    static const rl_output_layer layers[] = {{"depth", "capture.depth", {0}},
                                             {"stencil", "capture.stencil", {0}}};
    static const rl_pass *const convert[2];
    static const void *const params[2];
    *wanted = (rl_wanted){.name = "(coverage, ids)",
                          .layers = layers,
                          .convert = convert,
                          .convert_params = params,
                          .n_layers = 2};
}

rl_code rl_session_colors(rl_session *s, rl_error *err)
{
    rl_code code = open_config(s, err);
    if (!code)
        code = check_only(s, err);
    if (!code && s->pipeline->working)
        code = rl_color_space(s->ocio, s->pipeline->working, s->pipeline->color_where, &s->working, err);
    else if (!code)
        code = rl_color_working(s->ocio, s->pipeline->color_where, &s->working, err);
    size_t most = s->pipeline->n_outputs + s->options.n_dump + 3; /* and the hidden ones */
    s->outputs = rl_arena_array(&s->arena, most, sizeof *s->outputs);
    s->wanted = rl_arena_array(&s->arena, most, sizeof *s->wanted);
    if (!code && (!s->outputs || !s->wanted))
        code = rl_fail_memory(err, most * sizeof *s->outputs);
    for (size_t i = 0; i < s->pipeline->n_outputs && !code; i++) {
        const rl_output *spec = &s->pipeline->outputs[i];
        if (!selected(s, spec->name))
            continue;
        code = rl_session_make_output(s, spec, &s->outputs[s->n_outputs], &s->wanted[s->n_outputs], err);
        s->n_outputs++;
    }
    for (size_t i = 0; i < s->options.n_dump && !code; i++) {
        const rl_output *spec = dump_spec(s, s->options.dump[i]);
        code = spec
                   ? rl_session_make_output(s, spec, &s->outputs[s->n_outputs], &s->wanted[s->n_outputs], err)
                   : rl_fail_memory(err, sizeof *spec);
        s->n_outputs++;
    }
    if (!code)
        add_required(&s->wanted[s->n_outputs]);
    s->n_hidden = 1;
    return code;
}
