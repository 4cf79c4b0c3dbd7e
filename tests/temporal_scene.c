#include "tests/temporal_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
static const double fov_x = 0.7;
static const double plane_point[3] = {0, 0, -2}, plane_normal[3] = {0.228748, 0.091499, 0.969176};
static const double radius = 0.16;
static const double texel = 0.0076; /* metres of the plane that a pixel shows when the image is 192 wide */

/* ---- where things are
 * ------------------------------------------------------------------------------------------ */

typedef struct pose {
    double eye[3], turn;    /* of the camera; turn about the y axis, radians */
    double centre[3], spin; /* of the sphere */
} pose;

static pose pose_at(const temporal_scene *s, int number)
{
    double c = s->camera_moves ? number : 0, o = s->object_moves ? number : 0;
    return (pose){.eye = {0.006 * c, 0.002 * c, -0.004 * c},
                  .turn = -0.003 * c,
                  .centre = {-0.12 + 0.0122 * o, 0.01, -1.4},
                  .spin = 0.02 * o};
}

static double focal(const temporal_scene *s)
{
    return 0.5 * s->width / tan(0.5 * fov_x);
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* To camera space: R (p - eye), R turns by -turn about y. */
static void to_camera(const pose *p, const double *world, double *out)
{
    double d[3] = {world[0] - p->eye[0], world[1] - p->eye[1], world[2] - p->eye[2]};
    double c = cos(p->turn), n = sin(p->turn);
    out[0] = c * d[0] - n * d[2];
    out[1] = d[1];
    out[2] = n * d[0] + c * d[2];
}

static void project(const temporal_scene *s, const pose *p, const double *world, double *x, double *y)
{
    double v[3];
    to_camera(p, world, v);
    *x = 0.5 * s->width + focal(s) * v[0] / -v[2];
    *y = 0.5 * s->height - focal(s) * v[1] / -v[2];
}

/* ---- what a ray meets
 * ------------------------------------------------------------------------------------------- */

typedef struct hit {
    uint32_t id;
    double world[3], normal[3];
    double local[3]; /* sphere: where it is on the sphere, as a unit vector that spins with it */
    double depth;    /* along the view axis */
} hit;

static void spin_back(double angle, const double *v, double *out)
{
    double c = cos(angle), n = sin(angle);
    out[0] = c * v[0] - n * v[2];
    out[1] = v[1];
    out[2] = n * v[0] + c * v[2];
}

/* The ray through display position (x, y); its direction has length 1 along the view axis. */
static void ray(const temporal_scene *s, const pose *p, double x, double y, double *d)
{
    double vx = (x - 0.5 * s->width) / focal(s), vy = -(y - 0.5 * s->height) / focal(s);
    double c = cos(p->turn), n = sin(p->turn);
    d[0] = c * vx - n;
    d[1] = vy;
    d[2] = -n * vx - c;
}

static hit cast(const temporal_scene *s, const pose *p, double x, double y)
{
    hit h = {.id = SCENE_PLANE};
    double d[3], from[3], to_plane[3];
    ray(s, p, x, y, d);
    for (int i = 0; i < 3; i++) {
        from[i] = p->eye[i] - p->centre[i];
        to_plane[i] = plane_point[i] - p->eye[i];
    }
    double a = dot(d, d), b = dot(d, from), c = dot(from, from) - radius * radius, under = b * b - a * c;
    h.depth = dot(to_plane, plane_normal) / dot(d, plane_normal);
    if (under > 0) {
        h.id = SCENE_SPHERE;
        h.depth = (-b - sqrt(under)) / a;
    }
    for (int i = 0; i < 3; i++)
        h.world[i] = p->eye[i] + h.depth * d[i];
    for (int i = 0; i < 3; i++)
        h.normal[i] = h.id == SCENE_SPHERE ? (h.world[i] - p->centre[i]) / radius : plane_normal[i];
    if (h.id == SCENE_SPHERE)
        spin_back(p->spin, h.normal, h.local);
    return h;
}

/* Where the surface point of h was under the pose `then`. */
static void point_then(const pose *then, const hit *h, double *world)
{
    memcpy(world, h->world, 3 * sizeof *world);
    if (h->id != SCENE_SPHERE)
        return;
    double n[3];
    spin_back(-then->spin, h->local, n);
    for (int i = 0; i < 3; i++)
        world[i] = then->centre[i] + radius * n[i];
}

/* ---- colours
 * ---------------------------------------------------------------------------------------------------- */

/* A texture with detail from 23 to 4 pixels, hard edges and thin dark lines; u, v in pixels. Between 0.05 and
 * 0.95. */
static double texture(double u, double v, int channel)
{
    double p = 0.7 * channel;
    double t = 0.5 + 0.12 * sin(2 * PI * u / 23 + p) * cos(2 * PI * v / 17) +
               0.08 * sin(2 * PI * (u + v) / 9.1 + p) + 0.05 * sin(2 * PI * (0.8 * u - 1.1 * v) / 4.3 + p);
    bool tile = fmod(floor(u / 28) + floor(v / 22), 2) == 0;
    bool line = fabs(fmod(u + 0.4 * v, 31)) < 1.5;
    return t + (tile ? 0.06 : -0.06) - (line ? 0.08 : 0);
}

static void shade(const temporal_scene *s, const hit *h, double *rgb)
{
    double finer = s->density > 0 ? s->density : 1;
    double u = h->world[0] / texel, v = h->world[1] / texel;
    if (h->id == SCENE_SPHERE) {
        u = 400 + atan2(h->local[0], h->local[2]) * radius / texel;
        v = 400 + asin(fmax(-1, fmin(1, h->local[1]))) * radius / texel;
    }
    for (int c = 0; c < 3; c++) {
        if (h->id == SCENE_PLANE && s->plain)
            rgb[c] = 0.2 + 0.0004 * (u + 100) + 0.03 * c;
        else
            rgb[c] = texture(u * finer, v * finer, h->id == SCENE_SPHERE ? 2 - c : c) +
                     (h->id == SCENE_SPHERE ? 0.08 : -0.05);
    }
}

/* ---- frames
 * ------------------------------------------------------------------------------------------------------ */

bool temporal_frame_new(temporal_frame *f, int width, int height)
{
    size_t n = (size_t)width * (size_t)height;
    memset(f, 0, sizeof *f);
    f->width = width;
    f->height = height;
    float *all = calloc(9 * n, sizeof *all);
    f->id = calloc(n, sizeof *f->id);
    f->color[0] = all;
    if (!all || !f->id)
        return false;
    f->color[1] = all + n;
    f->color[2] = all + 2 * n;
    f->depth = all + 3 * n;
    f->motion[0] = all + 4 * n;
    f->motion[1] = all + 5 * n;
    for (int i = 0; i < 3; i++)
        f->normal[i] = all + (6 + (size_t)i) * n;
    return true;
}

void temporal_frame_free(temporal_frame *f)
{
    free(f->color[0]);
    free(f->id);
    memset(f, 0, sizeof *f);
}

static double halton(int n, int base)
{
    double f = 1, r = 0;
    for (; n > 0; n /= base) {
        f /= base;
        r += f * (n % base);
    }
    return r;
}

void temporal_jitter(int n, double jitter[2])
{
    jitter[0] = halton(n + 1, 2) - 0.5;
    jitter[1] = halton(n + 1, 3) - 0.5;
}

static void record_camera(const pose *p, temporal_frame *out)
{
    double c = cos(p->turn), n = sin(p->turn);
    double r[3][3] = {{c, 0, -n}, {0, 1, 0}, {n, 0, c}};
    memset(out->to_camera, 0, sizeof out->to_camera);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            out->to_camera[4 * i + j] = r[i][j];
        out->to_camera[4 * i + 3] = -dot(r[i], p->eye);
    }
    out->to_camera[15] = 1;
    out->fov_x = fov_x;
}

