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
} stencil_weights;

static void dense_weights(const twin_material *m, stencil_weights *out)
{
    const float *d = m->scatter_distance_mm;
    double reach = RL_BURLEY_RADIUS * (double)fmaxf(d[0], fmaxf(d[1], d[2]));
    out->n = 0;
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

/* rotation: none, so that each pixel has the same taps. */
static void tap_weights(const twin_material *m, int n, stencil_weights *out)
{
    const float *d = m->scatter_distance_mm;
    double most = fmaxf(d[0], fmaxf(d[1], d[2]));
    float x[256], y[256], w[256];
    rl_burley_taps((size_t)n, 0.5, x, y, w);
    out->n = n;
    for (int i = 0; i < n; i++) {
        out->dx[i] = (int)nearbyint((double)x[i] * most);
        out->dy[i] = (int)nearbyint((double)y[i] * most);
        for (int c = 0; c < 3; c++)
            out->w[c][i] = rl_burley_profile(hypot((double)x[i], (double)y[i]) * most, d[c]) * d[c] * w[i];
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
        double given = light / (sss_materials[id].border == OCCLUDE ? all : same);
        sum->in[c] += e * own;
        sum->out[c] += e * given;
        sum->border[c] += e * own * border / all;
        sum->off_screen[c] += e * own * outside / all;
        sum->redistributed[c] += e * (given - light / all);
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
        double worst = differs(&got, &expected[id]);
        print_message("taps %d border %d material %zu: %.2g off, open %.2g, imbalance %.2g; border %.3f off "
                      "%.3f of in\n",
                      taps, border, id, worst, rl_energy_open(&got), rl_energy_imbalance(&got),
                      got.border[0] / got.in[0], got.off_screen[0] / got.in[0]);
        assert_true(worst < tolerance);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense_sum),
        cmocka_unit_test(test_taps),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
