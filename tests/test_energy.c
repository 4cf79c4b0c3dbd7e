/* The ledger of energy of the scattering filters, against sums in double: every pixel with every other one.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/energy.h"
#include "passes/burley.h"
#include "tests/gaussian_run.h"
#include "tests/sss_scene.h"

#define FOCAL 700.0f
#define DEPTH 0.7f /* a pixel is a millimetre */

/* ---- scenes ----------------------------------------------------------------------------------------------
 */

enum { RENORMALIZE = 0, OCCLUDE = 1 };

/* Materials 1 and 2 scatter over 5 to 17 and 8 to 33 pixels; nothing depends on the angle of view. */
static void set_materials(int border)
{
    sss_materials[1] = (twin_material){1, {1.0f, 0.6f, 0.3f}, 0, border, {0}, 1, 0};
    sss_materials[2] = (twin_material){1, {2.0f, 1.5f, 0.5f}, 1, border, {0}, 1, 0};
}

/* A plane with a disk of material 2, and a stripe of nothing; random light, one albedo a material. */
static sss_scene make_scene(int width, int height, int border)
{
    sss_scene s = sss_scene_make(37, 22, width, height, FOCAL);
    uint32_t seed = 5;
    set_materials(border);
    sss_scene_flat(&s, 1, DEPTH, 1);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        int u = x - s.twin.frame.valid[0], v = y - s.twin.frame.valid[1];
        if (hypot(u - 60, v - 30) < 21)
            s.stencil[i] = 2;
        if (u > 88 && u < 92)
            s.stencil[i] = 0;
        for (size_t c = 0; c < 3; c++) {
            s.diffuse[c * s.n + i] = s.stencil[i] ? 2 * sss_random(&seed) : 0;
            s.albedo[c * s.n + i] = s.stencil[i] == 2 ? 0.49f : 0.6f - 0.1f * (float)c;
        }
    }
    return s;
}

static void want_ledger(sss_scene *s)
{
    s->twin.frame.materials = SSS_MATERIALS;
    s->energy = rl_malloc(RL_SUM_FLOATS * sizeof *s->energy);
    assert_non_null(s->energy);
    memset(s->energy, 0xff, RL_SUM_FLOATS * sizeof *s->energy); /* NaN */
}

/* ---- the same in double ----------------------------------------------------------------------------------
 */

/* Weight of the pixel (dx, dy) away, millimetres: R integrated over its square. */
static double square_weight(int dx, int dy, double d)
{
    enum { CUTS = 48 };
    double sum = 0;
    if (!dx && !dy)
        return rl_burley_cdf(sqrt(1 / 3.14159265358979323846), d);
    if (dx < -2 || dx > 2 || dy < -2 || dy > 2)
        return rl_burley_profile(hypot(dx, dy), d);
    for (int j = 0; j < CUTS; j++)
        for (int i = 0; i < CUTS; i++)
            sum += rl_burley_profile(hypot(dx + (i + 0.5) / CUTS - 0.5, dy + (j + 0.5) / CUTS - 0.5), d);
    return sum / (CUTS * CUTS);
}

/* A filter as offsets and weights, the same for all pixels of a material. */
typedef struct stencil_weights {
    int n, dx[8192], dy[8192];
    double w[3][8192];
    double share[3]; /* of the result; the rest is the pixel's own light */
} stencil_weights;

static void dense_weights(const twin_material *m, stencil_weights *out)
{
    const float *d = m->scatter_distance_mm;
    double reach = RL_BURLEY_RADIUS * (double)fmaxf(d[0], fmaxf(d[1], d[2]));
    out->n = 0;
    out->share[0] = out->share[1] = out->share[2] = 1;
    for (int dy = -40; dy <= 40; dy++)
        for (int dx = -40; dx <= 40; dx++) {
            if (hypot(dx, dy) > reach)
                continue;
            out->dx[out->n] = dx;
            out->dy[out->n] = dy;
            for (int c = 0; c < 3; c++)
                out->w[c][out->n] = square_weight(dx, dy, d[c]);
            out->n++;
        }
}

