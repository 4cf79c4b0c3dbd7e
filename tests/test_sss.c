/* sss_burley and sss_reference: kernels against plain C, and what the filters promise. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/cl_pass.h"
#include "tests/sss_twin.h"

extern const rl_pass rl_pass_sss_burley, rl_pass_sss_reference;

/* The structs of the passes' parameters, in the order of their rows. */
typedef struct burley_params {
    int32_t taps, orientation, weighting, rotation, seed;
} burley_params;
typedef struct reference_params {
    int32_t orientation, weighting;
} reference_params;
enum { SCREEN = 0, TANGENT = 1 };
enum { AREA = 0, PLAIN = 1, AUTO = -1 };

static cl_session *session;
static int vector_width; /* of the vectors; 0 = as always */

/* ---- scenes ---- */

typedef struct scene {
    twin_scene twin;
    float *diffuse, *lit, *albedo, *normal, *depth, *color, *filtered;
    uint32_t *stencil;
    size_t n; /* pixels of a plane */
} scene;

static twin_material materials[6] = {
    {0, {0, 0, 0},          0, 0, 0, 0},
    {1, {3.0f, 1.2f, 0.7f}, 0, 0, 0, 0},
    {1, {6, 5, 3},          1, 1, 1, 0},
    {0, {0, 0, 0},          0, 0, 0, 0},
    {1, {2, 4, 8.5f},       1, 0, 0, 1},
    {1, {1, 1, 1},          0, 1, 0, 0},
};

static float *new_planes(size_t n)
{
    float *p = rl_calloc(n, sizeof *p);
    assert_non_null(p);
    return p;
}

static scene scene_make(int x, int y, int width, int height, float focal)
{
    scene s = {0};
    cl_frame(&s.twin.frame, x, y, width, height, focal);
    s.n = (size_t)s.twin.frame.columns * (size_t)s.twin.frame.rows;
    s.diffuse = new_planes(3 * s.n);
    s.lit = new_planes(3 * s.n);
    s.albedo = new_planes(3 * s.n);
    s.normal = new_planes(3 * s.n);
    s.color = new_planes(3 * s.n);
    s.filtered = new_planes(3 * s.n);
    s.depth = new_planes(s.n);
    s.stencil = (uint32_t *)new_planes(s.n);
    s.twin.materials = materials;
    s.twin.diffuse = s.diffuse;
    s.twin.lit = s.lit;
    s.twin.albedo = s.albedo;
    s.twin.normal = s.normal;
    s.twin.depth = s.depth;
    s.twin.stencil = s.stencil;
    return s;
}

static void scene_free(scene *s)
{
    float *all[] = {s->diffuse, s->lit,   s->albedo,   s->normal,
                    s->depth,   s->color, s->filtered, (float *)s->stencil};
    for (size_t i = 0; i < 8; i++)
        rl_free(all[i]);
}

static float next_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* Calls `set` for every pixel inside. */
#define EACH_PIXEL(s, x, y, i)                                                                               \
    for (int y = (s)->twin.frame.valid[1]; y < (s)->twin.frame.valid[3]; y++)                                \
        for (int x = (s)->twin.frame.valid[0]; x < (s)->twin.frame.valid[2]; x++)                            \
            for (size_t i = (size_t)y * (size_t)(s)->twin.frame.columns + (size_t)x, once_ = 1; once_;       \
                 once_ = 0)

