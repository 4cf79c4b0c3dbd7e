/* See back_scene.h. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "graph/base/alloc.h"
#include "tests/back_scene.h"

cl_session *back_session;
int back_width;

const back_material back_materials[BACK_MATERIALS] = {
    {0},
    {1, {3.0f, 1.2f, 0.7f}, {0}, 0, 0, BACK_GATHER, 0, 1, 0},
    {1, {5, 6, 3}, {0}, 1, 1, BACK_GATHER, 1, 1, 0},
    {1, {3, 3, 3}, {0}, 0, 0, BACK_GATHER, 0, 0, 0}, /* switched off */
    {1, {3, 3, 3}, {0}, 0, 0, 2, 0, 1, 0},           /* thick */
    {1, {1, 1, 1}, {0}, 0, 1, BACK_GATHER, 0, 1, 1},
};

static float *planes(size_t n)
{
    float *p = rl_calloc(n, sizeof *p);
    assert_non_null(p);
    return p;
}

back_scene back_scene_make(int x, int y, int width, int height, float focal)
{
    back_scene s = {.materials = back_materials};
    cl_frame(&s.frame, x, y, width, height, focal);
    s.n = (size_t)s.frame.columns * (size_t)s.frame.rows;
    s.back = planes(3 * s.n);
    s.lit = planes(3 * s.n);
    s.albedo = planes(3 * s.n);
    s.normal = planes(3 * s.n);
    s.back_normal = planes(3 * s.n);
    s.through = planes(3 * s.n);
    s.out = planes(3 * s.n);
    s.depth = planes(s.n);
    s.back_depth = planes(s.n);
    s.stencil = (uint32_t *)planes(s.n);
    for (size_t i = 0; i < 3 * s.n; i++)
        s.albedo[i] = 1;
    return s;
}

void back_scene_free(back_scene *s)
{
    float *all[] = {s->back, s->lit,   s->albedo,     s->normal,      s->through,
                    s->out,  s->depth, s->back_depth, s->back_normal, (float *)s->stencil};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        rl_free(all[i]);
}

static float uniform(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

void back_scene_random(back_scene *s, uint32_t seed)
{
    float centre[12][2];
    for (int k = 0; k < 12; k++) {
        centre[k][0] = uniform(&seed) * (float)s->frame.columns;
        centre[k][1] = uniform(&seed) * (float)s->frame.rows;
    }
    BACK_EACH_PIXEL(s, x, y, i)
    {
        int nearest = 0;
        for (int k = 1; k < 12; k++)
            if (hypotf((float)x - centre[k][0], (float)y - centre[k][1]) <
                hypotf((float)x - centre[nearest][0], (float)y - centre[nearest][1]))
                nearest = k;
        int id = uniform(&seed) < 0.02f ? (int)(uniform(&seed) * 6) : nearest % 6;
        float step = nearest >= 9 ? 0.3f : nearest >= 6 ? 0.02f : 0;
        float bump = 0.004f * sinf(0.13f * (float)x) * cosf(0.21f * (float)y);
        float thick =
            0.0005f + 0.01f * (1 + sinf(0.07f * (float)x + (float)nearest)) + 0.001f * uniform(&seed);
        float n[3] = {uniform(&seed) - 0.5f, uniform(&seed) - 0.5f, 0.1f + uniform(&seed)};
        float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        s->stencil[i] = (uint32_t)id;
        s->depth[i] = id ? 0.5f + step + bump : 0;
        s->back_depth[i] = id && uniform(&seed) > 0.05f ? s->depth[i] + thick : 0;
        for (size_t c = 0; c < 3; c++) {
            s->back[c * s->n + i] = id ? 4 * uniform(&seed) : 0;
            s->lit[c * s->n + i] = id ? uniform(&seed) : 0;
            s->albedo[c * s->n + i] = uniform(&seed);
            s->normal[c * s->n + i] = n[c] / length;
            s->back_normal[c * s->n + i] = -n[(c + 1) % 3] / length;
        }
    }
}

void back_scene_run(back_scene *s, back_params p)
{
    const cl_image images[] = {
        {"back", s->back, NULL},
        {"lit", s->lit, NULL},
        {"albedo", s->albedo, NULL},
        {"normal", s->normal, NULL},
        {"depth", s->depth, NULL},
        {"back_depth", s->back_depth, NULL},
        {"back_normal", s->back_normal, NULL},
        {"stencil", s->stencil, NULL},
        {"through", NULL, s->through},
        {"lit", NULL, s->out},
    };
    cl_job job = {.pass = &rl_pass_translucency,
                  .frame = &s->frame,
                  .params = &p,
                  .materials = s->materials,
                  .materials_bytes = BACK_MATERIALS * sizeof *s->materials,
                  .images = images,
                  .n_images = sizeof images / sizeof *images,
                  .width = back_width};
    assert_true(cl_run(back_session, &job));
}

void back_ray(const back_scene *s, double x, double y, double ray[3])
{
    const frame_t *f = &s->frame;
    const camera_t *c = &f->camera;
    ray[0] = (x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0];
    ray[1] = -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1];
    ray[2] = -1;
}

int back_open(void **state)
{
    (void)state;
    back_session = cl_open(0);
    return back_session ? 0 : -1;
}

int back_close(void **state)
{
    (void)state;
    cl_close(&back_session);
    return 0;
}
