/* See gaussian_twin.h. */
#include "tests/gaussian_twin.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"

typedef struct place {
    double x, y, z; /* metres, view space, z along the axis */
} place;

typedef struct job {
    const twin_scene *s;
    const gaussian_material *materials;
    const double *light; /* 3 planes */
    const char *light_doubt;
} job;

typedef struct mean {
    double weight, light[3];
    bool doubt;
} mean;

static size_t index_of(const twin_scene *s, int x, int y)
{
    return (size_t)y * (size_t)s->frame.columns + (size_t)x;
}

static size_t plane_of(const twin_scene *s)
{
    return (size_t)s->frame.columns * (size_t)s->frame.rows;
}

static uint32_t material_at(const twin_scene *s, int x, int y)
{
    const int *v = s->frame.valid;
    return x >= v[0] && y >= v[1] && x < v[2] && y < v[3] ? s->stencil[index_of(s, x, y)] : 0;
}

static place place_at(const twin_scene *s, int x, int y, double z)
{
    const camera_t *c = &s->frame.camera;
    double px = x + s->frame.origin[0] + 0.5 + (double)c->jitter[0],
           py = y + s->frame.origin[1] + 0.5 + (double)c->jitter[1];
    return (place){(px - (double)c->centre[0]) / (double)c->focal[0] * z,
                   -(py - (double)c->centre[1]) / (double)c->focal[1] * z, z};
}

static double reach_of(const gaussian_material *m, int g)
{
    double widest = 0;
    for (int i = 0; i < m->n; i++)
        widest = fmax(widest, (double)m->variance_mm2[i]);
    return 1e-3 * fmin(3 * sqrt(widest), 4.5 * sqrt((double)m->variance_mm2[g]));
}

static void add_sample(const job *j, int x, int y, int sx, int sy, int g, mean *sum)
{
    const twin_scene *s = j->s;
    uint32_t id = s->stencil[index_of(s, x, y)];
    const gaussian_material *m = &j->materials[id];
    bool same = material_at(s, sx, sy) == id;
    if (!same && m->border == 0)
        return;
    double z = (double)s->depth[index_of(s, x, y)], reach = reach_of(m, g);
    place a = place_at(s, x, y, z), b = place_at(s, sx, sy, same ? (double)s->depth[index_of(s, sx, sy)] : z);
    double far2 = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y) + (b.z - a.z) * (b.z - a.z);
    sum->doubt |= fabs(far2 / (reach * reach) - 1) < 1e-5;
    if (far2 > reach * reach)
        return;
    double w = exp(-far2 / (2e-6 * (double)m->variance_mm2[g]));
    w *= twin_area(s, same ? sx : x, same ? sy : y);
    sum->weight += w;
    sum->doubt |= same && j->light_doubt[index_of(s, sx, sy)];
    for (size_t c = 0; c < 3 && same; c++)
        sum->light[c] += w * j->light[c * plane_of(s) + index_of(s, sx, sy)];
}

/* More pixels than a sample in reach can be away: the surface may come half way to the camera. */
static int pixels_of(const job *j, int x, int y, int g, int axis)
{
    const twin_scene *s = j->s;
    double z = (double)s->depth[index_of(s, x, y)];
    double reach = reach_of(&j->materials[s->stencil[index_of(s, x, y)]], g);
    place a = place_at(s, x, y, 1);
    return (int)ceil(2 * reach * sqrt(1 + a.x * a.x + a.y * a.y) / z * (double)s->frame.camera.focal[axis]);
}

/* axes: 1 a row, 2 a column, 3 all around. */
static mean mean_of(const job *j, int x, int y, int g, int axes)
{
    mean sum = {0};
    int nx = axes & 1 ? pixels_of(j, x, y, g, 0) : 0, ny = axes & 2 ? pixels_of(j, x, y, g, 1) : 0;
    for (int dy = -ny; dy <= ny; dy++)
        for (int dx = -nx; dx <= nx; dx++)
            add_sample(j, x, y, x + dx, y + dy, g, &sum);
    for (int c = 0; c < 3; c++)
        sum.light[c] /= sum.weight;
    return sum;
}

/* Calls mean_of for every pixel that has a Gaussian g; blends into `blend` or stores to `to`. */
static void each_pixel(const job *j, int g, int axes, double *to, double *blend, char *doubt)
{
    const twin_scene *s = j->s;
    const int *v = s->frame.valid;
    for (int y = v[1]; y < v[3]; y++)
        for (int x = v[0]; x < v[2]; x++) {
            size_t i = index_of(s, x, y);
            const gaussian_material *m = &j->materials[s->stencil[i]];
            if (!m->has_profile || g >= m->n)
                continue;
            mean sum = mean_of(j, x, y, g, axes);
            doubt[i] |= sum.doubt;
            for (size_t c = 0; c < 3; c++) {
                if (blend)
                    blend[c * plane_of(s) + i] += (double)m->weight[g][c] * sum.light[c];
                else
                    to[c * plane_of(s) + i] = sum.light[c];
            }
        }
}

bool twin_gaussian(const twin_scene *s, const gaussian_material *materials, bool separable, double *filtered,
                   char *doubt)
{
    size_t n = plane_of(s);
    double *light = rl_calloc(3 * n, sizeof *light), *line = rl_calloc(3 * n, sizeof *line);
    char *none = rl_calloc(n, 1), *line_doubt = rl_calloc(n, 1);
    bool ok = light && line && none && line_doubt;
    memset(doubt, 0, n);
    for (size_t i = 0; ok && i < 3 * n; i++) {
        const gaussian_material *m = &materials[s->stencil[i % n]];
        double share = 1;
        for (int g = 0; g < m->n && m->has_profile; g++)
            share -= (double)m->weight[g][i / n];
        light[i] = (double)s->diffuse[i];
        filtered[i] = share * light[i];
    }
    for (int g = 0; ok && g < 4; g++) {
        job whole = {s, materials, light, none}, second = {s, materials, line, line_doubt};
        memset(line_doubt, 0, n);
        if (separable) {
            each_pixel(&whole, g, 1, line, NULL, line_doubt);
            each_pixel(&second, g, 2, NULL, filtered, doubt);
        } else {
            each_pixel(&whole, g, 3, NULL, filtered, doubt);
        }
    }
    rl_free(light);
    rl_free(line);
    rl_free(none);
    rl_free(line_doubt);
    return ok;
}
