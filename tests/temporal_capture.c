#include "tests/temporal_capture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- frames
 * ------------------------------------------------------------------------------------------------------- */

static rl_code keep(rl_session *s, const char *name, temporal_images *m, float **planes, int *n,
                    rl_error *err)
{
    rl_image_view v;
    rl_code code = rl_session_image(s, name, &v, err);
    if (code)
        return code;
    size_t pixels = (size_t)v.width * (size_t)v.height;
    float *all = malloc((size_t)v.planes * pixels * sizeof *all);
    planes[0] = all;
    if (!all)
        return rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "out of memory");
    for (int p = 0; p < v.planes; p++) {
        planes[p] = all + (size_t)p * pixels;
        for (int y = 0; y < v.height; y++)
            memcpy(planes[p] + (size_t)y * (size_t)v.width, v.plane[p] + (size_t)y * v.stride,
                   (size_t)v.width * sizeof(float));
    }
    m->width = v.width;
    m->height = v.height;
    *n = v.planes;
    return RL_OK;
}

rl_code temporal_images_make(const rl_options *given, temporal_images *m, rl_error *err)
{
    static const char *const dump[] = {"sss.color",      "aa.color",       "light.diffuse",  "light.lit",
                                       "capture.motion", "capture.shadow", "capture.stencil"};
    rl_options options = *given;
    rl_session *s = NULL;
    int planes;
    memset(m, 0, sizeof *m);
    options.dump = dump;
    options.n_dump = sizeof dump / sizeof *dump;
    rl_code code = rl_session_open(&options, &s, err);
    for (size_t i = 0; !code && i < rl_session_frames(s, 0) && i < TEMPORAL_FRAMES; i++) {
        code = rl_session_process(s, 0, rl_session_frame(s, 0, i), NULL, err);
        if (!code)
            code = keep(s, "sss.color", m, m->raw[i], &planes, err);
        if (!code)
            code = keep(s, "aa.color", m, m->done[i], &planes, err);
        if (!code)
            code = keep(s, "light.diffuse", m, m->diffuse[i], &planes, err);
        if (!code)
            code = keep(s, "light.lit", m, m->lit[i], &planes, err);
        if (!code)
            code = keep(s, "capture.motion", m, m->motion[i], &planes, err);
        if (!code)
            code = keep(s, "capture.shadow", m, m->shadow[i], &m->lights, err);
        if (!code)
            code = keep(s, "capture.stencil", m, &m->stencil[i], &planes, err);
        m->n += !code;
    }
    rl_session_close(&s);
    return code;
}

void temporal_images_free(temporal_images *m)
{
    for (int i = 0; i < TEMPORAL_FRAMES; i++) {
        free(m->raw[i][0]);
        free(m->done[i][0]);
        free(m->diffuse[i][0]);
        free(m->lit[i][0]);
        free(m->motion[i][0]);
        free(m->shadow[i][0]);
        free(m->stencil[i]);
    }
    memset(m, 0, sizeof *m);
}

/* ---- flicker
 * ------------------------------------------------------------------------------------------------------ */

static double luminance(const temporal_images *m, float *const rgb[3], double x, double y, bool nearest)
{
    static const double weight[3] = {0.2126, 0.7152, 0.0722};
    double fx = floor(x), fy = floor(y), tx = x - fx, ty = y - fy, sum = 0;
    if (nearest) {
        tx = tx > 0.5;
        ty = ty > 0.5;
    }
    size_t i = (size_t)fy * (size_t)m->width + (size_t)fx, below = i + (size_t)m->width;
    for (int c = 0; c < 3; c++) {
        const float *p = rgb[c];
        sum += weight[c] * ((1 - ty) * ((1 - tx) * (double)p[i] + tx * (double)p[i + 1]) +
                            ty * ((1 - tx) * (double)p[below] + tx * (double)p[below + 1]));
    }
    return sum;
}

#define MOST_CHANGE 1.05 /* of the light, over the whole span */

