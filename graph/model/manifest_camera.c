/* The camera of a manifest. */
#include "graph/model/manifest_parts.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool is_header(const rl_value *v)
{
    return !v || (v->kind == RL_TEXT && !strcmp(v->text, "header"));
}

/* Affine, and a rotation (or mirror) with a shift: relit measures lengths in view space, so a scale in the
 * matrix would scale them. `what` names the matrix. */
static rl_code check_matrix(const double *m, rl_where where, const char *what, rl_code code, rl_error *err)
{
    /* Arnold writes 1.0000001 there */
    if (!(fabs(m[12]) <= 1e-5 && fabs(m[13]) <= 1e-5 && fabs(m[14]) <= 1e-5 && fabs(m[15] - 1) <= 1e-5))
        return rl_fail(
            err, code, where,
            "%s: the last row must be 0, 0, 0, 1 (rows listed, for column vectors; a matrix for row "
            "vectors is the transpose)",
            what);
    for (int i = 0; i < 3; i++) {
        for (int k = i; k < 3; k++) {
            double dot = m[4 * i] * m[4 * k] + m[4 * i + 1] * m[4 * k + 1] + m[4 * i + 2] * m[4 * k + 2];
            if (!(fabs(dot - (i == k)) <= 1e-3))
                return rl_fail(
                    err, code, where,
                    "%s must rotate and shift only: rows %d and %d of its 3x3 have the dot product %.6g",
                    what, i + 1, k + 1, dot);
        }
    }
    return RL_OK;
}

static rl_code read_matrix(rl_manifest_reader *r, const rl_value *v)
{
    rl_camera_spec *c = &r->m->camera;
    if (is_header(v))
        return RL_OK;
    bool list = v->kind == RL_LIST && v->n > 0 && v->items[0]->kind == RL_LIST;
    size_t n = list ? v->n : 1;
    c->matrix = rl_arena_array(r->arena, n, sizeof *c->matrix);
    if (!c->matrix)
        return rl_fail_memory(r->err, n * sizeof *c->matrix);
    if (v->kind != RL_LIST)
        return rl_value_wrong(v, "matrix", "header, a list of 16 numbers, or a list of such lists", r->err);
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++) {
        const rl_value *one = list ? v->items[i] : v;
        code = rl_value_numbers(one, "matrix", 16, c->matrix[i], r->err);
        if (!code)
            code = check_matrix(c->matrix[i], one->where, "'matrix'", RL_E_CONFIG, r->err);
    }
    c->matrix_source = list ? RL_SOURCE_LIST : RL_SOURCE_ONE;
    c->n_matrix = n;
    return code;
}

static rl_code read_fov(rl_manifest_reader *r, const rl_value *v)
{
    rl_camera_spec *c = &r->m->camera;
    if (is_header(v))
        return RL_OK;
    bool list = v->kind == RL_LIST;
    size_t n = list ? v->n : 1;
    if (v->kind != RL_NUMBER && !(list && n))
        return rl_value_wrong(v, "fov_x", "header, degrees, or a list of degrees", r->err);
    c->fov_x = rl_arena_array(r->arena, n, sizeof *c->fov_x);
    if (!c->fov_x)
        return rl_fail_memory(r->err, n * sizeof *c->fov_x);
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++) {
        code = rl_value_number(list ? v->items[i] : v, "fov_x", 0.001, 179.9, &c->fov_x[i], r->err);
        c->fov_x[i] *= 3.14159265358979323846 / 180;
    }
    c->fov_source = list ? RL_SOURCE_LIST : RL_SOURCE_ONE;
    c->n_fov = n;
    return code;
}

static rl_code read_jitter(rl_manifest_reader *r, const rl_value *v)
{
    rl_camera_spec *c = &r->m->camera;
    if (is_header(v))
        return RL_OK;
    bool list = v->kind == RL_LIST && v->n > 0 && v->items[0]->kind == RL_LIST;
    size_t n = list ? v->n : 1;
    if (v->kind != RL_LIST)
        return rl_value_wrong(v, "jitter", "header, [x, y], or a list of such pairs", r->err);
    c->jitter = rl_arena_array(r->arena, n, sizeof *c->jitter);
    if (!c->jitter)
        return rl_fail_memory(r->err, n * sizeof *c->jitter);
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++)
        code = rl_value_numbers(list ? v->items[i] : v, "jitter", 2, c->jitter[i], r->err);
    c->jitter_source = list ? RL_SOURCE_LIST : RL_SOURCE_ONE;
    c->n_jitter = n;
    return code;
}

