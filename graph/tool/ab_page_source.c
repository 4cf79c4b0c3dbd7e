/* What the page has to know of an experiment: how its variants are shown. */
#include <math.h>
#include <string.h>

#include "graph/run/session.h"
#include "graph/tool/ab_page.h"

/* From scene-linear Rec. 709 by OpenColorIO itself; what the run's kernels compute is the same (color.h). */
typedef struct shown {
    rl_ocio_transform *transform;
    float gain;
    uint64_t colors;         /* hash of the configuration */
    const rl_output *output; /* with its display, view and look */
} shown;

static rl_code apply(const void *ctx, float *r, float *g, float *b, size_t n, rl_error *err)
{
    const shown *s = ctx;
    for (size_t i = 0; i < n; i++) {
        r[i] *= s->gain;
        g[i] *= s->gain;
        b[i] *= s->gain;
    }
    return rl_ocio_apply(s->transform, r, g, b, n, err);
}

static bool same_text(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

static bool same(const rl_ab_page_display *a, const char *name, const shown *b)
{
    const shown *x = a->ctx;
    return !strcmp(a->name, name) && same_text(x->output->look, b->output->look) && x->gain == b->gain &&
           x->colors == b->colors;
}

static rl_code open_transform(const rl_session *session, const char *name, shown *s, rl_arena *arena,
                              rl_error *err)
{
    const rl_output *o = s->output;
    rl_ocio_names views = {0};
    const char *from = NULL, *view = o->view;
    rl_code code = rl_color_space(session->ocio, "lin_rec709", o->color_where, &from, err);
    if (!code && !view)
        code = rl_ocio_list_names(session->ocio, RL_OCIO_VIEWS, o->display, arena, &views, err);
    if (views.n)
        view = views.names[0]; /* the display's default */
    const rl_ocio_request request = {.from = from, .display = o->display, .view = view, .look = o->look};
    if (!code)
        code = rl_ocio_transform_new(session->ocio, &request, &s->transform, err);
    if (code && err && !err->file[0])
        return rl_fail(err, code, o->color_where, "'%s' cannot be shown in the report", name);
    return code;
}

/* The index of the variant's display among those that there are; a new one is added. */
static rl_code add_display(rl_arena *arena, const rl_session *session, rl_ab_page_display *displays,
                           rl_ab_page_source *out, size_t *index, rl_error *err)
{
    const rl_compared_names *names = &session->compared;
    shown *s = rl_arena_alloc(arena, sizeof *s);
    if (!s)
        return rl_fail_memory(err, sizeof *s);
    s->output = names->shown;
    s->gain = exp2f((float)names->shown->exposure);
    s->colors = session->colors;
    for (size_t i = 0; i < out->n_displays; i++)
        if (same(&displays[i], names->space, s)) {
            *index = i;
            return RL_OK;
        }
    rl_code code = open_transform(session, names->space, s, arena, err);
    if (code)
        return code;
    *index = out->n_displays++;
    displays[*index] = (rl_ab_page_display){names->space, apply, s};
    return RL_OK;
}

rl_code rl_ab_page_source_make(rl_arena *arena, const rl_ab_plan *plan, const rl_experiment *experiment,
                               rl_ab_page_source *out, rl_error *err)
{
    const rl_session *first = rl_experiment_session(experiment, 0);
    size_t n = rl_session_captures(first);
    size_t *n_frames = rl_arena_array(arena, n, sizeof *n_frames);
    size_t *display_of = rl_arena_array(arena, plan->n_listed, sizeof *display_of);
    rl_ab_page_display *displays = rl_arena_array(arena, plan->n_listed, sizeof *displays);
    rl_code code = RL_OK;
    *out = (rl_ab_page_source){
        .n_captures = n, .n_frames = n_frames, .displays = displays, .display_of = display_of};
    if (!n_frames || !display_of || !displays)
        return rl_fail_memory(err, (n + plan->n_listed) * sizeof *n_frames);
    for (size_t k = 0; k < n; k++)
        n_frames[k] = rl_session_frames(first, k);
    for (size_t v = 0; v < plan->n_listed && !code; v++)
        code = add_display(arena, rl_experiment_session(experiment, v), displays, out, &display_of[v], err);
    if (code)
        rl_ab_page_source_close(out);
    return code;
}

void rl_ab_page_source_close(rl_ab_page_source *source)
{
    for (size_t i = 0; i < source->n_displays; i++) {
        shown *s = (shown *)source->displays[i].ctx;
        rl_ocio_transform_free(&s->transform);
    }
    source->n_displays = 0;
}

static const float *map_of(const void *ctx, size_t pair, rl_metric metric)
{
    return rl_ab_measure_map(ctx, pair, metric);
}

rl_code rl_ab_page_measured(rl_ab_page *page, const rl_experiment_frame *frame, rl_ab_measure *measure,
                            const rl_compared_image *reference, rl_error *err)
{
    rl_ab_results results = {0};
    rl_ab_page_input input = {
        .frame = frame, .results = &results, .map = map_of, .ctx = measure, .reference = reference};
    rl_code code = frame->error && frame->error->code ? RL_OK : rl_ab_measure_results(measure, &results, err);
    return code ? code : rl_ab_page_frame(page, &input, err);
}