/* Whether the 5x5 pixels around (x, y) of frame i show what pixel `like` of frame `of` shows, lit by the same
 * lights. */
static bool is_same(const temporal_images *m, int i, double x, double y, int of, size_t like)
{
    int left = (int)floor(x) - 2, top = (int)floor(y) - 2;
    if (left < 0 || top < 0 || left + 6 > m->width || top + 6 > m->height)
        return false;
    for (int k = 0; k < 36; k++) {
        size_t at = (size_t)(top + k / 6) * (size_t)m->width + (size_t)(left + k % 6);
        if (memcmp(&m->stencil[i][at], &m->stencil[of][like], sizeof(float)))
            return false;
        for (int l = 0; l < m->lights; l++)
            if (m->shadow[i][l][at] != m->shadow[of][l][like])
                return false;
    }
    return true;
}

/* Mean light that reaches the 5x5 pixels around (x, y), green. */
static double light_at(const temporal_images *m, int i, double x, double y)
{
    double sum = 0;
    for (int k = 0; k < 25; k++) {
        size_t at =
            (size_t)(floor(y + 0.5) + k / 5 - 2) * (size_t)m->width + (size_t)(floor(x + 0.5) + k % 5 - 2);
        sum += (double)m->diffuse[i][1][at] + (double)m->lit[i][1][at];
    }
    return sum / 25;
}

/* Sum of squares of v[0…n-1] beside the straight line that fits best. */
static double beside_line(const double *v, int n)
{
    double mean = 0, slope = 0, spread = 0, sum = 0, middle = 0.5 * (n - 1);
    for (int i = 0; i < n; i++)
        mean += v[i] / n;
    for (int i = 0; i < n; i++) {
        slope += (i - middle) * (v[i] - mean);
        spread += (i - middle) * (i - middle);
    }
    for (int i = 0; i < n; i++)
        sum += pow(v[i] - mean - slope / spread * (i - middle), 2);
    return sum;
}

/* Follows pixel (x, y) of the last frame back; false where it changes material or light. */
static bool follow(const temporal_images *m, int x, int y, bool nearest, double *raw, double *done)
{
    double px = x, py = y, least = INFINITY, most = 0;
    int last = m->n - 1;
    size_t like = (size_t)y * (size_t)m->width + (size_t)x;
    uint32_t id;
    memcpy(&id, &m->stencil[last][like], sizeof id);
    for (int k = 0; k < TEMPORAL_SPAN; k++) {
        int i = last - k;
        if (!id || !is_same(m, i, px, py, last, like))
            return false;
        least = fmin(least, light_at(m, i, px, py));
        most = fmax(most, light_at(m, i, px, py));
        raw[k] = luminance(m, m->raw[i], px, py, nearest);
        done[k] = luminance(m, m->done[i], px, py, nearest);
        size_t at = (size_t)floor(py + 0.5) * (size_t)m->width + (size_t)floor(px + 0.5);
        px += (double)m->motion[i][0][at];
        py += (double)m->motion[i][1][at];
    }
    return most <= MOST_CHANGE * least;
}

temporal_flicker temporal_measure_flicker(const temporal_images *m, bool nearest)
{
    temporal_flicker f = {0};
    double raw[TEMPORAL_SPAN], done[TEMPORAL_SPAN], mean = 0;
    for (int y = 0; y < m->height && m->n >= TEMPORAL_SPAN; y++) {
        for (int x = 0; x < m->width; x++) {
            if (!follow(m, x, y, nearest, raw, done))
                continue;
            f.pixels++;
            f.raw += beside_line(raw, TEMPORAL_SPAN) / (TEMPORAL_SPAN - 2);
            f.done += beside_line(done, TEMPORAL_SPAN) / (TEMPORAL_SPAN - 2);
            mean += raw[0];
        }
    }
    double n = fmax((double)f.pixels, 1);
    f.raw = sqrt(f.raw / n) / (mean / n);
    f.done = sqrt(f.done / n) / (mean / n);
    return f;
}
