#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/foreign_scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Distance along the ray (whose part ahead is 1) of the floor (z = 0) or the ball, or 0. */
static double hit(const double o[3], const double d[3], double n[3], uint32_t *id)
{
    static const double centre[3] = {0.3, 0.2, 0.5}, radius = 0.5;
    double t = d[2] < 0 ? -o[2] / d[2] : 0, c[3] = {o[0] - centre[0], o[1] - centre[1], o[2] - centre[2]};
    double a = dot(d, d), b = dot(c, d), under = b * b - a * (dot(c, c) - radius * radius);
    double ball = under > 0 ? (-b - sqrt(under)) / a : 0;
    n[0] = n[1] = 0;
    n[2] = 1;
    *id = t > 0 && t < 9;
    if (!(ball > 0) || (*id && ball > t))
        return *id ? t : 0;
    for (int i = 0; i < 3; i++)
        n[i] = (c[i] + ball * d[i]) / radius;
    *id = 2;
    return ball;
}

foreign_scene *foreign_scene_new(double shift)
{
    foreign_scene *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->yaw = 72;
    s->pitch = -18;
    s->fov_x = 0.8;
    s->shift = shift;
    const double at[3] = {-0.6, -2.4, 1.3}, y = s->yaw * pi / 180, p = s->pitch * pi / 180;
    const double ahead[3] = {cos(p) * cos(y), cos(p) * sin(y), sin(p)}, right[3] = {sin(y), -cos(y), 0};
    for (int i = 0; i < 3; i++) {
        s->position[i] = at[i];
        s->ahead[i] = ahead[i];
        s->right[i] = right[i];
    }
    for (int i = 0; i < 3; i++)
        s->up[i] = right[(i + 1) % 3] * ahead[(i + 2) % 3] - right[(i + 2) % 3] * ahead[(i + 1) % 3];
    double focal = FOREIGN_WIDTH / 2.0 / tan(s->fov_x / 2);
    for (int k = 0; k < FOREIGN_PIXELS; k++) {
        double x = (k % FOREIGN_WIDTH + 0.5 - FOREIGN_WIDTH / 2.0 + shift * FOREIGN_WIDTH) / focal;
        double v = -(k / FOREIGN_WIDTH + 0.5 - FOREIGN_HEIGHT / 2.0) / focal, d[3], n[3];
        for (int i = 0; i < 3; i++)
            d[i] = s->ahead[i] + x * s->right[i] + v * s->up[i];
        double t = hit(at, d, n, &s->id[k]);
        s->depth[k] = t > 0 ? (float)t : 1e10f;
        for (int i = 0; i < 3 && t > 0; i++) {
            s->normal[i][k] = (float)n[i];
            s->world[i][k] = (float)(at[i] + t * d[i]);
            s->albedo[i][k] = s->id[k] == 2 ? 0.7f - 0.2f * (float)i : 0.5f;
        }
    }
    return s;
}

void foreign_matrix(const foreign_scene *s, double ahead, double out[16])
{
    for (int i = 0; i < 3; i++) {
        out[4 * i] = s->right[i];
        out[4 * i + 1] = s->up[i];
        out[4 * i + 2] = ahead * s->ahead[i];
        out[4 * i + 3] = 0;
    }
    out[12] = -dot(s->position, s->right);
    out[13] = -dot(s->position, s->up);
    out[14] = -ahead * dot(s->position, s->ahead);
    out[15] = 1;
}

void foreign_point(foreign_kind kind, const double metres[3], double out[3])
{
    double unit = kind == FOREIGN_UNREAL ? 100 : 1;
    for (int i = 0; i < 3; i++)
        out[i] = metres[i] * unit * (kind == FOREIGN_UNREAL && i == 1 ? -1 : 1);
}

/* ---- files -----------------------------------------------------------------------------------------------
 */

/* A file in the making; planes that are not the scene's own are freed at the end. */
typedef struct writer {
    rl_exr_source channels[32];
    int x, y; /* of the windows */
    size_t n, n_planes, n_attrs, n_texts;
    float *planes[32];
    rl_exr_attribute attrs[16];
    char texts[8][32];
} writer;

