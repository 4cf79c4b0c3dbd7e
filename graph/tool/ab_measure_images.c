/* The images of a frame, looked at before they are compared. */
#include <math.h>
#include <stdatomic.h>

#include "graph/tool/ab_measure_parts.h"
#include "graph/tool/metric_filter.h"

/* A look at every value of an image: the first that is no number, and a clamped copy. */
typedef struct look {
    const rl_compared_image *image;
    float *clamped; /* three planes without gaps, or NULL */
    atomic_size_t bad;
} look;

static void look_at_row(void *ctx, int y)
{
    look *l = ctx;
    size_t width = (size_t)l->image->width, n = width * (size_t)l->image->height;
    for (size_t c = 0; c < 3; c++) {
        const float *row = l->image->plane[c] + (size_t)y * l->image->stride;
        for (size_t x = 0; x < width; x++) {
            size_t at = (size_t)y * width + x, bad;
            if (!isfinite(row[x]))
                for (bad = atomic_load(&l->bad); at < bad;)
                    if (atomic_compare_exchange_weak(&l->bad, &bad, at))
                        break;
            if (l->clamped)
                l->clamped[c * n + at] = fminf(fmaxf(row[x], 0), 1);
        }
    }
}

/* Of a variant at a frame: NaN is never equal to anything, and a difference of infinities is none. */
static rl_code check_image(const rl_ab_measure *m, const rl_experiment_frame *frame, size_t variant,
                           rl_compared which, rl_error *err)
{
    const rl_compared_image *image = &frame->images[variant][which];
    size_t n = (size_t)frame->width * (size_t)frame->height;
    look l = {.image = image};
    atomic_init(&l.bad, SIZE_MAX);
    if (which == RL_COMPARED_DISPLAY)
        l.clamped = m->display + variant * 3 * n;
    rl_filter_bands(m->pool, image->height, look_at_row, &l);
    size_t bad = atomic_load(&l.bad);
    if (bad == SIZE_MAX)
        return RL_OK;
    int x = (int)(bad % (size_t)image->width), y = (int)(bad / (size_t)image->width), c = 0;
    float v = image->plane[0][(size_t)y * image->stride + (size_t)x];
    while (isfinite(v))
        v = image->plane[++c][(size_t)y * image->stride + (size_t)x];
    return rl_fail(err, RL_E_DATA, RL_NOWHERE,
                   "variant '%s', capture '%s', frame %lld: %s (%s) holds %s in %s at pixel (%d, %d); images "
                   "to compare must be finite",
                   m->plan->variants[variant].name,
                   rl_session_capture_name(rl_experiment_session(m->experiment, variant), frame->capture),
                   frame->frame, rl_experiment_image_name(m->experiment, variant, RL_COMPARED_LINEAR),
                   which == RL_COMPARED_LINEAR ? "linear" : "for the display",
                   isnan(v) ? "NaN"
                   : v > 0  ? "infinity"
                            : "-infinity",
                   c == 0   ? "red"
                   : c == 1 ? "green"
                            : "blue",
                   x + frame->x, y + frame->y);
}

rl_code rl_ab_measure_check(const rl_ab_measure *m, const rl_experiment_frame *frame, size_t variant,
                            rl_error *err)
{
    rl_code code = check_image(m, frame, variant, RL_COMPARED_LINEAR, err);
    return code ? code : check_image(m, frame, variant, RL_COMPARED_DISPLAY, err);
}

void rl_ab_round(const float *in, size_t n, int levels, float *out)
{
    float most = (float)levels;
    for (size_t i = 0; i < n; i++)
        out[i] = floorf(in[i] * most + 0.5f) / most;
}

rl_metric_image rl_ab_view(const rl_compared_image *image, bool encoded)
{
    return (rl_metric_image){.width = image->width,
                             .height = image->height,
                             .channels = 3,
                             .plane = {image->plane[0], image->plane[1], image->plane[2]},
                             .stride = image->stride,
                             .encoded = encoded};
}

rl_metric_image rl_ab_measure_view(const rl_ab_measure *m, const rl_experiment_frame *frame, int variant,
                                   rl_compared which)
{
    size_t n = (size_t)frame->width * (size_t)frame->height;
    const float *planes = m->display + (size_t)variant * 3 * n;
    const rl_compared_image clamped = {
        frame->width, frame->height, {planes, planes + n, planes + 2 * n}, (size_t)frame->width};
    return which == RL_COMPARED_LINEAR ? rl_ab_view(&frame->images[variant][which], false)
                                       : rl_ab_view(&clamped, true);
}
