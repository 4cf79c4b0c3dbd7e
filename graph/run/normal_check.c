#include "graph/run/normal_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 64, FEWEST = 64 };

/* Sums of products of the components of two vectors. The mean cosine after any change of axes is a sum of
 * nine of them, so one look at the pixels is enough for all. */
typedef struct sums {
    double view[3][3];   /* the depth's normal in view space, the file's normal */
    double world[3][3];  /* the same in world space */
    double turned[3][3]; /* in world space, were the camera to look the other way */
    double radial;
    bool positive;
    size_t n;
} sums;

static void multiply(const float m[12], const double v[3], double out[3], bool transposed)
{
    for (int i = 0; i < 3; i++)
        out[i] = transposed
                     ? (double)m[i] * v[0] + (double)m[4 + i] * v[1] + (double)m[8 + i] * v[2]
                     : (double)m[4 * i] * v[0] + (double)m[4 * i + 1] * v[1] + (double)m[4 * i + 2] * v[2];
}

static void add(double m[3][3], const double a[3], const double b[3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] += a[i] * b[j];
}

static bool normalize(double v[3])
{
    double l = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3 && l > 0; i++)
        v[i] /= l;
    return l > 0;
}

/* View space of a pixel; `slope`: its depth is multiplied by the length of its ray to this power. */
static void place(const rl_normal_view *v, int x, int y, int slope, double out[3])
{
    const camera_t *c = v->camera;
    double z = (double)v->depth[(size_t)y * v->stride + (size_t)x];
    double rx = (v->x + x + 0.5 + (double)c->jitter[0] - (double)c->centre[0]) / (double)c->focal[0];
    double ry = (v->y + y + 0.5 + (double)c->jitter[1] - (double)c->centre[1]) / (double)c->focal[1];
    z *= slope > 0 ? sqrt(1 + rx * rx + ry * ry) : slope < 0 ? 1 / sqrt(1 + rx * rx + ry * ry) : 1;
    out[0] = rx * z;
    out[1] = -ry * z;
    out[2] = -z;
}

/* The depth's normal, towards the camera. */
static bool depth_normal(const rl_normal_view *v, int x, int y, int slope, double out[3])
{
    double l[3], r[3], u[3], d[3], here[3], a[3], b[3];
    place(v, x - 1, y, slope, l);
    place(v, x + 1, y, slope, r);
    place(v, x, y - 1, slope, u);
    place(v, x, y + 1, slope, d);
    place(v, x, y, slope, here);
    for (int i = 0; i < 3; i++) {
        a[i] = r[i] - l[i];
        b[i] = u[i] - d[i];
    }
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    double facing = out[0] * here[0] + out[1] * here[1] + out[2] * here[2];
    for (int i = 0; i < 3; i++)
        out[i] = facing > 0 ? -out[i] : out[i];
    return normalize(out);
}

/* Depth without an edge: the two halves of a step differ by less than half of it, or by next to nothing. */
static bool is_smooth(const rl_normal_view *v, int x, int y)
{
    const float *p = v->depth + (size_t)y * v->stride + (size_t)x;
    const ptrdiff_t steps[2] = {1, (ptrdiff_t)v->stride};
    if (!(*p > 0))
        return false;
    for (int i = 0; i < 2; i++) {
        double before = (double)p[-steps[i]], after = (double)p[steps[i]], z = (double)*p;
        if (!(before > 0 && after > 0) ||
            fabs(before - 2 * z + after) > 0.25 * fabs(after - before) + 1e-4 * z)
            return false;
    }
    return true;
}

static void sample(const rl_normal_view *v, const rl_layer *normal, bool forward_z, int slope, int x, int y,
                   sums *s)
{
    double g[3], other[3], n[3], stated[3], file[3], g_world[3], g_turned[3], flipped[3];
    size_t at = (size_t)y * v->stride + (size_t)x;
    for (int i = 0; i < 3; i++)
        n[i] = (double)v->normal[i][at];
    if (!is_smooth(v, x, y) || !normalize(n) || !depth_normal(v, x, y, 0, g) ||
        !depth_normal(v, x, y, slope, other))
        return;
    /* back to what the file has: out of world space, of axes that look down +z, and of the stated order */
    multiply(v->camera->to_view, n, stated, false);
    s->radial += stated[0] * other[0] + stated[1] * other[1] + stated[2] * other[2];
    if (normal->space == RL_SPACE_WORLD)
        memcpy(stated, n, sizeof stated);
    else if (forward_z)
        stated[2] = -stated[2];
    for (int i = 0; i < 3; i++) {
        int from = normal->axes[i];
        file[abs(from) - 1] = from < 0 ? -stated[i] : stated[i];
        flipped[i] = i == 2 ? -g[i] : g[i];
    }
    s->positive = s->positive && file[0] >= 0 && file[1] >= 0 && file[2] >= 0;
    multiply(v->camera->to_view, g, g_world, true);
    multiply(v->camera->to_view, flipped, g_turned, true);
    add(s->view, forward_z ? flipped : g, file);
    add(s->world, g_world, file);
    add(s->turned, g_turned, file);
    s->n++;
}

static double mean(double (*m)[3], const int axes[3], size_t n)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += axes[i] < 0 ? -m[i][-axes[i] - 1] : m[i][axes[i] - 1];
    return sum / (double)n;
}