/* Blobs of all materials and of nothing, a bumpy surface with jumps in depth, random light. */
static void scene_random(scene *s, uint32_t seed)
{
    float centre[12][2];
    for (int k = 0; k < 12; k++) {
        centre[k][0] = next_random(&seed) * (float)s->twin.frame.columns;
        centre[k][1] = next_random(&seed) * (float)s->twin.frame.rows;
    }
    EACH_PIXEL(s, x, y, i)
    {
        int nearest = 0;
        for (int k = 1; k < 12; k++)
            if (hypotf((float)x - centre[k][0], (float)y - centre[k][1]) <
                hypotf((float)x - centre[nearest][0], (float)y - centre[nearest][1]))
                nearest = k;
        int id = nearest % 6;
        if (next_random(&seed) < 0.02f)
            id = (int)(next_random(&seed) * 6);
        float jump = nearest >= 9 ? 0.5f : nearest >= 6 ? 0.1f : 0.0f;
        float bump = 0.01f * sinf(0.13f * (float)x) * cosf(0.21f * (float)y) + 0.002f * next_random(&seed);
        s->stencil[i] = (uint32_t)id;
        s->depth[i] = id ? 0.7f + jump + bump : 0;
        float n[3] = {next_random(&seed) - 0.5f, next_random(&seed) - 0.5f, 0.1f + next_random(&seed)};
        float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (size_t c = 0; c < 3; c++) {
            s->diffuse[c * s->n + i] = materials[id].has_profile ? 4 * next_random(&seed) : 0;
            s->lit[c * s->n + i] = id ? next_random(&seed) : 0;
            s->albedo[c * s->n + i] = next_random(&seed);
            s->normal[c * s->n + i] = n[c] / length;
        }
    }
}