void temporal_render(const temporal_scene *s, int number, const double jitter[2], temporal_frame *out)
{
    pose now = pose_at(s, number), then = pose_at(s, number - 1);
    record_camera(&now, out);
    memcpy(out->jitter, jitter, sizeof out->jitter);
    for (int y = 0; y < s->height; y++) {
        for (int x = 0; x < s->width; x++) {
            size_t i = (size_t)y * (size_t)s->width + (size_t)x;
            double px = x + 0.5 + jitter[0], py = y + 0.5 + jitter[1], was[3], rgb[3], wx, wy;
            hit h = cast(s, &now, px, py);
            point_then(&then, &h, was);
            project(s, &then, was, &wx, &wy);
            shade(s, &h, rgb);
            for (int c = 0; c < 3; c++) {
                out->color[c][i] = (float)rgb[c];
                out->normal[c][i] = (float)h.normal[c];
            }
            out->depth[i] = (float)h.depth;
            out->motion[0][i] = (float)(wx - px);
            out->motion[1][i] = (float)(wy - py);
            out->id[i] = h.id;
        }
    }
}

void temporal_truth(const temporal_scene *s, int number, int n, float *const rgb[3])
{
    pose now = pose_at(s, number);
    for (int y = 0; y < s->height; y++) {
        for (int x = 0; x < s->width; x++) {
            double sum[3] = {0, 0, 0}, one[3];
            for (int i = 0; i < n * n; i++) {
                hit h = cast(s, &now, x + (i % n + 0.5) / n, y + (i / n + 0.5) / n);
                shade(s, &h, one);
                for (int c = 0; c < 3; c++)
                    sum[c] += one[c];
            }
            for (int c = 0; c < 3; c++)
                rgb[c][y * s->width + x] = (float)(sum[c] / (n * n));
        }
    }
}

bool temporal_disoccluded(const temporal_scene *s, int number, int x, int y, double reach)
{
    pose now = pose_at(s, number), then = pose_at(s, number - 1);
    double jitter[2], was[3], px, py;
    temporal_jitter(number, jitter);
    hit h = cast(s, &now, x + 0.5 + jitter[0], y + 0.5 + jitter[1]);
    point_then(&then, &h, was);
    project(s, &then, was, &px, &py);
    for (int i = 0; i < 81; i++) {
        double qx = px + (i % 9 - 4) * reach / 4, qy = py + (i / 9 - 4) * reach / 4;
        if (qx >= 0 && qy >= 0 && qx < s->width && qy < s->height && cast(s, &then, qx, qy).id == h.id)
            return false;
    }
    return true;
}

double temporal_beside_sphere(const temporal_scene *s, int number, int x, int y)
{
    pose p = pose_at(s, number);
    double left = 1e9, right = -1e9;
    for (int i = 0; i < 8 * s->width; i++) {
        if (cast(s, &p, (i + 0.5) / 8, y + 0.5).id == SCENE_SPHERE) {
            left = fmin(left, i / 8.0);
            right = fmax(right, (i + 1) / 8.0);
        }
    }
    double at = x + 0.5;
    return right < left || (at >= left && at <= right) ? 0 : at > right ? at - right : at - left;
}
