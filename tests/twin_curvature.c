#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/twin_curvature.h"

extern const rl_pass rl_pass_curvature;

/* ---- the scene ------------------------------------------------------------------------------------------
 */

void bend_make(bend_scene *t, int w, int h, int x0, int y0, uint64_t seed)
{
    assert_true(shade_scene_make(&t->scene, w, h, x0, y0, seed));
    t->curvature = shade_image_new(&t->scene.frame, 1);
    assert_non_null(t->curvature.data);
    shade_params_default(&rl_pass_curvature, &t->radius_mm);
    t->run = (shade_run){.pass = &rl_pass_curvature,
                         .frame = t->scene.frame,
                         .params = &t->radius_mm,
                         .materials = &t->scene.materials,
                         .images = {&t->scene.images[LIGHTING_NORMAL], &t->scene.images[LIGHTING_DEPTH],
                                    &t->scene.images[LIGHTING_STENCIL], &t->curvature, &t->scene.color}};
}

void bend_free(bend_scene *t)
{
    shade_image_free(&t->curvature);
    shade_scene_free(&t->scene);
}

double bend_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void bend_normalize(double *v)
{
    double scale = 1 / sqrt(bend_dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] *= scale;
}

double bend_get(const bend_scene *t, int port, int plane, int x, int y)
{
    return *shade_at(t->run.images[port], &t->run.frame, plane, x, y);
}

void bend_position(const bend_scene *t, int x, int y, double *p)
{
    double view[3], z = bend_get(t, DEPTH, 0, x, y);
    twin_ray(&t->run.frame, &t->run.frame.camera, x, y, view, p);
    for (int i = 0; i < 3; i++)
        p[i] *= z;
}

void bend_normal(const bend_scene *t, int x, int y, double *n)
{
    for (int i = 0; i < 3; i++)
        n[i] = bend_get(t, NORMAL, i, x, y);
}

uint32_t bend_id(const bend_scene *t, int x, int y)
{
    const frame_t *f = &t->run.frame;
    bool inside = x >= f->valid[0] && y >= f->valid[1] && x < f->valid[2] && y < f->valid[3];
    return inside ? shade_id(t->run.images[STENCIL], f, x, y) : 0;
}

/* ---- the twin ---------------------------------------------------------------------------------------------
 */

typedef struct twin {
    double pp[3][3], np[3][3], sum[3]; /* sums of dp dp^T and dn dp^T in world space, on the tangent plane */
    bool close;                        /* a neighbour's test was decided by rounding */
    double spread; /* smaller eigenvalue of pp over the trace: 0 where neighbours lie in a line */
} twin;

/* The window's radius in pixels: of the nearest point of 16 pixels. */
static int radius_at(const bend_scene *t, int x, int y)
{
    double nearest = 1e30;
    for (int i = x / 16 * 16; i < x / 16 * 16 + 16; i++)
        if (bend_id(t, i, y) && bend_get(t, DEPTH, 0, i, y) > 0)
            nearest = fmin(nearest, bend_get(t, DEPTH, 0, i, y));
    double pixels = 1e-3 * t->radius_mm * t->run.frame.camera.focal[0] / nearest;
    return (int)(fmin(fmax(pixels, 1), 64) + 0.5);
}

static void project(double *v, const double *n)
{
    double along = bend_dot(v, n);
    for (int i = 0; i < 3; i++)
        v[i] -= along * n[i];
}

static void twin_add(const bend_scene *t, twin *w, int x, int y, int dx, int dy)
{
    double n[3], p[3], n1[3], p1[3], mean[3];
    if (bend_id(t, x + dx, y + dy) != bend_id(t, x, y) || bend_get(t, DEPTH, 0, x + dx, y + dy) <= 0)
        return;
    bend_normal(t, x, y, n);
    bend_normal(t, x + dx, y + dy, n1);
    bend_position(t, x, y, p);
    bend_position(t, x + dx, y + dy, p1);
    for (int i = 0; i < 3; i++) {
        mean[i] = n[i] + n1[i];
        p1[i] -= p[i];
    }
    double turn = bend_dot(n, n1), length = sqrt(bend_dot(mean, mean) * bend_dot(p1, p1)),
           sine = fabs(bend_dot(mean, p1)) / length;
    w->close |= fabs(turn) < 1e-5 || fabs(sine - 0.5) < 1e-4;
    if (turn <= 0 || sine > 0.5)
        return;
    for (int i = 0; i < 3; i++)
        w->sum[i] += n1[i];
    for (int i = 0; i < 3; i++)
        n1[i] -= n[i];
    project(n1, n);
    project(p1, n);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            w->pp[i][j] += p1[i] * p1[j];
            w->np[i][j] += n1[i] * p1[j];
        }
    }
}

/* tr(N A)/tr(M A), A = (M + e)^-1, through eigenvectors of M on the tangent plane. */
static double twin_curvature(twin *w, const double *n)
{
    double t[3] = {n[1], -n[0], 0}, b[3], axis[2][3], over = 0, under = 0, a = 0, c = 0, d = 0;
    if (bend_dot(t, t) < 1e-6)
        t[0] = 1;
    bend_normalize(t);
    for (int i = 0; i < 3; i++)
        b[i] = n[(i + 1) % 3] * t[(i + 2) % 3] - n[(i + 2) % 3] * t[(i + 1) % 3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            a += t[i] * w->pp[i][j] * t[j];
            d += t[i] * w->pp[i][j] * b[j];
            c += b[i] * w->pp[i][j] * b[j];
        }
    }
    w->spread = a + c > 0 ? (a * c - d * d) / ((a + c) * (a + c)) : 1;
    double angle = 0.5 * atan2(2 * d, a - c), e = 1e-5 * (a + c);
    if (a + c <= 0)
        return 0;
    for (int k = 0; k < 2; k++) {
        double m = 0, along = 0;
        for (int i = 0; i < 3; i++)
            axis[k][i] = k ? -sin(angle) * t[i] + cos(angle) * b[i] : cos(angle) * t[i] + sin(angle) * b[i];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                m += axis[k][i] * w->pp[i][j] * axis[k][j];
                along += axis[k][i] * w->np[i][j] * axis[k][j];
            }
        }
        over += along / (m + e);
        under += m / (m + e);
    }
    return over / under;
}

bool twin_bend(const bend_scene *t, int x, int y, double *curvature, double *smooth, double *spread)
{
    twin w = {0};
    double n[3];
    int radius = radius_at(t, x, y);
    bend_normal(t, x, y, n);
    for (int i = 0; i < 3; i++)
        w.sum[i] = n[i];
    for (int ring = 0; ring < 2; ring++) {
        int r = ring ? (radius > 1 ? radius / 2 : 1) : radius, d = (int)(sqrt(0.5) * r + 0.5);
        d = d > 1 ? d : 1;
        for (int i = -1; i <= 1; i++)
            for (int j = -1; j <= 1; j++)
                if (i || j)
                    twin_add(t, &w, x, y, i * (j ? d : r), j * (i ? d : r));
    }
    *curvature = twin_curvature(&w, n);
    *spread = w.spread;
    double length = sqrt(bend_dot(w.sum, w.sum));
    for (int i = 0; i < 3; i++)
        smooth[i] = w.sum[i] / length;
    return !w.close;
}
