#include "graph/run/camera_header.h"

#include <math.h>
#include <string.h>

#include "graph/base/text.h"

static const double pi = 3.14159265358979323846;

static bool numbers_of(const rl_exr *file, int part, const char *name, int n, double *out)
{
    rl_exr_value v;
    if (!rl_exr_attr(file, part, name, &v) || rl_exr_type_numbers(v.type) != n)
        return false;
    memcpy(out, v.v, (size_t)n * sizeof *out);
    return true;
}

/* Of this part, else of any: some writers put what is common to all parts into the first alone. */
static bool numbers(const rl_exr *file, int part, const char *name, int n, double *out)
{
    bool has = numbers_of(file, part, name, n, out);
    for (int p = 0; !has && p < rl_exr_parts(file); p++)
        has = numbers_of(file, p, name, n, out);
    return has;
}

/* A string attribute of Unreal's that ends in `tail`; the layer's name stands in the middle of it. The name
 * that was found, or NULL. */
static const char *unreal_number(const rl_exr *file, int part, const char *tail, double *out)
{
    for (size_t i = 0; i < rl_exr_part_at(file, part)->n_attrs; i++) {
        const char *name;
        rl_exr_value v;
        rl_exr_attr_at(file, part, i, &name, NULL, &v);
        size_t n = strlen(name), m = strlen(tail);
        if (strncmp(name, "unreal/", 7) || n < m || strcmp(name + n - m, tail))
            continue;
        if (v.type == RL_EXR_T_STRING && v.text && rl_parse_double(v.text, out))
            return name;
        if (rl_exr_type_numbers(v.type) == 1) {
            *out = v.v[0];
            return name;
        }
    }
    return NULL;
}

/* Row vectors: the columns are the camera's axes, the last row what moves the camera to the origin. */
static void look(double right[3], double up[3], double ahead[3], const double at[3], bool forward_z,
                 double out[16])
{
    double sign = forward_z ? 1 : -1;
    for (int i = 0; i < 3; i++) {
        out[4 * i] = right[i];
        out[4 * i + 1] = up[i];
        out[4 * i + 2] = sign * ahead[i];
        out[4 * i + 3] = 0;
    }
    for (int k = 0; k < 3; k++)
        out[12 + k] = -(at[0] * out[k] + at[1] * out[4 + k] + at[2] * out[8 + k]);
    out[15] = 1;
}

/* V-Ray's cameraTransform leads from the camera to the world, for row vectors; the camera looks along its -y
 * and its up is -z (seen in files of V-Ray 3.60 for Maya). */
static bool vray_matrix(const rl_exr *file, int part, bool forward_z, double out[16])
{
    double m[16];
    if (!numbers(file, part, "cameraTransform", 16, m))
        return false;
    double up[3] = {-m[8], -m[9], -m[10]}, ahead[3] = {-m[4], -m[5], -m[6]};
    look(m, up, ahead, m + 12, forward_z, out);
    return true;
}

/* Unreal: x ahead, y right, z up, left-handed; yaw turns x to y, pitch lifts x, roll tips z to y; degrees. */
static bool unreal_matrix(const rl_exr *file, int part, bool forward_z, double out[16])
{
    static const char *const tails[] = {"/curPos/x",     "/curPos/y",   "/curPos/z",
                                        "/curRot/pitch", "/curRot/yaw", "/curRot/roll"};
    double v[6];
    for (int i = 0; i < 6; i++)
        if (!unreal_number(file, part, tails[i], &v[i]))
            return false;
    double c[3], s[3];
    for (int i = 0; i < 3; i++) {
        c[i] = cos(v[3 + i] * pi / 180);
        s[i] = sin(v[3 + i] * pi / 180);
    }
    double ahead[3] = {c[0] * c[1], c[0] * s[1], s[0]};
    double right[3] = {s[2] * s[0] * c[1] - c[2] * s[1], s[2] * s[0] * s[1] + c[2] * c[1], -s[2] * c[0]};
    double up[3] = {-(c[2] * s[0] * c[1] + s[2] * s[1]), c[1] * s[2] - c[2] * s[0] * s[1], c[2] * c[0]};
    look(right, up, ahead, v, forward_z, out);
    return true;
}

const char *rl_camera_header_matrix(const rl_exr *file, int part, bool forward_z, double out[16])
{
    if (numbers(file, part, "worldToCamera", 16, out))
        return "worldToCamera";
    if (vray_matrix(file, part, forward_z, out))
        return "cameraTransform";
    return unreal_matrix(file, part, forward_z, out) ? "unreal/.../curPos" : NULL;
}

