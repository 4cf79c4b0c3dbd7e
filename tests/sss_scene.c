/* See sss_scene.h. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/sss_scene.h"

cl_session *sss_session;
int sss_width;

twin_material sss_materials[SSS_MATERIALS] = {
    {0, {0, 0, 0}, 0, 0, {0}, 0, 0},    {1, {3.0f, 1.2f, 0.7f}, 0, 0, {0}, 0, 0},
    {1, {6, 5, 3}, 1, 1, {0}, 1, 0},    {0, {0, 0, 0}, 0, 0, {0}, 0, 0},
    {1, {2, 4, 8.5f}, 1, 0, {0}, 0, 1}, {1, {1, 1, 1}, 0, 1, {0}, 0, 0},
};

float *sss_planes(size_t n)
{
    float *p = rl_calloc(n, sizeof *p);
    assert_non_null(p);
    return p;
}

sss_scene sss_scene_make(int x, int y, int width, int height, float focal)
{
    sss_scene s = {0};
    cl_frame(&s.twin.frame, x, y, width, height, focal);
    s.n = (size_t)s.twin.frame.columns * (size_t)s.twin.frame.rows;
    s.diffuse = sss_planes(3 * s.n);
    s.lit = sss_planes(3 * s.n);
    s.albedo = sss_planes(3 * s.n);
    s.normal = sss_planes(3 * s.n);
    s.color = sss_planes(3 * s.n);
    s.filtered = sss_planes(3 * s.n);
    s.depth = sss_planes(s.n);
    s.stencil = (uint32_t *)sss_planes(s.n);
    s.twin.materials = sss_materials;
    s.twin.rotation = TWIN_BLUE;
    s.twin.diffuse = s.diffuse;
    s.twin.lit = s.lit;
    s.twin.albedo = s.albedo;
    s.twin.normal = s.normal;
    s.twin.depth = s.depth;
    s.twin.stencil = s.stencil;
    return s;
}

void sss_scene_free(sss_scene *s)
{
    float *all[] = {s->diffuse, s->lit,      s->albedo,           s->normal, s->depth,
                    s->color,   s->filtered, (float *)s->stencil, s->energy};
    for (size_t i = 0; i < 9; i++)
        rl_free(all[i]);
}

/* Where pixel (x, y) of `part` is in a plane of `whole`. */
static size_t index_in(const sss_scene *whole, const sss_scene *part, int x, int y)
{
    const frame_t *a = &whole->twin.frame, *b = &part->twin.frame;
    x += b->origin[0] - a->origin[0];
    y += b->origin[1] - a->origin[1];
    return (size_t)y * (size_t)a->columns + (size_t)x;
}

void sss_scene_crop(sss_scene *part, const sss_scene *whole)
{
    memcpy(part->twin.frame.camera.centre, whole->twin.frame.camera.centre, sizeof(float[2]));
    SSS_EACH_PIXEL(part, x, y, to)
    {
        size_t from = index_in(whole, part, x, y);
        part->stencil[to] = whole->stencil[from];
        part->depth[to] = whole->depth[from];
        for (size_t c = 0; c < 3; c++) {
            part->diffuse[c * part->n + to] = whole->diffuse[c * whole->n + from];
            part->lit[c * part->n + to] = whole->lit[c * whole->n + from];
            part->albedo[c * part->n + to] = whole->albedo[c * whole->n + from];
            part->normal[c * part->n + to] = whole->normal[c * whole->n + from];
        }
    }
}

void sss_crop_is_same(const sss_scene *part, const sss_scene *whole, int left_right, int top_bottom)
{
    const int *valid = part->twin.frame.valid;
    SSS_EACH_PIXEL(part, x, y, i)
    {
        if (x < valid[0] + left_right || x >= valid[2] - left_right || y < valid[1] + top_bottom ||
            y >= valid[3] - top_bottom)
            continue;
        size_t from = index_in(whole, part, x, y);
        for (size_t c = 0; c < 3; c++)
            assert_memory_equal(&whole->color[c * whole->n + from], &part->color[c * part->n + i],
                                sizeof(float));
    }
}