/* A plane parallel to the screen, one material, `light` everywhere. */
static void scene_flat(scene *s, uint32_t id, float depth, float light)
{
    EACH_PIXEL(s, x, y, i)
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

static void run(scene *s, const rl_pass *pass, const void *params, cl_session *on)
{
    const cl_image images[] = {
        {"diffuse",  s->diffuse, NULL       },
        {"lit",      s->lit,     NULL       },
        {"albedo",   s->albedo,  NULL       },
        {"normal",   s->normal,  NULL       },
        {"depth",    s->depth,   NULL       },
        {"stencil",  s->stencil, NULL       },
        {"color",    NULL,       s->color   },
        {"filtered", NULL,       s->filtered},
    };
    cl_job job = {.pass = pass,
                  .frame = &s->twin.frame,
                  .params = params,
                  .materials = materials,
                  .materials_bytes = sizeof materials,
                  .images = images,
                  .n_images = 8,
                  .width = vector_width};
    assert_true(cl_run(on, &job));
}

static void run_burley(scene *s, int taps, int weighting)
{
    const burley_params p = {taps, s->twin.tangent, weighting, 1, 7};
    run(s, &rl_pass_sss_burley, &p, session);
}

static void run_reference(scene *s, int weighting)
{
    const reference_params p = {s->twin.tangent, weighting};
    run(s, &rl_pass_sss_reference, &p, session);
}

/* The worst difference of the image to the twin's, a pixel in `step`; relative to 1 + the value. taps 0: the
 * dense sum. */
static double worst_difference(scene *s, int taps, int weighting, int step)
{
    double worst = 0;
    int count = 0;
    s->twin.area = weighting == AREA;
    EACH_PIXEL(s, x, y, i)
    {
        double filtered[3] = {0}, color[3];
        if (count++ % step)
            continue;
        if (materials[s->stencil[i]].has_profile) {
            if (taps)
                twin_burley(&s->twin, x, y, taps, true, 7, filtered);
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

/* ---- tests ---- */

/* Windows that start anywhere and have odd sizes; filters from a few pixels to beyond the image. */
static const struct {
    int x, y, width, height;
    float focal;
} windows[] = {
    {37,  11, 150, 61, 300},
    {-70, -5, 67,  33, 900},
    {0,   0,  64,  4,  100},
    {5,   2,  1,   1,  500},
    {63,  3,  3,   45, 250}
};

static void burley_equals_twin(void **state)
{
    (void)state;
    for (int variant = 0; variant < 4; variant++)
        for (size_t k = 0; k < sizeof windows / sizeof *windows; k++) {
            static const int taps[] = {1, 21, 55, 130};
            scene s =
                scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height, windows[k].focal);
            s.twin.frame.camera.focal[1] *= 1.3f;
            s.twin.frame.camera.jitter[0] = 0.3f;
            int weighting = variant & 1;
            s.twin.tangent = variant >> 1;
            scene_random(&s, (uint32_t)k + 1);
            for (size_t t = 0; t < 4; t++) {
                run_burley(&s, taps[t], weighting);
                double worst = worst_difference(&s, taps[t], weighting, 1);
                if (worst > 5e-5)
                    print_message("window %zu, %d taps, variant %d: %.2e\n", k, taps[t], variant, worst);
                assert_true(worst <= 5e-5);
            }
            scene_free(&s);
        }
}

static void burley_equals_twin_4096(void **state)
{
    (void)state;
    scene s = scene_make(37, 11, 150, 61, 600);
    scene_random(&s, 9);
    run_burley(&s, 4096, PLAIN);
    assert_true(worst_difference(&s, 4096, PLAIN, 23) <= 1e-4);
    scene_free(&s);
}

static void reference_equals_twin(void **state)
{
    (void)state;
    for (int variant = 0; variant < 4; variant++)
        for (size_t k = 0; k < sizeof windows / sizeof *windows; k++) {
            scene s =
                scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height, windows[k].focal);
            s.twin.frame.camera.focal[1] *= 1.3f;
            int weighting = variant & 1;
            s.twin.tangent = variant >> 1;
            scene_random(&s, (uint32_t)k + 31);
            run_reference(&s, weighting);
            double worst = worst_difference(&s, 0, weighting, 5);
            if (worst > 2e-5)
                print_message("reference, window %zu, variant %d: %.2e\n", k, variant, worst);
            assert_true(worst <= 1e-4);
            scene_free(&s);
        }
}

/* From pixels much larger than d to much smaller: the numerical integral near the centre holds. */
static void reference_equals_twin_at_any_size(void **state)
{
    (void)state;
    for (float focal = 1; focal < 2000; focal *= 4) {
        scene s = scene_make(0, 0, 40, 24, focal);
        scene_random(&s, 77);
        run_reference(&s, PLAIN);
        assert_true(worst_difference(&s, 0, PLAIN, 3) <= 1e-4);
        scene_free(&s);
    }
}

static double median_of(double *v, size_t n, double share)
{
    for (size_t i = 1; i < n; i++) /* few hundred values */
        for (size_t j = i; j > 0 && v[j - 1] > v[j]; j--) {
            double t = v[j];
            v[j] = v[j - 1];
            v[j - 1] = t;
        }
    return v[(size_t)(share * (double)(n - 1))];
}

/* With many taps the estimate tends to the dense sum. Smooth light with an edge, on a wavy surface. */
static void burley_tends_to_reference(void **state)
{
    (void)state;
    for (int variant = 0; variant < 4; variant++) {
        scene s = scene_make(10, 6, 128, 72, 500);
        int weighting = variant & 1;
        s.twin.tangent = variant >> 1;
        double differences[3 * 18 * 10];
        size_t n = 0;
        scene_flat(&s, 1, 0.7f, 1);
        EACH_PIXEL(&s, x, y, i)
        {
            s.depth[i] += 0.01f * sinf(0.1f * (float)x) * cosf(0.13f * (float)y);
            for (size_t c = 0; c < 3; c++)
                s.diffuse[c * s.n + i] = (x > 60 ? 1.0f : 0.2f) + 0.2f * sinf(0.2f * (float)y);
        }
        run_reference(&s, weighting);
        float *reference = new_planes(3 * s.n);
        memcpy(reference, s.color, 3 * s.n * sizeof *reference);
        run_burley(&s, 1024, weighting);
        EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3 && x % 7 == 0 && y % 7 == 0 && n < 540; c++)
                differences[n++] =
                    fabs(s.color[c * s.n + i] - reference[c * s.n + i]) / reference[c * s.n + i];
        }
        assert_true(n > 500);
        assert_true(median_of(differences, n, 0.5) <= 0.003);
        assert_true(median_of(differences, n, 0.95) <= 0.015);
        rl_free(reference);
        scene_free(&s);
    }
}

/* Flat and evenly lit: the filter changes nothing, and the way out is that of the unfiltered surface. Black
 * borders (occlude) take from what is near the edge, so there it is looked at in the middle. */