/* worldToNDC is worldToCamera, a projection, and a division by w. With the camera's axes X, Y, Z (columns),
 * its columns are x: a X + b Z, y: c Y + d Z, w: s Z; so x/w = (a x + b z) / (s z). The image goes from -1 to
 * 1 (Arnold, Mantra) or, as OpenEXR's standard attributes say, from 0 to 1: which of the two, its middle
 * tells. */
static bool ndc_lens(const rl_exr *file, int part, bool forward_z, rl_camera_lens *out)
{
    double camera[16], ndc[16], along[2][2] = {{0}}, s = 0;
    if (!numbers(file, part, "worldToCamera", 16, camera) || !numbers(file, part, "worldToNDC", 16, ndc))
        return false;
    for (int k = 0; k < 3; k++) {
        double z = camera[4 * k + 2];
        for (int axis = 0; axis < 2; axis++) {
            along[axis][0] += ndc[4 * k + axis] * camera[4 * k + axis];
            along[axis][1] += ndc[4 * k + axis] * z;
        }
        s += ndc[4 * k + 3] * z;
    }
    if (!(fabs(s) > 1e-6) || !(fabs(along[0][0]) > 1e-6) || !(fabs(along[1][0]) > 1e-6))
        return false;
    double middle = fabs(along[0][1] / s) > 0.25 ? 0.5 : 0, half = middle > 0 ? 0.5 : 1;
    for (int k = 0; k < 4; k++) /* anything else in the matrices: not this kind of camera */
        if (fabs(ndc[4 * k] - along[0][0] * camera[4 * k] - along[0][1] * camera[4 * k + 2]) >
                1e-3 * (1 + fabs(ndc[4 * k])) ||
            fabs(ndc[4 * k + 3] - s * camera[4 * k + 2]) > 1e-3 * (1 + fabs(ndc[4 * k + 3])))
            return false;
    out->width = 2 * half * fabs(s / along[0][0]);
    for (int axis = 0; axis < 2; axis++)
        out->centre[axis] = (middle * s - along[axis][1]) / along[axis][0] * (forward_z ? 1 : -1);
    return true;
}

void rl_camera_header_lens(const rl_exr *file, int part, bool forward_z, rl_camera_lens *out)
{
    const rl_exr_part *p = rl_exr_part_at(file, part);
    double degrees;
    const char *name = "cameraFov";
    *out = (rl_camera_lens){.width = (double)p->screen_width,
                            .centre = {(double)p->screen_center[0], (double)p->screen_center[1]}};
    if (numbers(file, part, "camera:fovx", 1, &out->fov_x)) {
        out->source = "camera:fovx";
    } else if (ndc_lens(file, part, forward_z, out)) {
        out->source = "worldToNDC";
    } else if (numbers(file, part, name, 1, &degrees) ||
               (name = unreal_number(file, part, "/fov", &degrees))) {
        out->source = name;
        out->fov_x = degrees * pi / 180;
    } else {
        out->source = "screenWindowWidth";
    }
}

rl_code rl_camera_read(const rl_manifest *m, int frame, const rl_exr *file, int part, rl_camera_info *out,
                       rl_camera_lens *lens, bool *has_jitter, rl_error *err)
{
    const rl_exr_part *p = rl_exr_part_at(file, part);
    const double *fov = rl_manifest_fov_x(m, frame), *jitter = rl_manifest_jitter(m, frame);
    double header[16];
    float row_vectors[16];
    const char *from = rl_camera_header_matrix(file, part, m->camera.forward_z, header);
    for (int i = 0; i < 16 && from; i++)
        row_vectors[i] = (float)header[i];
    rl_camera_header_lens(file, part, m->camera.forward_z, lens);
    *out = (rl_camera_info){.fov_x = fov ? *fov : lens->fov_x,
                            .screen_width = fov ? (double)p->screen_width : lens->width,
                            .pixel_aspect = (double)p->pixel_aspect,
                            .display = {p->display_window.x0, p->display_window.y0,
                                        p->display_window.x1 - p->display_window.x0 + 1,
                                        p->display_window.y1 - p->display_window.y0 + 1}};
    for (int i = 0; i < 2; i++)
        out->screen_center[i] = fov ? (double)p->screen_center[i] : lens->centre[i];
    double window = out->screen_width > 0 ? out->screen_width : 2 * tan(out->fov_x / 2);
    for (int i = 0; i < 2 && m->camera.has_shift; i++)
        out->screen_center[i] = m->camera.shift[i] * window;
    *has_jitter = jitter != NULL;
    if (jitter)
        memcpy(out->jitter, jitter, sizeof out->jitter);
    else
        *has_jitter = numbers(file, part, "camera:jitter", 2, out->jitter);
    return rl_manifest_view(m, frame, from ? row_vectors : NULL, out->view, err);
}