/* rotation: none, so that each pixel has the same taps: the middle one of fifteen patterns. */
static void tap_weights(const twin_material *m, int n, stencil_weights *out)
{
    enum { PATTERNS = 15 };
    const float *d = m->scatter_distance_mm;
    double most = fmaxf(d[0], fmaxf(d[1], d[2])), sum[3], mean[3] = {0};
    const double proportions[3] = {d[0] / most, d[1] / most, d[2] / most};
    float x[256], y[256], w[256];
    for (int p = 0; p < PATTERNS; p++) {
        rl_burley_mixture_taps((size_t)n, (p + 0.5) / PATTERNS, proportions, x, y, w, sum);
        for (int c = 0; c < 3; c++)
            mean[c] += sum[c] / PATTERNS;
    }
    rl_burley_mixture_taps((size_t)n, 0.5, proportions, x, y, w, sum);
    out->n = n;
    for (int c = 0; c < 3; c++)
        out->share[c] = sum[c] / mean[c];
    for (int i = 0; i < n; i++) {
        out->dx[i] = (int)nearbyint((double)x[i] * most);
        out->dy[i] = (int)nearbyint((double)y[i] * most);
        for (int c = 0; c < 3; c++)
            out->w[c][i] =
                rl_burley_profile(hypot((double)x[i], (double)y[i]), proportions[c]) * proportions[c] * w[i];
    }
}

static double exit_of(const sss_scene *s, size_t i, size_t c)
{
    double a = s->albedo[c * s->n + i];
    return sss_materials[s->stencil[i]].texturing ? sqrt(a) : a;
}

/* One pixel's part. */
static void account(const sss_scene *s, const stencil_weights *f, int x, int y, size_t i, rl_energy *sum)
{
    const int *v = s->twin.frame.valid;
    uint32_t id = s->stencil[i];
    for (size_t c = 0; c < 3; c++) {
        double same = 0, border = 0, outside = 0, light = 0, e = exit_of(s, i, c);
        for (int k = 0; k < f->n; k++) {
            int px = x + f->dx[k], py = y + f->dy[k];
            size_t at = (size_t)py * (size_t)s->twin.frame.columns + (size_t)px;
            if (px < v[0] || py < v[1] || px >= v[2] || py >= v[3]) {
                outside += f->w[c][k];
            } else if (s->stencil[at] != id) {
                border += f->w[c][k];
            } else {
                same += f->w[c][k];
                light += f->w[c][k] * s->diffuse[c * s->n + at];
            }
        }
        double all = same + border + outside, own = s->diffuse[c * s->n + i];
        double share = f->share[c], seen = light / (sss_materials[id].border == OCCLUDE ? all : same);
        double given = own + share * (seen - own);
        sum->in[c] += e * own;
        sum->out[c] += e * fmax(given, 0);
        sum->border[c] += e * share * own * border / all;
        sum->off_screen[c] += e * share * own * outside / all;
        sum->clamped[c] += e * fmin(given, 0);
        sum->redistributed[c] += e * share * (seen - light / all);
    }
    sum->pixels++;
}

static void brute_force(const sss_scene *s, int taps, rl_energy sums[3])
{
    stencil_weights *f = rl_malloc(sizeof *f);
    assert_non_null(f);
    for (uint32_t id = 1; id <= 2; id++) {
        sums[id] = (rl_energy){0};
        if (taps)
            tap_weights(&sss_materials[id], taps, f);
        else
            dense_weights(&sss_materials[id], f);
        SSS_EACH_PIXEL(s, x, y, i)
        {
            if (s->stencil[i] == id)
                account(s, f, x, y, i, &sums[id]);
        }
    }
    rl_free(f);
}

/* Worst difference of the values, relative to what goes in. */
static double differs(const rl_energy *a, const rl_energy *b)
{
    double x[19], y[19], most = 0;
    memcpy(x, a, sizeof x);
    memcpy(y, b, sizeof y);
    assert_int_equal((int)a->pixels, (int)b->pixels);
    for (int i = 0; i < 18; i++) {
        assert_true(isfinite(x[i]));
        most = fmax(most, fabs(x[i] - y[i]) / y[i % 3]);
    }
    return most;
}

/* ---- tests -----------------------------------------------------------------------------------------------
 */

