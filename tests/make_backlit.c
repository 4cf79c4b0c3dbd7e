/* Records captures/backlit: ellipsoids of wax, skin and leaf before a wall, by casting a ray a pixel, with
 * the closest back face of each (back_depth, back_normal) and shadow layers as a shadow map gives them.
 * Camera and world are the same, it looks down -z. Usage: make_backlit FILE.exr */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/exr_make.h"

enum { WIDTH = 480, HEIGHT = 270, SKIN = 1, WALL = 2, LEAF = 3, WAX = 4 };
static const double fov = 0.34906585, wall_z = -0.75; /* radians; metres */

typedef struct vec {
    double v[3];
} vec;

/* Semi-axes, turned about y, then about z. */
typedef struct ellipsoid {
    int id;
    vec centre, radius;
    double turn, roll;
    vec albedo;
} ellipsoid;

static const ellipsoid things[] = {
    {WAX, {{-0.062, -0.012, -0.52}}, {{0.019, 0.019, 0.019}}, 0, 0, {{0.85, 0.68, 0.4}}},
    {SKIN, {{-0.004, 0.004, -0.5}}, {{0.018, 0.027, 0.0035}}, 0.35, -0.2, {{0.8, 0.5, 0.4}}},
    {SKIN, {{-0.022, -0.03, -0.51}}, {{0.03, 0.0075, 0.0075}}, 0.1, 0.15, {{0.75, 0.45, 0.36}}},
    {LEAF, {{0.058, 0.006, -0.5}}, {{0.022, 0.034, 0.0004}}, -0.5, 0.4, {{0.25, 0.5, 0.08}}},
    {SKIN, {{0.009, 0.016, -0.545}}, {{0.004, 0.012, 0.004}}, 0, 0.6, {{0.8, 0.5, 0.4}}}, /* shades the ear */
};
enum { THINGS = sizeof things / sizeof *things };

static const vec lights[] = {{{-0.35, 0.3, -0.1}}, {{0.03, 0.045, -0.62}}}; /* key, rim */

static vec turned(const ellipsoid *e, vec p, bool back)
{
    double c = cos(e->turn), s = sin(e->turn), k = cos(e->roll), l = sin(e->roll);
    if (back) {
        double x = p.v[0] * c + p.v[2] * s, z = p.v[2] * c - p.v[0] * s;
        return (vec){{x * k - p.v[1] * l, x * l + p.v[1] * k, z}};
    }
    double x = p.v[0] * k + p.v[1] * l, y = p.v[1] * k - p.v[0] * l;
    return (vec){{x * c - p.v[2] * s, y, x * s + p.v[2] * c}};
}

/* Where from + t ray enters and leaves. */
static bool cross(const ellipsoid *e, vec from, vec ray, double t[2])
{
    vec o, d = turned(e, ray, false);
    for (int i = 0; i < 3; i++)
        o.v[i] = from.v[i] - e->centre.v[i];
    o = turned(e, o, false);
    double a = 0, h = 0, c = -1;
    for (int i = 0; i < 3; i++) {
        double r = e->radius.v[i];
        a += d.v[i] * d.v[i] / (r * r);
        h += o.v[i] * d.v[i] / (r * r);
        c += o.v[i] * o.v[i] / (r * r);
    }
    double root = h * h - a * c;
    if (root <= 0)
        return false;
    t[0] = (-h - sqrt(root)) / a;
    t[1] = (-h + sqrt(root)) / a;
    return true;
}

static vec normal_at(const ellipsoid *e, vec p)
{
    double length = 0;
    for (int i = 0; i < 3; i++)
        p.v[i] -= e->centre.v[i];
    p = turned(e, p, false);
    for (int i = 0; i < 3; i++) {
        p.v[i] /= e->radius.v[i] * e->radius.v[i];
        length += p.v[i] * p.v[i];
    }
    for (int i = 0; i < 3; i++)
        p.v[i] /= sqrt(length);
    return turned(e, p, true);
}

/* Distance from the first thing that the light meets on its way to p; 0: it arrives. */
static double shadow_thickness(vec light, vec p)
{
    vec ray;
    double length = 0, first = 1, t[2];
    for (int i = 0; i < 3; i++) {
        ray.v[i] = p.v[i] - light.v[i];
        length += ray.v[i] * ray.v[i];
    }
    for (int k = 0; k < THINGS; k++)
        if (cross(&things[k], light, ray, t) && t[0] > 0 && t[0] < first)
            first = t[0];
    length = sqrt(length) * (1 - first);
    return length > 1e-6 ? length : 0;
}