static void energy_is_kept(void **state)
{
    (void)state;
    static const int taps[] = {0, AUTO, 1, 21, 55, 4096};
    for (uint32_t id = 1; id < 6; id++)
        for (size_t t = 0; t < 6; t++) {
            scene s = scene_make(3, 1, 180, 110, 60);
            if (!materials[id].has_profile)
                goto next;
            scene_flat(&s, id, 0.3f, 0.7f);
            if (taps[t])
                run_burley(&s, taps[t], t & 1 ? AREA : PLAIN);
            else
                run_reference(&s, PLAIN);
            EACH_PIXEL(&s, x, y, i)
            {
                double unfiltered[3] = {0.7f, 0.7f, 0.7f}, color[3];
                int edge = x < 60 || y < 40 || x > 120 || y > 70;
                if (materials[id].border == 1 && edge)
                    continue;
                twin_resolve(&s.twin, x, y, unfiltered, color);
                for (size_t c = 0; c < 3; c++)
                    assert_true(fabs(s.color[c * s.n + i] - color[c]) <= 1e-4 * color[c]);
            }
        next:
            scene_free(&s);
        }
}

/* An occluding border darkens, half of the light at a straight edge. */
static void occlusion_is_black(void **state)
{
    (void)state;
    scene s = scene_make(0, 0, 192, 128, 300);
    scene_flat(&s, 5, 0.3f, 1);
    EACH_PIXEL(&s, x, y, i)
    {
        s.stencil[i] = x < 96 ? 5 : 3;
    }
    run_reference(&s, PLAIN);
    size_t edge = 64 * (size_t)s.twin.frame.columns + 95;
    float at_edge = s.filtered[edge], inside = s.filtered[edge - 60];
    assert_true(at_edge > 0.5f && at_edge < 0.75f);
    assert_true(inside > 0.995f);
    run_burley(&s, 1024, PLAIN);
    assert_true(fabsf(s.filtered[edge] - at_edge) < 0.01f);
    scene_free(&s);
}

/* Every material keeps its own light, whatever lies beside it: noisy borders, jumps in depth, nothing at all.
 */
static void materials_never_leak(void **state)
{
    (void)state;
    scene s = scene_make(37, 11, 150, 61, 400);
    scene_random(&s, 5);
    int32_t border[6];
    for (int id = 0; id < 6; id++) {
        border[id] = materials[id].border;
        materials[id].border = 0;
    }
    static const float light[6] = {1e30f, 1, 1000, 1e30f, 1e-3f, 7};
    EACH_PIXEL(&s, x, y, i)
    {
        for (size_t c = 0; c < 3; c++)
            s.diffuse[c * s.n + i] = light[s.stencil[i]];
    }
    for (int pass = 0; pass < 3; pass++) {
        if (pass == 0)
            run_reference(&s, AREA);
        else
            run_burley(&s, pass == 1 ? 21 : 200, PLAIN);
        EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3 && materials[s.stencil[i]].has_profile; c++)
                assert_true(fabsf(s.filtered[c * s.n + i] / light[s.stencil[i]] - 1) < 1e-5f);
        }
    }
    for (int id = 0; id < 6; id++)
        materials[id].border = border[id];
    scene_free(&s);
}

static void nothing_to_scatter(void **state)
{
    (void)state;
    scene s = scene_make(2, 2, 100, 30, 300);
    scene_flat(&s, 3, 0.5f, 0);
    EACH_PIXEL(&s, x, y, i)
    {
        if (x < 50)
            s.stencil[i] = 0;
        s.lit[i] = (float)i;
    }
    run_burley(&s, AUTO, AREA);
    assert_memory_equal(s.color, s.lit, 3 * s.n * sizeof *s.lit);
    memset(s.color, 0, 3 * s.n * sizeof *s.color);
    run_reference(&s, AREA);
    assert_memory_equal(s.color, s.lit, 3 * s.n * sizeof *s.lit);
    scene_free(&s);
}