static bool is_plain(const int axes[3])
{
    return axes[0] == 1 && axes[1] == 2 && axes[2] == 3;
}

/* All signed orders of three axes, the plain one first. */
static void order(int i, int axes[3])
{
    static const int orders[6][3] = {{1, 2, 3}, {1, 3, 2}, {2, 1, 3}, {2, 3, 1}, {3, 1, 2}, {3, 2, 1}};
    for (int k = 0; k < 3; k++)
        axes[k] = orders[i / 8][k] * (i >> k & 1 ? -1 : 1);
}

/* Takes a candidate that is better by more than chance; simple ones come first and stay. */
static void consider(rl_normal_check *c, double cosine, bool other_space, bool other_way, const int axes[3])
{
    if (cosine < c->best + 0.02)
        return;
    c->best = cosine;
    c->other_space = other_space;
    c->other_way = other_way;
    memcpy(c->axes, axes, sizeof c->axes);
}

void rl_normal_check_run(const rl_normal_view *v, const rl_layer *normal, const rl_layer *depth,
                         bool forward_z, rl_normal_check *out)
{
    sums s = {.positive = true};
    int slope = depth->kind == RL_DEPTH_RADIAL ? 1 : -1;
    for (int i = 0; i < SIDE * SIDE; i++) {
        int x = (int)((2LL * (i % SIDE) + 1) * v->width / (2 * SIDE));
        int y = (int)((2LL * (i / SIDE) + 1) * v->height / (2 * SIDE));
        if (x > 0 && y > 0 && x + 1 < v->width && y + 1 < v->height)
            sample(v, normal, forward_z, slope, x, y, &s);
    }
    *out = (rl_normal_check){.samples = s.n, .cosine = 1, .best = -2, .axes = {1, 2, 3}, .radial = 1};
    if (s.n < FEWEST)
        return;
    bool world = normal->space == RL_SPACE_WORLD;
    out->cosine = mean(world ? s.world : s.view, normal->axes, s.n);
    out->radial = s.radial / (double)s.n;
    out->positive = s.positive;
    for (int i = 0; i < 48; i++) {
        int axes[3];
        order(i, axes);
        bool stated = !memcmp(axes, normal->axes, sizeof axes);
        if (!world || !stated)
            consider(out, mean(s.world, axes, s.n), !world, false, axes);
        if (world || !stated)
            consider(out, mean(s.view, axes, s.n), world, false, axes);
        if (is_plain(axes))
            consider(out, mean(s.turned, axes, s.n), !world, true, axes);
    }
}

/* ---- words -----------------------------------------------------------------------------------------------
 */

static void add_axes(const int axes[3], rl_str *out)
{
    rl_str_add(out, "layers.normal.axes: [");
    for (int i = 0; i < 3; i++)
        rl_str_printf(out, "%s%s%c", i ? ", " : "", axes[i] < 0 ? "-" : "", "xyz"[abs(axes[i]) - 1]);
    rl_str_add(out, "]");
}

/* The best of the other conventions, as keys of a manifest. */
static void add_best(const rl_normal_check *c, const rl_layer *normal, bool forward_z, rl_str *out)
{
    const char *between = "";
    if (c->other_space) {
        rl_str_printf(out, "layers.normal.space: %s", normal->space == RL_SPACE_WORLD ? "camera" : "world");
        between = ", ";
    }
    if (c->other_way) {
        rl_str_printf(out, "%scamera.forward: %s", between, forward_z ? "-z" : "+z");
        between = ", ";
    }
    if (memcmp(c->axes, normal->axes, sizeof c->axes)) {
        rl_str_add(out, between);
        add_axes(c->axes, out);
    }
}

bool rl_normal_check_advice(const rl_normal_check *c, const rl_layer *normal, const rl_layer *depth,
                            bool forward_z, rl_str *out)
{
    bool better = c->best > 0.85 && c->best > c->cosine + 0.1;
    bool bent = depth->kind != RL_DEPTH_DEVICE && c->cosine < 0.998 && 1 - c->radial < 0.6 * (1 - c->cosine);
    bool halved =
        c->positive && normal->encoding == RL_ENCODING_SIGNED && c->cosine < 0.95; /* 0..1 as -1..1 */
    bool wrong = c->cosine < 0.5 || (c->cosine < 0.85 && better);
    if (c->samples < FEWEST || !(wrong || bent || halved))
        return false;
    rl_str_printf(out,
                  "normals and depth do not fit each other: at %zu smooth places their mean cosine is %.2f; ",
                  c->samples, c->cosine);
    if (halved) {
        rl_str_add(out, "none has a negative component: layers.normal.encoding: unsigned in the manifest?");
    } else if (!wrong) {
        rl_str_printf(out, "it is %.3f with layers.depth.kind: %s in the manifest", c->radial,
                      depth->kind == RL_DEPTH_RADIAL ? "planar" : "radial");
    } else if (better) {
        rl_str_printf(out, "it is %.2f with ", c->best);
        add_best(c, normal, forward_z, out);
        rl_str_add(out, " in the manifest");
        if (!c->other_space && !c->other_way && normal->space == RL_SPACE_WORLD)
            rl_str_add(out, ", or camera.matrix is of a world with other axes");
    } else {
        rl_str_add(out, "check layers.normal (space, encoding, axes), layers.depth (kind; is it inverted, or "
                        "clamped?) and camera (matrix, forward, fov_x) in the manifest");
    }
    return true;
}
