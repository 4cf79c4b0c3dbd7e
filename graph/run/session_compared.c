/* The images of a variant that are compared, as hidden outputs behind the pipeline's (experiment.h). */
#include "graph/run/session.h"

/* Of the outputs that are made: the first of one image with a display, else with a colour space, else any. */
static const rl_output *choose_output(const rl_session *s)
{
    const rl_output *best = NULL;
    for (size_t i = 0; i < s->n_outputs; i++) {
        const rl_output *o = s->outputs[i].spec;
        if (o->n_layers != 1)
            continue;
        bool better =
            !best || (o->display && !best->display) || (o->colorspace && !best->display && !best->colorspace);
        best = better ? o : best;
    }
    return best;
}

static rl_code add(rl_session *s, const char *name, const rl_output *like, rl_sink_output *about,
                   rl_error *err)
{
    rl_output *spec = rl_arena_alloc(&s->arena, sizeof *spec);
    if (!spec)
        return rl_fail_memory(err, sizeof *spec);
    *spec = *like;
    spec->name = name;
    rl_wanted *wanted = &s->wanted[s->n_outputs + s->n_hidden];
    rl_code code = rl_session_make_output(s, spec, about, wanted, err);
    s->n_hidden += !code;
    return code;
}

static rl_code default_display(const rl_session *s, rl_output *o, rl_arena *arena, rl_error *err)
{
    rl_ocio_names displays = {0};
    rl_code code = rl_ocio_list_names(s->ocio, RL_OCIO_DISPLAYS, NULL, arena, &displays, err);
    if (!code && !displays.n)
        code = rl_fail(err, RL_E_COLOR, o->color_where, "the colour config has no display to compare on");
    o->display = displays.n ? displays.names[0] : NULL; /* OpenColorIO lists the default first */
    o->view = o->look = NULL;
    return code;
}

rl_code rl_session_compared(rl_session *s, rl_error *err)
{
    const rl_output *chosen = choose_output(s);
    if (!chosen)
        return rl_fail_file(err, RL_E_CONFIG, s->pipeline->file,
                            "nothing to compare: no output of one image is made");
    rl_sink_output about;
    rl_output linear = *chosen, display = *chosen;
    linear.display = linear.view = linear.look = NULL;
    linear.colorspace = "lin_rec709";
    linear.exposure = 0;
    rl_code code = add(s, "compare.linear", &linear, &about, err);
    if (!code && !chosen->display)
        code = default_display(s, &display, &s->arena, err);
    display.colorspace = NULL;
    if (!code)
        code = add(s, "compare.display", &display, &about, err);
    if (code)
        return code;
    s->compared.space = about.space;
    s->compared.shown = chosen->display ? chosen : about.spec;
    s->compared.linear = chosen->layers[0].image;
    s->compared.display = about.space;
    return RL_OK;
}