float sss_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* Blobs of all sss_materials and of nothing, a bumpy surface with jumps in depth, random light. */
void sss_scene_random(sss_scene *s, uint32_t seed)
{
    float centre[12][2];
    for (int k = 0; k < 12; k++) {
        centre[k][0] = sss_random(&seed) * (float)s->twin.frame.columns;
        centre[k][1] = sss_random(&seed) * (float)s->twin.frame.rows;
    }
    SSS_EACH_PIXEL(s, x, y, i)
    {
        int nearest = 0;
        for (int k = 1; k < 12; k++)
            if (hypotf((float)x - centre[k][0], (float)y - centre[k][1]) <
                hypotf((float)x - centre[nearest][0], (float)y - centre[nearest][1]))
                nearest = k;
        int id = nearest % 6;
        if (sss_random(&seed) < 0.02f)
            id = (int)(sss_random(&seed) * 6);
        float jump = nearest >= 9 ? 0.5f : nearest >= 6 ? 0.1f : 0.0f;
        float bump = 0.01f * sinf(0.13f * (float)x) * cosf(0.21f * (float)y) + 0.002f * sss_random(&seed);
        s->stencil[i] = (uint32_t)id;
        s->depth[i] = id ? 0.7f + jump + bump : 0;
        float n[3] = {sss_random(&seed) - 0.5f, sss_random(&seed) - 0.5f, 0.1f + sss_random(&seed)};
        float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (size_t c = 0; c < 3; c++) {
            s->diffuse[c * s->n + i] = sss_materials[id].has_profile ? 4 * sss_random(&seed) : 0;
            s->lit[c * s->n + i] = id ? sss_random(&seed) : 0;
            s->albedo[c * s->n + i] = sss_random(&seed);
            s->normal[c * s->n + i] = n[c] / length;
        }
    }
}

/* A plane parallel to the screen, one material, `light` everywhere. */
void sss_scene_flat(sss_scene *s, uint32_t id, float depth, float light)
{
    SSS_EACH_PIXEL(s, x, y, i)
    {
        s->stencil[i] = id;
        s->depth[i] = depth;
        for (size_t c = 0; c < 3; c++) {
            s->diffuse[c * s->n + i] = light;
            s->lit[c * s->n + i] = 0.25f;
            s->albedo[c * s->n + i] = 0.3f + 0.2f * (float)c + 0.1f * (float)((x ^ y) & 1);
        }
        s->normal[2 * s->n + i] = 1;
    }
}

void sss_run(sss_scene *s, const rl_pass *pass, const void *params, cl_session *on)
{
    const cl_image images[] = {
        {"diffuse", s->diffuse, NULL}, {"lit", s->lit, NULL},           {"albedo", s->albedo, NULL},
        {"normal", s->normal, NULL},   {"depth", s->depth, NULL},       {"stencil", s->stencil, NULL},
        {"color", NULL, s->color},     {"filtered", NULL, s->filtered}, {"energy", NULL, s->energy},
    };
    cl_job job = {.pass = pass,
                  .frame = &s->twin.frame,
                  .params = params,
                  .materials = sss_materials,
                  .materials_bytes = sizeof sss_materials,
                  .images = images,
                  .n_images = s->energy ? 9 : 8,
                  .width = sss_width};
    assert_true(cl_run(on, &job));
}

void sss_run_burley(sss_scene *s, int taps, int weighting)
{
    const sss_burley_params p = {taps, s->twin.tangent, weighting, s->twin.rotation, 7};
    sss_run(s, &rl_pass_sss_burley, &p, sss_session);
}

void sss_run_reference(sss_scene *s, int weighting)
{
    const sss_reference_params p = {s->twin.tangent, weighting};
    sss_run(s, &rl_pass_sss_reference, &p, sss_session);
}

/* The worst difference of the image to the twin's, a pixel in `step`; relative to
 * the value, at least to 0.01. taps 0: the dense sum. */
double sss_worst(sss_scene *s, int taps, int weighting, int step)
{
    double worst = 0;
    int count = 0;
    s->twin.area = weighting != PLAIN;
    s->twin.surface = weighting == SURFACE;
    SSS_EACH_PIXEL(s, x, y, i)
    {
        double filtered[3] = {0}, color[3];
        if (count++ % step)
            continue;
        if (sss_materials[s->stencil[i]].has_profile) {
            if (taps)
                twin_burley(&s->twin, x, y, taps, 7, filtered);
            else
                twin_reference(&s->twin, x, y, filtered);
        }
        twin_resolve(&s->twin, x, y, filtered, color);
        for (size_t c = 0; c < 3; c++) {
            double got = s->color[c * s->n + i];
            assert_true(isfinite(got));
            worst = fmax(worst, fabs(got - color[c]) / fmax(color[c], 1e-2));
        }
    }
    return worst;
}

int sss_open(void **state)
{
    (void)state;
    sss_session = cl_open(0);
    return sss_session ? 0 : -1;
}

int sss_close(void **state)
{
    (void)state;
    cl_close(&sss_session);
    return 0;
}