static void channel(writer *w, const char *name, const float *floats, const uint32_t *ids)
{
    w->channels[w->n++] = (rl_exr_source){.name = name,
                                          .type = ids ? RL_EXR_UINT : RL_EXR_FLOAT,
                                          .floats = floats,
                                          .ids = ids,
                                          .stride = FOREIGN_WIDTH};
}

static float *plane(writer *w)
{
    w->planes[w->n_planes] = calloc(FOREIGN_PIXELS, sizeof(float));
    assert_non_null(w->planes[w->n_planes]);
    return w->planes[w->n_planes++];
}

/* Three channels: v * scale + offset. */
static void triple(writer *w, const char *const names[3], const float v[3][FOREIGN_PIXELS],
                   const float scale[3], float offset)
{
    for (int i = 0; i < 3; i++) {
        float *p = plane(w);
        for (int k = 0; k < FOREIGN_PIXELS; k++)
            p[k] = v[i][k] * scale[i] + offset;
        channel(w, names[i], p, NULL);
    }
}

static void attr_numbers(writer *w, const char *name, rl_exr_type type, const double *v, int n)
{
    rl_exr_attribute *a = &w->attrs[w->n_attrs++];
    *a = (rl_exr_attribute){name, {.type = type}};
    memcpy(a->value.v, v, (size_t)n * sizeof *v);
}

static void attr_text(writer *w, const char *name, const char *text)
{
    w->attrs[w->n_attrs++] = (rl_exr_attribute){name, {.type = RL_EXR_T_STRING, .text = text}};
}

static void attr_number_text(writer *w, const char *name, double v)
{
    char *text = w->texts[w->n_texts++];
    snprintf(text, sizeof w->texts[0], "%.9g", v);
    attr_text(w, name, text);
}

/* Ids as Cryptomatte has them: 0x12ea3e7c is the ball, 0xcb432898 (a negative float) the floor. */
static void cryptomatte(writer *w, const foreign_scene *s, const char *name, const char *layer)
{
    static const uint32_t hashes[3] = {0, 0xcb432898u, 0x12ea3e7cu};
    float *p = plane(w);
    for (int k = 0; k < FOREIGN_PIXELS; k++)
        memcpy(&p[k], &hashes[s->id[k]], sizeof *p);
    channel(w, name, p, NULL);
    attr_text(w, "cryptomatte/c7dbf5e/name", layer);
    attr_text(w, "cryptomatte/c7dbf5e/manifest",
              "{\"floor\":\"cb432898\",\"red ball\":\"12ea3e7c\",\"elsewhere\":\"4159b52a\"}");
}

static const float plain[3] = {1, 1, 1};

static void write_relit(writer *w, const foreign_scene *s)
{
    double m[16];
    triple(w, (const char *[]){"albedo.R", "albedo.G", "albedo.B"}, s->albedo, plain, 0);
    triple(w, (const char *[]){"normal.X", "normal.Y", "normal.Z"}, s->normal, plain, 0);
    channel(w, "depth.Z", s->depth, NULL);
    channel(w, "stencil.ID", NULL, s->id);
    foreign_matrix(s, -1, m);
    attr_numbers(w, "worldToCamera", RL_EXR_T_M44F, m, 16);
    attr_numbers(w, "camera:fovx", RL_EXR_T_FLOAT, &s->fov_x, 1);
}

static void write_blender(writer *w, const foreign_scene *s)
{
    triple(w, (const char *[]){"L.DiffCol.R", "L.DiffCol.G", "L.DiffCol.B"}, s->albedo, plain, 0);
    triple(w, (const char *[]){"L.Normal.X", "L.Normal.Y", "L.Normal.Z"}, s->normal, plain, 0);
    triple(w, (const char *[]){"L.Position.X", "L.Position.Y", "L.Position.Z"}, s->world, plain, 0);
    channel(w, "L.Depth.Z", s->depth, NULL);
    cryptomatte(w, s, "L.CryptoMaterial00.r", "L.CryptoMaterial");
}