enum {
    ALBEDO,
    NORMAL = 3,
    DEPTH = 6,
    BACK_DEPTH,
    BACK_NORMAL,
    THICKNESS = 11,
    SHADOW,
    SHADOW_THICKNESS = 14,
    PLANES = 16
};
static double plane[PLANES][WIDTH * HEIGHT];
static uint32_t stencil[WIDTH * HEIGHT];

static void shoot(int x, int y)
{
    const double focal = WIDTH / 2.0 / tan(fov / 2);
    int i = y * WIDTH + x;
    const vec eye = {{0, 0, 0}},
              ray = {{(x + 0.5 - WIDTH / 2.0) / focal, -(y + 0.5 - HEIGHT / 2.0) / focal, -1}};
    const ellipsoid *hit = NULL;
    double front = -wall_z, back = 1e10, t[2];
    for (int k = 0; k < THINGS; k++)
        if (cross(&things[k], eye, ray, t) && t[0] < front) {
            hit = &things[k];
            front = t[0];
            back = t[1];
        }
    vec p, b, n = {{0, 0, 1}}, m = {{0, 0, 0}}, albedo = {{0.5, 0.5, 0.52}};
    for (int c = 0; c < 3; c++) {
        p.v[c] = front * ray.v[c];
        b.v[c] = back * ray.v[c];
    }
    if (hit) {
        n = normal_at(hit, p);
        m = normal_at(hit, b);
        albedo = hit->albedo;
        vec in = {{-n.v[0], -n.v[1], -n.v[2]}};
        plane[THICKNESS][i] = cross(hit, p, in, t) ? t[1] : 0;
    }
    stencil[i] = (uint32_t)(hit ? hit->id : WALL);
    plane[DEPTH][i] = front;
    plane[BACK_DEPTH][i] = back;
    for (int c = 0; c < 3; c++) {
        plane[ALBEDO + c][i] = albedo.v[c];
        plane[NORMAL + c][i] = n.v[c];
        plane[BACK_NORMAL + c][i] = m.v[c];
    }
    for (int l = 0; l < 2; l++) {
        plane[SHADOW_THICKNESS + l][i] = shadow_thickness(lights[l], p);
        plane[SHADOW + l][i] = plane[SHADOW_THICKNESS + l][i] > 0 ? 0 : 1;
    }
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        int plane;
        bool precise;
    } names[] = {{"albedo.B", ALBEDO + 2, 0},
                 {"albedo.G", ALBEDO + 1, 0},
                 {"albedo.R", ALBEDO, 0},
                 {"back_depth.Z", BACK_DEPTH, 1},
                 {"back_normal.X", BACK_NORMAL, 0},
                 {"back_normal.Y", BACK_NORMAL + 1, 0},
                 {"back_normal.Z", BACK_NORMAL + 2, 0},
                 {"depth.Z", DEPTH, 1},
                 {"normal.X", NORMAL, 0},
                 {"normal.Y", NORMAL + 1, 0},
                 {"normal.Z", NORMAL + 2, 0},
                 {"shadow.key", SHADOW, 0},
                 {"shadow.rim", SHADOW + 1, 0},
                 {"shadow_thickness.key", SHADOW_THICKNESS, 0},
                 {"shadow_thickness.rim", SHADOW_THICKNESS + 1, 0},
                 {"stencil.ID", -1, 0},
                 {"thickness.T", THICKNESS, 0}};
    enum { CHANNELS = sizeof names / sizeof *names };
    static uint16_t half[CHANNELS][WIDTH * HEIGHT];
    static float single[CHANNELS][WIDTH * HEIGHT];
    const float matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    made_channel channels[CHANNELS];
    if (argc != 2) {
        fprintf(stderr, "usage: make_backlit FILE.exr\n");
        return 2;
    }
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            shoot(x, y);
    for (int c = 0; c < CHANNELS; c++) {
        bool id = names[c].plane < 0;
        for (int i = 0; i < WIDTH * HEIGHT && !id; i++) {
            single[c][i] = (float)plane[names[c].plane][i];
            half[c][i] = made_half(single[c][i]);
        }
        channels[c] = (made_channel){names[c].name,
                                     id                 ? RL_EXR_UINT
                                     : names[c].precise ? RL_EXR_FLOAT
                                                        : RL_EXR_HALF,
                                     0,
                                     id                 ? (const void *)stencil
                                     : names[c].precise ? (const void *)single[c]
                                                        : half[c]};
    }
    const made_header header = {
        .matrix = matrix, .fov_x = (float)fov, .fps = {24, 1}, .owner = "the relit project, CC0"};
    const made_part part = {.width = WIDTH,
                            .height = HEIGHT,
                            .compression = RL_EXR_ZIP,
                            .channels = channels,
                            .n_channels = CHANNELS,
                            .header = &header};
    made_write(argv[1], &part, 1);
    return 0;
}