/* `auto` at radius rho pixels must be the blend of the forced patterns that DESIGN states. */
static void detail_blends(void **state)
{
    (void)state;
    static const struct {
        float rho, some, many;
    } at[] = {
        {0.3f,   0,     0    },
        {0.45f,  0,     0    },
        {0.475f, 0.25f, 0    },
        {0.5f,   0.5f,  0    },
        {0.55f,  1,     0    },
        {1.2f,   1,     0    },
        {1.8f,   1,     0    },
        {2.0f,   1,     0.5f },
        {2.1f,   1,     0.75f},
        {2.2f,   1,     1    },
        {40,     1,     1    }
    };
    for (size_t k = 0; k < sizeof at / sizeof *at; k++) {
        scene s = scene_make(0, 0, 70, 40, 100);
        scene_flat(&s, 1, 16.5644f * 0.003f * 100 / at[k].rho, 1);
        uint32_t seed = 3;
        for (size_t i = 0; i < 3 * s.n; i++)
            s.diffuse[i] = next_random(&seed);
        float *few = new_planes(3 * s.n), *many = new_planes(3 * s.n);
        run_burley(&s, 21, PLAIN);
        memcpy(few, s.filtered, 3 * s.n * sizeof *few);
        run_burley(&s, 55, PLAIN);
        memcpy(many, s.filtered, 3 * s.n * sizeof *many);
        run_burley(&s, AUTO, PLAIN);
        EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3; c++) {
                size_t j = c * s.n + i;
                float want = few[j] + at[k].many * (many[j] - few[j]);
                want = s.diffuse[j] + at[k].some * (want - s.diffuse[j]);
                assert_true(fabsf(s.filtered[j] - want) < 1e-4f);
            }
        }
        rl_free(few);
        rl_free(many);
        scene_free(&s);
    }
}

/* The same bits from one thread, from all, and again; other seeds and frames turn the pattern. */
static void bits_do_not_depend_on_threads(void **state)
{
    (void)state;
    cl_session *one = cl_open(1);
    assert_non_null(one);
    scene s = scene_make(37, 11, 300, 161, 400);
    scene_random(&s, 5);
    size_t bytes = 3 * s.n * sizeof(float);
    float *first = new_planes(3 * s.n);
    burley_params p = {AUTO, TANGENT, AREA, 1, 0};
    run(&s, &rl_pass_sss_burley, &p, session);
    memcpy(first, s.color, bytes);
    run(&s, &rl_pass_sss_burley, &p, one);
    assert_memory_equal(first, s.color, bytes);
    run(&s, &rl_pass_sss_burley, &p, session);
    assert_memory_equal(first, s.color, bytes);
    p.seed = 1;
    run(&s, &rl_pass_sss_burley, &p, session);
    assert_memory_not_equal(first, s.color, bytes);
    p.seed = 0;
    s.twin.frame.number++;
    run(&s, &rl_pass_sss_burley, &p, session);
    assert_memory_not_equal(first, s.color, bytes);
    p.rotation = 0;
    run(&s, &rl_pass_sss_burley, &p, session);
    memcpy(first, s.color, bytes);
    s.twin.frame.number++;
    run(&s, &rl_pass_sss_burley, &p, session);
    assert_memory_equal(first, s.color, bytes);
    const reference_params r = {SCREEN, PLAIN};
    run(&s, &rl_pass_sss_reference, &r, session);
    memcpy(first, s.color, bytes);
    run(&s, &rl_pass_sss_reference, &r, one);
    assert_memory_equal(first, s.color, bytes);
    rl_free(first);
    scene_free(&s);
    cl_close(&one);
}

/* A pixel's bits depend on what is around it, not on where the data window starts: the same picture, cropped
 * by rows and columns that nothing within reach comes from. */
