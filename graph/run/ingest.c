#include "graph/run/ingest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The loops are built twice, and the processor chooses at load time. AVX2 alone brings no fused multiply-add,
 * so both give the same bits. */
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_THREAD__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

/* Returns how many were clamped. */
WIDE static unsigned scalar_row(float *row, int width, float scale, float offset, float low, float high)
{
    unsigned count = 0;
    for (int x = 0; x < width; x++) {
        float v = row[x] * scale + offset;
        count += (v < low) | (v > high);
        v = v < low ? low : v;
        row[x] = v > high ? high : v;
    }
    return count;
}

uint64_t rl_ingest_scalar(float *plane, rl_rows rows, float scale, float offset, float low, float high)
{
    uint64_t clamped = 0;
    for (int y = rows.y0; y < rows.y1; y++)
        clamped += scalar_row(plane + (size_t)y * rows.stride, rows.width, scale, offset, low, high);
    return clamped;
}

/* ---- depth -----------------------------------------------------------------------------------------------
 */

WIDE static void planar_row(float *row, int width, const rl_layer *layer)
{
    float scale = (float)layer->scale;
    float empty = layer->empty < 3.4e38 ? (float)layer->empty : 3.4e38f, sign = layer->negated ? -1.0f : 1.0f;
    for (int x = 0; x < width; x++) {
        float v = row[x] * sign;
        row[x] = v > 0 && v < empty ? v * scale : 0.0f;
    }
}

/* The length of the view ray of a pixel per unit of planar depth. */
static double ray_slope(const rl_ingest_depth *how, int x, int y)
{
    const camera_t *c = how->camera;
    double px = (double)how->x + x + 0.5 + (double)c->jitter[0],
           py = (double)how->y + y + 0.5 + (double)c->jitter[1];
    double rx = (px - (double)c->centre[0]) / (double)c->focal[0];
    double ry = (py - (double)c->centre[1]) / (double)c->focal[1];
    return sqrt(1 + rx * rx + ry * ry);
}

void rl_ingest_depth_rows(float *plane, rl_rows rows, const rl_ingest_depth *how)
{
    const rl_layer *layer = how->layer;
    for (int y = rows.y0; y < rows.y1; y++) {
        float *row = plane + (size_t)y * rows.stride;
        if (layer->kind == RL_DEPTH_PLANAR) {
            planar_row(row, rows.width, layer);
            continue;
        }
        for (int x = 0; x < rows.width; x++) {
            double slope = layer->kind == RL_DEPTH_RADIAL ? ray_slope(how, x, y) : 1;
            double v = (double)row[x];
            double d = rl_layer_is_empty(layer, v) ? 0 : rl_layer_depth(layer, v, slope);
            row[x] = d > 0 && isfinite(d) ? (float)d : 0.0f;
        }
    }
}

/* ---- motion ----------------------------------------------------------------------------------------------
 */

WIDE static void scale_row(float *row, int width, float scale)
{
    for (int x = 0; x < width; x++)
        row[x] *= scale;
}

void rl_ingest_motion_rows(float *const planes[2], rl_rows rows, const rl_layer *layer, int width, int height)
{
    float unit = layer->motion_unit == RL_MOTION_PIXELS ? 0.0f
                 : layer->motion_unit == RL_MOTION_UV   ? 1.0f
                                                        : 0.5f;
    float sx = unit > 0 ? unit * (float)width : 1.0f, sy = unit > 0 ? unit * (float)height : 1.0f;
    if (layer->points_next) {
        sx = -sx;
        sy = -sy;
    }
    if (layer->y_up)
        sy = -sy;
    for (int y = rows.y0; y < rows.y1; y++) {
        scale_row(planes[0] + (size_t)y * rows.stride, rows.width, sx);
        scale_row(planes[1] + (size_t)y * rows.stride, rows.width, sy);
    }
}

/* ---- normals ---------------------------------------------------------------------------------------------
 */

/* Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors". */
static void octahedral_row(float *x, float *y, float *z, int width)
{
    for (int i = 0; i < width; i++) {
        float u = x[i], v = y[i];
        float w = 1 - fabsf(u) - fabsf(v);
        if (w < 0) {
            float t = u;
            u = (1 - fabsf(v)) * (t < 0 ? -1.0f : 1.0f);
            v = (1 - fabsf(t)) * (v < 0 ? -1.0f : 1.0f);
        }
        x[i] = u;
        y[i] = v;
        z[i] = w;
    }
}

WIDE static void rotate_row(float *x, float *y, float *z, int width, const float *m)
{
    for (int i = 0; i < width; i++) {
        float a = x[i], b = y[i], c = z[i];
        x[i] = m[0] * a + m[1] * b + m[2] * c;
        y[i] = m[3] * a + m[4] * b + m[5] * c;
        z[i] = m[6] * a + m[7] * b + m[8] * c;
    }
}

