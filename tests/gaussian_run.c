/* See gaussian_run.h. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/gaussian_run.h"

const gaussian_material gaussian_mixtures[SSS_MATERIALS] = {
    {0},
    {1,
     3,
     {0.0516f, 0.2719f, 2.0062f},
     {{0.1158f, 0.3661f, 0.3439f}, {0.1836f, 0.1864f, 0}, {0.46f, 0, 0.0402f}},
     0,
     0,
     0,
     0},
    {1,
     4,
     {0.362f, 2.144f, 8.555f, 34.833f},
     {{0.0544f, 0.1245f, 0.2177f},
      {0.2436f, 0.2435f, 0.189f},
      {0.3105f, 0.3158f, 0.3742f},
      {0.3913f, 0.3161f, 0.2189f}},
     1,
     1,
     1,
     0},
    {0},
    {1, 2, {20, 3}, {{0.5f, 0.25f, 0}, {0.5f, 0.5f, 1}}, 1, 0, 0, 1},
    {1, 1, {12}, {{1, 0.5f, 0.25f}}, 0, 1, 0, 0},
};

void gaussian_run_on(sss_scene *s, int separable, const gaussian_material *m, size_t bytes, cl_session *on)
{
    const int32_t params[2] = {separable, s->twin.area ? AREA : PLAIN};
    const cl_image images[] = {
        {"diffuse", s->diffuse, NULL}, {"lit", s->lit, NULL},           {"albedo", s->albedo, NULL},
        {"normal", s->normal, NULL},   {"depth", s->depth, NULL},       {"stencil", s->stencil, NULL},
        {"color", NULL, s->color},     {"filtered", NULL, s->filtered}, {"energy", NULL, s->energy},
    };
    cl_job job = {.pass = &rl_pass_sss_gaussian,
                  .frame = &s->twin.frame,
                  .params = params,
                  .materials = m,
                  .materials_bytes = bytes,
                  .images = images,
                  .n_images = s->energy ? 9 : 8,
                  .width = sss_width};
    assert_true(cl_run(on, &job));
}

void gaussian_run(sss_scene *s, int separable)
{
    gaussian_run_on(s, separable, gaussian_mixtures, sizeof gaussian_mixtures, sss_session);
}

void gaussian_run_one(sss_scene *s, int separable, const gaussian_material *m)
{
    const gaussian_material two[2] = {{0}, *m};
    gaussian_run_on(s, separable, two, sizeof two, sss_session);
}