static void crop_gives_the_same_bits(void **state)
{
    (void)state;
    scene whole = scene_make(0, 0, 320, 96, 60), part = scene_make(64, 8, 192, 72, 60);
    scene_random(&whole, 12);
    memcpy(part.twin.frame.camera.centre, whole.twin.frame.camera.centre, sizeof(float[2]));
    for (int y = 8; y < 80; y++)
        for (int x = 64; x < 256; x++) {
            size_t from = (size_t)(y * whole.twin.frame.columns + x);
            size_t to = (size_t)((y - 8) * part.twin.frame.columns + x - 64);
            part.stencil[to] = whole.stencil[from];
            part.depth[to] = whole.depth[from];
            for (size_t c = 0; c < 3; c++) {
                part.diffuse[c * part.n + to] = whole.diffuse[c * whole.n + from];
                part.lit[c * part.n + to] = whole.lit[c * whole.n + from];
                part.albedo[c * part.n + to] = whole.albedo[c * whole.n + from];
                part.normal[c * part.n + to] = whole.normal[c * whole.n + from];
            }
        }
    run_burley(&whole, 55, AREA);
    run_burley(&part, 55, AREA);
    for (int y = 24; y < 64; y++)
        for (int x = 128; x < 192; x++)
            for (size_t c = 0; c < 3; c++) {
                size_t from = c * whole.n + (size_t)(y * whole.twin.frame.columns + x);
                size_t to = c * part.n + (size_t)((y - 8) * part.twin.frame.columns + x - 64);
                assert_memory_equal(&whole.color[from], &part.color[to], sizeof(float));
            }
    scene_free(&whole);
    scene_free(&part);
}

/* Narrower vectors, for devices that want them. Of a flat surface: groups of lanes are others there. */
static void width_does_not_matter(void **state)
{
    (void)state;
    scene s = scene_make(37, 11, 150, 61, 400);
    scene_flat(&s, 1, 0.4f, 1);
    uint32_t seed = 4;
    for (size_t i = 0; i < 3 * s.n; i++)
        s.diffuse[i] = next_random(&seed);
    float *want = new_planes(6 * s.n);
    for (vector_width = 16; vector_width >= 4; vector_width /= 2) {
        run_burley(&s, 21, AREA);
        for (size_t i = 0; i < 3 * s.n; i++)
            assert_true(vector_width == 16 || fabsf(s.color[i] - want[i]) < 1e-5f);
        memcpy(want, s.color, 3 * s.n * sizeof *want);
        run_reference(&s, AREA);
        for (size_t i = 0; i < 3 * s.n; i++)
            assert_true(vector_width == 16 || fabsf(s.color[i] - want[3 * s.n + i]) < 1e-5f);
        memcpy(want + 3 * s.n, s.color, 3 * s.n * sizeof *want);
    }
    vector_width = 0;
    rl_free(want);
    scene_free(&s);
}

/* Patterns for a number of taps and for `auto`; memory that runs out is an error, not a crash. */
static void tables_are_made(void **state)
{
    (void)state;
    rl_arena arena = {0};
    rl_tables tables;
    rl_error err = {0};
    burley_params p = {.taps = 100};
    rl_pass_input in = {.params = &p};
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_OK);
    assert_int_equal(tables.n, 512 + 3 * 128);
    assert_true(fabsf(hypotf(tables.data[100], tables.data[101]) - 1) < 1e-6f);
    p.taps = AUTO;
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_OK);
    assert_int_equal(tables.n, 512 + 3 * 64 + 3 * 64);
    rl_arena_free(&arena);
    rl_alloc_fail_at(1, 1);
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_E_MEMORY);
    rl_alloc_fail_at(0, 0);
    assert_int_equal(err.code, RL_E_MEMORY);
    rl_arena_free(&arena);
}

static int open_session(void **state)
{
    (void)state;
    session = cl_open(0);
    return session ? 0 : -1;
}

static int close_session(void **state)
{
    (void)state;
    cl_close(&session);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(burley_equals_twin),
        cmocka_unit_test(burley_equals_twin_4096),
        cmocka_unit_test(reference_equals_twin),
        cmocka_unit_test(reference_equals_twin_at_any_size),
        cmocka_unit_test(burley_tends_to_reference),
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(occlusion_is_black),
        cmocka_unit_test(materials_never_leak),
        cmocka_unit_test(nothing_to_scatter),
        cmocka_unit_test(detail_blends),
        cmocka_unit_test(bits_do_not_depend_on_threads),
        cmocka_unit_test(crop_gives_the_same_bits),
        cmocka_unit_test(width_does_not_matter),
        cmocka_unit_test(tables_are_made),
    };
    return cmocka_run_group_tests(tests, open_session, close_session);
}