static void write_arnold(writer *w, const foreign_scene *s)
{
    double m[16], ndc[16];
    triple(w, (const char *[]){"diffuse_albedo.R", "diffuse_albedo.G", "diffuse_albedo.B"}, s->albedo, plain,
           0);
    triple(w, (const char *[]){"N.X", "N.Y", "N.Z"}, s->normal, plain, 0);
    channel(w, "Z", s->depth, NULL);
    channel(w, "ID", NULL, s->id);
    foreign_matrix(s, 1, m);
    double f = 1 / tan(s->fov_x / 2);
    for (int k = 0; k < 4; k++) { /* -1..1; depth of no use here */
        ndc[4 * k] = f * m[4 * k] - 2 * s->shift * m[4 * k + 2];
        ndc[4 * k + 1] = f * FOREIGN_WIDTH / FOREIGN_HEIGHT * m[4 * k + 1];
        ndc[4 * k + 2] = ndc[4 * k + 3] = m[4 * k + 2];
    }
    m[15] = 1.0000001;
    attr_numbers(w, "worldToCamera", RL_EXR_T_M44F, m, 16);
    attr_numbers(w, "worldToNDC", RL_EXR_T_M44F, ndc, 16);
}

static void write_unreal(writer *w, const foreign_scene *s)
{
    static const float mirrored[3] = {0.5f, -0.5f, 0.5f};
    double at[3];
    triple(w, (const char *[]){"FinalImageBaseColor.R", "FinalImageBaseColor.G", "FinalImageBaseColor.B"},
           s->albedo, plain, 0);
    triple(w,
           (const char *[]){"FinalImageWorldNormal.R", "FinalImageWorldNormal.G", "FinalImageWorldNormal.B"},
           s->normal, mirrored, 0.5f);
    float *z = plane(w);
    for (int k = 0; k < FOREIGN_PIXELS; k++)
        z[k] = s->id[k] ? s->depth[k] * 100 : INFINITY;
    channel(w, "FinalImageMovieRenderQueue_WorldDepth.R", z, NULL);
    cryptomatte(w, s, "ActorHitProxyMask00.R", "ActorHitProxyMask");
    foreign_point(FOREIGN_UNREAL, s->position, at);
    attr_number_text(w, "unreal/camera/curPos/x", at[0]);
    attr_number_text(w, "unreal/camera/curPos/y", at[1]);
    attr_number_text(w, "unreal/camera/curPos/z", at[2]);
    attr_number_text(w, "unreal/camera/curRot/pitch", s->pitch);
    attr_number_text(w, "unreal/camera/curRot/yaw", -s->yaw);
    attr_number_text(w, "unreal/camera/curRot/roll", 0);
    attr_number_text(w, "unreal/camera/FinalImage/fov", s->fov_x * 180 / pi);
}

static void write_pbrt(writer *w, const foreign_scene *s)
{
    double m[16];
    float *n[3], *p[3];
    foreign_matrix(s, 1, m);
    triple(w, (const char *[]){"Albedo.R", "Albedo.G", "Albedo.B"}, s->albedo, plain, 0);
    for (int i = 0; i < 3; i++) {
        n[i] = plane(w);
        p[i] = plane(w);
        for (int k = 0; k < FOREIGN_PIXELS; k++) {
            for (int j = 0; j < 3; j++) {
                n[i][k] += s->normal[j][k] * (float)m[4 * j + i];
                p[i][k] += s->world[j][k] * (float)m[4 * j + i];
            }
            p[i][k] = s->id[k] ? p[i][k] + (float)m[12 + i] : 0;
        }
        channel(w, (const char *[]){"Ns.X", "Ns.Y", "Ns.Z"}[i], n[i], NULL);
        channel(w, (const char *[]){"P.X", "P.Y", "P.Z"}[i], p[i], NULL);
    }
    attr_numbers(w, "worldToCamera", RL_EXR_T_M44F, m, 16);
    attr_numbers(w, "camera:fovx", RL_EXR_T_FLOAT, &s->fov_x, 1);
}