static void check_against_sums(int taps, int border, double tolerance, double closes)
{
    sss_scene s = make_scene(100, 64, border);
    rl_energy expected[3], got;
    want_ledger(&s);
    s.twin.rotation = TWIN_STILL;
    if (taps)
        sss_run_burley(&s, taps, PLAIN);
    else
        sss_run_reference(&s, PLAIN);
    brute_force(&s, taps, expected);
    for (size_t id = 1; id <= 2; id++) {
        rl_energy_read(s.energy, id, &got);
        assert_true(differs(&got, &expected[id]) < tolerance);
        assert_true(rl_energy_open(&got) < closes);
        assert_true(got.border[0] > 0.01 * got.in[0]);
    }
    sss_scene_free(&s);
}

static void test_dense_sum(void **state)
{
    (void)state;
    check_against_sums(0, RENORMALIZE, 3e-5, 1e-4);
    check_against_sums(0, OCCLUDE, 3e-5, 1e-4);
}

static void test_taps(void **state)
{
    (void)state;
    check_against_sums(55, RENORMALIZE, 1e-5, 0.05);
    check_against_sums(21, OCCLUDE, 1e-5, 0.05);
}

/* Light in the middle alone, out of reach of borders and edges: nothing is lost, and what goes in comes out.
 */
static void test_closed_scene(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(5, 9, 160, 150, FOCAL);
    uint32_t seed = 9;
    rl_energy e;
    set_materials(RENORMALIZE);
    sss_scene_flat(&s, 1, DEPTH, 0);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        for (size_t c = 0; c < 3; c++) {
            s.albedo[c * s.n + i] = 0.7f;
            if (hypot(x - 80, y - 80) < 35)
                s.diffuse[c * s.n + i] = 3 * sss_random(&seed);
        }
        if (x - s.twin.frame.valid[0] < 3)
            s.stencil[i] = 0;
    }
    want_ledger(&s);
    sss_run_reference(&s, PLAIN);
    rl_energy_read(s.energy, 1, &e);
    for (int c = 0; c < 3; c++) {
        assert_true(e.in[c] > 100 && e.clamped[c] == 0);
        assert_true(e.border[c] == 0 && e.off_screen[c] == 0 && e.redistributed[c] < 1e-6 * e.in[c]);
    }
    assert_true(rl_energy_imbalance(&e) < 1e-6);
    sss_scene_free(&s);
}

/* Evenly lit, every filter gives back what it loses, and what it loses is what the weights say. */
static void test_even_light(void **state)
{
    (void)state;
    const gaussian_material *mixtures = gaussian_mixtures;
    for (int filter = 0; filter < 5; filter++) {
        sss_scene s = sss_scene_make(0, 0, 150, 90, 350);
        rl_energy e;
        set_materials(RENORMALIZE);
        sss_scene_flat(&s, 1, DEPTH, 1);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3; c++)
                s.albedo[c * s.n + i] = 1;
            if (y > 60)
                s.stencil[i] = 0;
        }
        want_ledger(&s);
        if (filter == 0)
            sss_run_reference(&s, AREA);
        else if (filter < 3)
            sss_run_burley(&s, filter == 1 ? AUTO : 33, AREA);
        else
            gaussian_run_on(&s, filter == 3 ? SEPARABLE : FULL, mixtures, SSS_MATERIALS * sizeof *mixtures,
                            sss_session);
        rl_energy_read(s.energy, 1, &e);
        for (int c = 0; c < 3; c++)
            assert_true(e.border[c] > 0 && e.off_screen[c] > 0);
        assert_true(rl_energy_imbalance(&e) < 1e-5);
        assert_true(rl_energy_open(&e) < 1e-5);
        sss_scene_free(&s);
    }
}

typedef struct gaussian_loss {
    double border, off_screen, mean;
} gaussian_loss;

/* A Gaussian of 20 mm² at a pixel of material 1, over `rx` by `ry` pixels: what its own light loses, and the
 * mean. */
