/* The ambient light of a session: written coefficients, lobes and an HDRI, in the working space. */
#include <math.h>
#include <string.h>

#include "graph/model/sky.h"
#include "graph/run/image_file.h"
#include "graph/run/session.h"

#define RL_AMBIENT_BRIGHTEST 1e30f

/* Row c of the matrix, times intensity. */
static float convert(const rl_ambient *a, const float m[9], const double rgb[3], int c)
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (double)m[3 * c + k] * a->intensity[k] * rgb[k];
    return (float)sum;
}

/* Its mirror images, in the working space. */
static rl_code add_sky(rl_session *s, const rl_ambient *a, const float *const rgb[3],
                       const rl_image_file *file, const float m[9], rl_error *err)
{
    rl_sky sky;
    float matrix[9];
    for (int i = 0; i < 9; i++)
        matrix[i] = (float)((double)m[i] * a->intensity[i % 3]);
    rl_code code = rl_sky_make(a, rgb, file->width, file->height, matrix, s->pool, &sky, err);
    if (code)
        return code;
    s->sky = sky.data;
    s->n_sky = sky.n;
    s->ambient.sky_levels = RL_SKY_LEVELS;
    memcpy(s->ambient.sky_side, sky.side, sizeof sky.side);
    memcpy(s->ambient.sky_at, sky.at, sizeof sky.at);
    return RL_OK;
}

static unsigned long long count_below(const rl_image_file *file)
{
    unsigned long long n = 0;
    size_t samples = (size_t)file->width * (size_t)file->height * (file->channels >= 3 ? 3 : 1);
    for (size_t i = 0; i < samples; i++)
        n += file->planes[i] < 0;
    return n;
}

static rl_code add_hdri(rl_session *s, rl_ambient *a, const float m[9], rl_error *err)
{
    rl_image_file file = {0};
    rl_error why = {0};
    rl_code code = rl_image_file_read_within(a->hdri, s->options.memory_limit, &file, &why);
    if (code)
        return rl_fail(err, code, a->hdri_where, "the hdri '%s' %s", a->hdri, why.text);
    size_t plane = (size_t)file.width * (size_t)file.height;
    const float *rgb[3];
    for (size_t c = 0; c < 3; c++)
        rgb[c] = file.planes + (file.channels >= 3 ? c * plane : 0);
    if (file.type != RL_IMAGE_HALF && file.type != RL_IMAGE_FLOAT)
        code = rl_fail(err, RL_E_CONFIG, a->hdri_where,
                       "%s holds integers; an hdri is linear light, half or float", a->hdri);
    if (!code && file.width != 2 * file.height)
        rl_report(s->log, RL_WARNING, a->hdri_where,
                  "%s has %d x %d pixels; a latitude-longitude image is twice as wide as high", a->hdri,
                  file.width, file.height);
    unsigned long long below = code ? 0 : count_below(&file);
    if (below)
        rl_report(s->log, RL_WARNING, a->hdri_where, "%s: %llu samples are below 0, and take light away",
                  a->hdri, below);
    unsigned long long bad = code ? 0 : rl_ambient_project(a, rgb, file.width, file.height, a->sh);
    if (bad)
        rl_report(s->log, RL_WARNING, a->hdri_where, "%s: %llu samples are NaN or infinite and count as 0",
                  a->hdri, bad);
    if (!code && a->specular)
        code = add_sky(s, a, rgb, &file, m, err);
    rl_image_file_free(&file);
    return code;
}

/* Kernels compute with floats: what would not fit would be NaN in the picture. */
static rl_code check_brightness(const rl_session *s, rl_where where, rl_error *err)
{
    const ambient_t *a = &s->ambient;
    float most = 0;
    for (int i = 0; i < 3 * RL_AMBIENT_BANDS; i++)
        most = fabsf(a->sh[i]) <= RL_AMBIENT_BRIGHTEST ? most : a->sh[i];
    for (int i = 0; i < 3 * a->lobes; i++)
        most = a->lobe[i / 3].flux[i % 3] <= RL_AMBIENT_BRIGHTEST ? most : a->lobe[i / 3].flux[i % 3];
    for (size_t i = 0; i < s->n_sky; i++)
        most = fabsf(s->sky[i]) <= RL_AMBIENT_BRIGHTEST ? most : s->sky[i];
    if (most != 0)
        return rl_fail(err, RL_E_CONFIG, where,
                       "the ambient light is too bright: %g W/(sr m2), at most %g can be computed with",
                       (double)most, (double)RL_AMBIENT_BRIGHTEST);
    return RL_OK;
}

rl_code rl_session_ambient(rl_session *s, rl_error *err)
{
    rl_ambient a;
    float m[9];
    if (!s->pipeline->ambient)
        return RL_OK;
    rl_code code = rl_ambient_parse(&s->arena, s->pipeline->ambient, &a, err);
    if (!code)
        code = rl_session_light_matrix(s, a.colorspace, a.colorspace_where, m, err);
    if (!code && a.hdri)
        code = add_hdri(s, &a, m, err);
    if (code)
        return code;
    ambient_t *out = &s->ambient;
    out->on = 1;
    out->lobes = (int)a.n_lobes;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < RL_AMBIENT_BANDS; i++)
            out->sh[3 * i + c] = convert(&a, m, a.sh[i], c);
        for (size_t i = 0; i < a.n_lobes; i++) {
            const rl_ambient_lobe *lobe = &a.lobes[i];
            out->lobe[i].axis[c] = (float)lobe->axis[c];
            out->lobe[i].sharpness = (float)lobe->sharpness;
            out->lobe[i].flux[c] =
                convert(&a, m, lobe->amplitude, c) * (float)rl_ambient_lobe_flux(lobe->sharpness);
        }
    }
    return check_brightness(s, a.colorspace_where, err);
}

_Static_assert((int)RL_AMBIENT_LOBES == RL_LOBES, "the pipeline's limit is the kernels'");