static void write_vray(writer *w, const foreign_scene *s)
{
    double m[16] = {[15] = 1}, degrees = s->fov_x * 180 / pi;
    triple(w, (const char *[]){"VRayDiffuseFilter.R", "VRayDiffuseFilter.G", "VRayDiffuseFilter.B"},
           s->albedo, plain, 0);
    triple(w, (const char *[]){"VRaySamplerInfo.X", "VRaySamplerInfo.Y", "VRaySamplerInfo.Z"}, s->normal,
           plain, 0);
    channel(w, "Z", s->depth, NULL);
    cryptomatte(w, s, "VRayCryptomatte00.R", "VRayCryptomatte");
    for (int i = 0; i < 3; i++) {
        m[i] = s->right[i];
        m[4 + i] = -s->ahead[i];
        m[8 + i] = -s->up[i];
        m[12 + i] = s->position[i];
    }
    attr_numbers(w, "cameraTransform", RL_EXR_T_M44F, m, 16);
    attr_numbers(w, "cameraFov", RL_EXR_T_FLOAT, &degrees, 1);
}

static void write_unknown(writer *w, const foreign_scene *s)
{
    double m[16];
    triple(w, (const char *[]){"base_color.red", "base_color.green", "base_color.blue"}, s->albedo, plain, 0);
    triple(w, (const char *[]){"WorldNormal.x", "WorldNormal.y", "WorldNormal.z"}, s->normal, plain, 0);
    channel(w, "zdepth", s->depth, NULL);
    foreign_matrix(s, 1, m);
    attr_numbers(w, "worldToCamera", RL_EXR_T_M44F, m, 16);
    attr_numbers(w, "camera:fovx", RL_EXR_T_FLOAT, &s->fov_x, 1);
}

/* Writes and frees what is in the making. */
static void finish(const char *path, writer *w)
{
    rl_error err = {0};
    rl_exr_box at = {w->x, w->y, w->x + FOREIGN_WIDTH - 1, w->y + FOREIGN_HEIGHT - 1};
    rl_exr_image image = {.data_window = at,
                          .display_window = at,
                          .channels = w->channels,
                          .n_channels = w->n,
                          .compression = RL_EXR_ZIP,
                          .attrs = w->attrs,
                          .n_attrs = w->n_attrs};
    if (rl_exr_write(path, &image, NULL, NULL, &err))
        fail_msg("%s", err.text);
    for (size_t i = 0; i < w->n_planes; i++)
        free(w->planes[i]);
    *w = (writer){0};
}

void foreign_write(const char *path, const foreign_scene *s, foreign_kind kind)
{
    static void (*const writers[])(writer *, const foreign_scene *) = {
        write_relit, write_blender, write_arnold, write_unreal, write_pbrt, write_vray, write_unknown};
    writer w = {.x = s->x, .y = s->y};
    writers[kind](&w, s);
    finish(path, &w);
}

void foreign_write_torn(const char *folder, const foreign_scene *s)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const xyz[] = {"X", "Y", "Z"};
    const struct {
        const char *name, *const *channels;
        const float (*v)[FOREIGN_PIXELS];
    } files[] = {{"my_shot.0007.exr", rgb, s->albedo},
                 {"my_shot_diffuse_albedo.0007.exr", rgb, s->albedo},
                 {"my_shot_N.0007.exr", xyz, s->normal},
                 {"my_shot_P.0007.exr", rgb, s->world},
                 {"my_shot_depth.0007.exr", NULL, NULL}};
    for (int i = 0; i < 5; i++) {
        writer w = {0};
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, files[i].name);
        if (files[i].v)
            triple(&w, files[i].channels, files[i].v, plain, 0);
        else
            channel(&w, "Z", s->depth, NULL);
        finish(path, &w);
    }
}