static gaussian_loss lose(const sss_scene *s, const float *light, int x, int y, int rx, int ry)
{
    const int *v = s->twin.frame.valid;
    double all = 0, same = 0, border = 0, outside = 0, sum = 0;
    size_t own = (size_t)y * (size_t)s->twin.frame.columns + (size_t)x;
    for (int dy = -ry; dy <= ry; dy++)
        for (int dx = -rx; dx <= rx; dx++) {
            double w = exp(-(dx * dx + dy * dy) / 40.0);
            size_t at = (size_t)(y + dy) * (size_t)s->twin.frame.columns + (size_t)(x + dx);
            if (dx * dx + dy * dy > 180) /* 3 sigma */
                continue;
            all += w;
            if (x + dx < v[0] || y + dy < v[1] || x + dx >= v[2] || y + dy >= v[3])
                outside += w;
            else if (s->stencil[at] != 1)
                border += w;
            else {
                same += w;
                sum += w * (double)light[at];
            }
        }
    return (gaussian_loss){(double)light[own] * border / all, (double)light[own] * outside / all, sum / same};
}

/* Gaussians on a plane; separable: the rows' losses, then what the columns lose of what the rows have moved.
 */
static void test_gaussian_sums(void **state)
{
    (void)state;
    const gaussian_material one[2] = {{0}, {1, 1, {20}, {{1, 0.5f, 0.25f}}, 0, 0, 1, 0}};
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(11, 3, 70, 50, FOCAL);
        float *line = sss_planes(s.n);
        uint32_t seed = 3;
        rl_energy e;
        double border = 0, outside = 0, in = 0;
        sss_scene_flat(&s, 1, DEPTH, 1);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            s.stencil[i] = x > 40 && x + y < 100;
            s.diffuse[i] = 2 * sss_random(&seed);
            s.albedo[i] = 1;
        }
        want_ledger(&s);
        gaussian_run_on(&s, separable, one, sizeof one, sss_session);
        for (int step = 0; step < (separable ? 2 : 1); step++)
            SSS_EACH_PIXEL(&s, x, y, i)
            {
                if (!s.stencil[i])
                    continue;
                gaussian_loss l = lose(&s, step ? line : s.diffuse, x, y, separable && step ? 0 : 14,
                                       separable && !step ? 0 : 14);
                border += l.border;
                outside += l.off_screen;
                in += step ? 0 : s.diffuse[i];
                if (!step)
                    line[i] = (float)l.mean;
            }
        rl_energy_read(s.energy, 1, &e);
        assert_true(fabs(e.in[0] - in) < 1e-6 * in && border > 0.03 * in && outside > 0.03 * in);
        assert_true(fabs(e.border[0] - border) < 1e-5 * in && fabs(e.off_screen[0] - outside) < 1e-5 * in);
        assert_true(rl_energy_open(&e) < 1e-5);
        rl_free(line);
        sss_scene_free(&s);
    }
}

/* Too small for a filter: taps: auto loses nothing. */
static void test_no_filter(void **state)
{
    (void)state;
    sss_scene s = make_scene(100, 64, RENORMALIZE);
    rl_energy e;
    s.twin.frame.camera.focal[0] = s.twin.frame.camera.focal[1] = 10;
    want_ledger(&s);
    sss_run_burley(&s, AUTO, PLAIN);
    rl_energy_read(s.energy, 1, &e);
    assert_true(e.in[0] > 0 && rl_energy_imbalance(&e) == 0);
    assert_true(e.border[0] == 0 && e.off_screen[0] == 0 && e.redistributed[0] == 0);
    sss_scene_free(&s);
}

/* The same sums on one thread and on all, and for vectors of 4 and 8 nearly so. */
static void test_threads(void **state)
{
    (void)state;
    sss_scene s = make_scene(100, 64, RENORMALIZE);
    const sss_burley_params p = {AUTO, SCREEN, AREA, TWIN_BLUE, 7};
    cl_session *one = cl_open(1);
    float *first = s.energy;
    rl_energy a, b;
    assert_non_null(one);
    want_ledger(&s);
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    first = s.energy;
    want_ledger(&s);
    sss_run(&s, &rl_pass_sss_burley, &p, one);
    for (size_t m = 1; m < 3; m++) {
        rl_energy_read(first, m, &a);
        rl_energy_read(s.energy, m, &b);
        assert_memory_equal(&a, &b, sizeof a);
    }
    cl_close(&one);
    rl_free(first);
    sss_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense_sum),     cmocka_unit_test(test_taps),
        cmocka_unit_test(test_closed_scene),  cmocka_unit_test(test_even_light),
        cmocka_unit_test(test_gaussian_sums), cmocka_unit_test(test_no_filter),
        cmocka_unit_test(test_threads),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