WIDE static void normalize_row(float *x, float *y, float *z, int width)
{
    for (int i = 0; i < width; i++) {
        float l2 = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
        float s = l2 > 1e-12f ? 1.0f / sqrtf(l2) : 0.0f;
        x[i] *= s;
        y[i] *= s;
        z[i] *= s;
    }
}

const float *rl_ingest_normal_matrix(const rl_layer *layer, const camera_t *camera, bool forward_z,
                                     float m[9])
{
    bool turned = layer->space == RL_SPACE_CAMERA, plain = true;
    for (int i = 0; i < 9; i++) {
        int row = i / 3, axis = i % 3, from = layer->axes[axis];
        float v = turned ? camera->to_world[4 * row + axis] : row == axis ? 1.0f : 0.0f;
        if (turned && axis == 2 && forward_z) /* a capture that looks down +z has its own z turned around */
            v = -v;
        m[3 * row + abs(from) - 1] = from < 0 ? -v : v;
        plain = plain && from == axis + 1;
    }
    return turned || !plain ? m : NULL;
}

void rl_ingest_normal_rows(float *const planes[3], rl_rows rows, const rl_ingest_normal *how)
{
    for (int row = rows.y0; row < rows.y1; row++) {
        size_t at = (size_t)row * rows.stride;
        float *x = planes[0] + at, *y = planes[1] + at, *z = planes[2] + at;
        if (how->encoding == RL_ENCODING_OCTAHEDRAL)
            octahedral_row(x, y, z, rows.width);
        for (int i = 0; how->encoding == RL_ENCODING_UNSIGNED && i < rows.width; i++) {
            x[i] = x[i] * 2 - 1;
            y[i] = y[i] * 2 - 1;
            z[i] = z[i] * 2 - 1;
        }
        if (how->rotate)
            rotate_row(x, y, z, rows.width, how->rotate);
        normalize_row(x, y, z, rows.width);
    }
}

/* ---- stencil ---------------------------------------------------------------------------------------------
 */

/* A stencil id is any 32-bit integer: 4294967295 and -1 are the same pixel value. */
static unsigned find_dense(const rl_materials *m, uint32_t id)
{
    for (int pass = 0; pass < 2; pass++) {
        int64_t wanted = pass ? (int64_t)(int32_t)id : (int64_t)id;
        size_t lo = 0, hi = m->n_ids;
        while (lo < hi) {
            size_t mid = (lo + hi) / 2;
            if (m->ids[mid].id == wanted)
                return m->ids[mid].dense;
            if (m->ids[mid].id < wanted)
                lo = mid + 1;
            else
                hi = mid;
        }
    }
    return m->other;
}

static void count_unknown(rl_unknown_ids *u, uint32_t id, uint64_t pixels)
{
    u->pixels += pixels;
    size_t i = 0;
    while (i < u->n && u->ids[i].id < id)
        i++;
    if (i < u->n && u->ids[i].id == id) {
        u->ids[i].pixels += pixels;
        return;
    }
    if (i == RL_UNKNOWN_IDS)
        return;
    if (u->n < RL_UNKNOWN_IDS)
        u->n++;
    memmove(&u->ids[i + 1], &u->ids[i], (u->n - 1 - i) * sizeof u->ids[0]);
    u->ids[i].id = id;
    u->ids[i].pixels = pixels;
}

void rl_unknown_ids_add(rl_unknown_ids *a, const rl_unknown_ids *b)
{
    uint64_t listed = 0;
    for (size_t i = 0; i < b->n; i++) {
        count_unknown(a, b->ids[i].id, b->ids[i].pixels);
        listed += b->ids[i].pixels;
    }
    a->pixels += b->pixels - listed;
}

void rl_ingest_stencil_rows(uint32_t *plane, const float *depth, rl_rows rows, const rl_materials *materials,
                            rl_unknown_ids *unknown)
{
    uint32_t last_id = 0;
    unsigned last = find_dense(materials, 0);
    for (int y = rows.y0; y < rows.y1; y++) {
        uint32_t *row = plane + (size_t)y * rows.stride;
        const float *z = depth + (size_t)y * rows.stride;
        for (int x = 0; x < rows.width; x++) {
            if (z[x] <= 0) {
                row[x] = 0;
                continue;
            }
            if (row[x] != last_id) {
                last_id = row[x];
                last = find_dense(materials, last_id);
            }
            if (!last)
                count_unknown(unknown, last_id, 1);
            row[x] = last;
        }
    }
}