rl_code rl_manifest_read_camera(rl_manifest_reader *r, const rl_value *v)
{
    static const char *const known[] = {"matrix", "forward", "fov_x", "jitter", "shift"};
    rl_camera_spec *c = &r->m->camera;
    bool own = v && !(r->preset_file && v->where.file && !strcmp(v->where.file, r->preset_file));
    c->where = own ? v->where : r->m->where; /* a preset is no place to correct what a capture lacks */
    rl_code code = v ? rl_value_keys(v, "camera", known, 5, r->err) : RL_OK;
    const rl_value *forward = rl_value_get(v, "forward");
    int word = 0;
    if (!forward)
        rl_report(r->log, RL_NOTE, c->where, "camera: 'forward' is not given; assuming -z");
    if (!code && forward)
        code = rl_value_word(forward, "forward", "-z|+z", &word, r->err);
    c->forward_z = word == 1;
    const rl_value *shift = rl_value_get(v, "shift");
    c->has_shift = !is_header(shift);
    if (!code && c->has_shift)
        code = rl_value_numbers(shift, "shift", 2, c->shift, r->err);
    if (!code)
        code = read_matrix(r, rl_value_get(v, "matrix"));
    if (!code)
        code = read_fov(r, rl_value_get(v, "fov_x"));
    return code ? code : read_jitter(r, rl_value_get(v, "jitter"));
}

/* The element of one or many that is for a frame. */
static size_t element(const rl_manifest *m, rl_source source, int frame)
{
    long i = source == RL_SOURCE_LIST ? rl_frames_find(&m->frames, frame) : 0;
    return i < 0 ? 0 : (size_t)i;
}

rl_code rl_manifest_view(const rl_manifest *m, int frame, const float *header, double out[12], rl_error *err)
{
    const rl_camera_spec *c = &m->camera;
    double w[16];
    if (c->matrix_source == RL_SOURCE_HEADER && !header)
        return rl_fail(
            err, RL_E_FORMAT, c->where,
            "frame %d: the file has no attribute worldToCamera; give camera.matrix: 16 numbers, world to "
            "camera, rows listed, for column vectors (how to get them: configs/captures.md)",
            frame);
    for (int i = 0; i < 16; i++) /* the header's is for row vectors: its transpose */
        w[i] = c->matrix_source == RL_SOURCE_HEADER ? (double)header[4 * (i % 4) + i / 4]
                                                    : c->matrix[element(m, c->matrix_source, frame)][i];
    char what[80];
    snprintf(what, sizeof what, "frame %d: worldToCamera (as column vectors)", frame);
    rl_code code = check_matrix(w, c->where, what, RL_E_FORMAT, err);
    for (int i = 0; i < 12 && !code; i++) {
        bool shift = i % 4 == 3, mirrored = c->forward_z && i >= 8; /* view looks down -z */
        out[i] = w[i] * (shift ? m->unit : 1) * (mirrored ? -1 : 1);
        if (!isfinite(out[i]))
            code =
                rl_fail(err, RL_E_FORMAT, c->where, "frame %d: the camera's position is not finite", frame);
    }
    return code;
}

const double *rl_manifest_fov_x(const rl_manifest *m, int frame)
{
    const rl_camera_spec *c = &m->camera;
    return c->fov_source == RL_SOURCE_HEADER ? NULL : &c->fov_x[element(m, c->fov_source, frame)];
}

const double *rl_manifest_jitter(const rl_manifest *m, int frame)
{
    const rl_camera_spec *c = &m->camera;
    return c->jitter_source == RL_SOURCE_HEADER ? NULL : c->jitter[element(m, c->jitter_source, frame)];
}
