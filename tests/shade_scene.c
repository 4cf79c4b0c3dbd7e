#include <math.h>
#include <string.h>

#include "tests/shade_scene.h"

extern const rl_pass rl_pass_lighting;
extern const rl_pass rl_pass_combine;

static const rl_pass *const shading_passes[] = {&rl_pass_lighting, &rl_pass_combine};
static const int planes[LIGHTING_PORTS] = {3, 3, 1, 1, 1, SCENE_LIGHTS, SCENE_LIGHTS, 1, 1, 1, 3, 1, 3, 3, 3};

void shade_camera(camera_t *c, const double *eye, double turn, double tilt)
{
    double ct = cos(turn), st = sin(turn), cx = cos(tilt), sx = sin(tilt);
    double r[3][3] = {{ct, st * sx, st * cx}, {0, cx, -sx}, {-st, ct * sx, ct * cx}};
    for (int i = 0; i < 3; i++) {
        double translation = 0;
        for (int j = 0; j < 3; j++) {
            c->to_world[4 * i + j] = (float)r[i][j];
            c->to_view[4 * i + j] = (float)r[j][i];
            translation -= r[j][i] * eye[j];
        }
        c->to_world[4 * i + 3] = (float)eye[i];
        c->to_view[4 * i + 3] = (float)translation;
    }
}

static void random_unit(uint64_t *seed, float *v)
{
    double z = 2 * shade_random(seed) - 1, phi = 6.283185307179586 * shade_random(seed), r = sqrt(1 - z * z);
    v[0] = (float)(r * cos(phi));
    v[1] = (float)(r * sin(phi));
    v[2] = (float)z;
}

static void set(shade_materials *m, size_t id, const char *group, const char *key, double value)
{
    shade_material_set(m, id, group, key, (double[]){value, value, value});
}

static void make_materials(shade_materials *m, uint64_t *seed)
{
    m->passes = shading_passes;
    m->n_passes = 2;
    for (int i = 0; i < 12; i++) {
        size_t id = shade_material_add(m, i % 4 != 3);
        set(m, id, "profile", "texturing", i & 1);
        set(m, id, "profile", "transmission", i % 4);
        set(m, id, "profile", "thickness_from", i % 3);
        set(m, id, "profile", "transmittance_distance_mm", 2 + i);
        set(m, id, "shading", "diffuse", i % 6 == 4 ? 2 : i / 2 & 1);
        if (i % 3 == 1)
            shade_material_set(m, id, "profile", "sg_variance_mm2", (double[]){30, 4 + i, 1});
        set(m, id, "material", "normal_detail_mm", 0.3 * i);
        set(m, id, "shading", "specular", i % 5 == 4);
        set(m, id, "shading", "exit_transmission", i / 3 & 1);
        shade_material_set(m, id, "profile", "scatter_distance_mm", (double[]){3, 1.2 + i, 0.7});
        shade_material_set(m, id, "profile", "transmittance_color", (double[]){0.9, 0.5, 0.05 * (i + 1)});
        if (i % 2)
            set(m, id, "material", "roughness", shade_random(seed));
        if (i % 3 == 1)
            set(m, id, "material", "specular", shade_random(seed));
        if (i % 5 == 2)
            set(m, id, "material", "metallic", shade_random(seed));
    }
    /* One without a profile that nevertheless asks for transmission: it must stay opaque. */
    set(m, shade_material_add(m, false), "profile", "transmission", 2);
}

static void make_lights(light_t *lights, uint64_t *seed)
{
    for (int i = 0; i < SCENE_LIGHTS; i++) {
        lights[i].type = i % 3;
        for (int c = 0; c < 3; c++) {
            lights[i].position[c] = (float)(2 * shade_random(seed) - 1);
            lights[i].intensity[c] = (float)(0.2 + 3 * shade_random(seed));
        }
        random_unit(seed, lights[i].direction);
        lights[i].cos_inner = 0.8f;
        lights[i].cos_outer = -0.2f;
        lights[i].shadow = i == 3 ? -1 : i;
        lights[i].shadow_thickness = i == 2 ? -1 : i;
    }
}

static void make_pixel(const shade_scene *s, int x, int y, uint64_t *seed)
{
    const frame_t *f = &s->frame;
    float n[3];
    random_unit(seed, n);
    for (int c = 0; c < 3; c++) {
        *shade_at(&s->images[LIGHTING_ALBEDO], f, c, x, y) = (float)shade_random(seed);
        *shade_at(&s->images[LIGHTING_NORMAL], f, c, x, y) = n[c];
        *shade_at(&s->images[LIGHTING_EMISSION], f, c, x, y) = (float)shade_random(seed);
    }
    for (int port = LIGHTING_ROUGHNESS; port <= LIGHTING_METALLIC; port++)
        *shade_at(&s->images[port], f, 0, x, y) = (float)shade_random(seed);
    *shade_at(&s->images[LIGHTING_DEPTH], f, 0, x, y) = (float)(0.4 + 1.2 * shade_random(seed));
    double thickness = 0.01 * shade_random(seed);
    *shade_at(&s->images[LIGHTING_THICKNESS], f, 0, x, y) = (float)(shade_random(seed) < 0.3 ? 0 : thickness);
    for (int l = 0; l < SCENE_LIGHTS; l++) {
        double dark = shade_random(seed), occluder = 0.02 * shade_random(seed);
        *shade_at(&s->images[LIGHTING_SHADOW], f, l, x, y) = (float)(dark < 0.3 ? 0 : dark);
        *shade_at(&s->images[LIGHTING_SHADOW_THICKNESS], f, l, x, y) = (float)(dark < 0.7 ? occluder : 0);
    }
    float smooth[3];
    random_unit(seed, smooth);
    for (int c = 0; c < 3; c++)
        *shade_at(&s->images[LIGHTING_SMOOTH_NORMAL], f, c, x, y) = smooth[c];
    double bend = shade_random(seed) - 0.3; /* radii of 0.4 mm to 1 m, hollows, planes */
    *shade_at(&s->images[LIGHTING_CURVATURE], f, 0, x, y) =
        (float)(bend < -0.2 ? 0 : 2000 * bend * bend * bend);
    int patch = (x / 7) * 31 + (y / 5) * 17;
    uint32_t id = patch % 8 == 0 || shade_random(seed) < 1.0 / 16 ? 0 : 1 + (uint32_t)(patch % 13);
    shade_set_id(&s->images[LIGHTING_STENCIL], f, x, y, id);
}

bool shade_scene_make(shade_scene *s, int w, int h, int x0, int y0, uint64_t seed)
{
    bool ok = true;
    memset(s, 0, sizeof *s);
    s->frame = shade_frame(w, h, x0, y0);
    s->frame.lights = SCENE_LIGHTS;
    camera_t *c = &s->frame.camera;
    shade_camera(c, (double[]){0.3, -0.2, 0.9}, 0.4, -0.3);
    c->focal[0] = 1.7f * (float)w;
    c->focal[1] = 1.6f * (float)w;
    c->centre[0] = (float)x0 + 0.45f * (float)w;
    c->centre[1] = (float)y0 + 0.6f * (float)h;
    c->jitter[0] = 0.25f;
    c->jitter[1] = -0.375f;
    for (int i = 0; i < LIGHTING_PORTS; i++) {
        s->images[i] = shade_image_new(&s->frame, planes[i]);
        ok = ok && s->images[i].data;
    }
    s->color = shade_image_new(&s->frame, 3);
    if (!ok || !s->color.data)
        return false;
    make_materials(&s->materials, &seed);
    s->frame.materials = (int)s->materials.n;
    make_lights(s->lights, &seed);
    for (int y = s->frame.valid[1]; y < s->frame.valid[3]; y++)
        for (int x = s->frame.valid[0]; x < s->frame.valid[2]; x++)
            make_pixel(s, x, y, &seed);
    return true;
}

void shade_scene_free(shade_scene *s)
{
    for (int i = 0; i < LIGHTING_PORTS; i++)
        shade_image_free(&s->images[i]);
    shade_image_free(&s->color);
}

shade_run shade_scene_lighting(const shade_scene *s)
{
    shade_run run = {
        .pass = &rl_pass_lighting, .frame = s->frame, .materials = &s->materials, .lights = s->lights};
    for (int i = 0; i < LIGHTING_PORTS; i++)
        run.images[i] = &s->images[i];
    return run;
}

shade_run shade_scene_combine(const shade_scene *s)
{
    static const int from[] = {LIGHTING_DIFFUSE, LIGHTING_LIT,   LIGHTING_ALBEDO,
                               LIGHTING_NORMAL,  LIGHTING_DEPTH, LIGHTING_STENCIL};
    shade_run run = {.pass = &rl_pass_combine, .frame = s->frame, .materials = &s->materials};
    for (int i = 0; i < COMBINE_COLOR; i++)
        run.images[i] = &s->images[from[i]];
    run.images[COMBINE_COLOR] = &s->color;
    return run;
}

void shade_fill(const shade_image *image, const frame_t *f, const double *value)
{
    for (int p = 0; p < image->planes; p++)
        for (int y = f->valid[1]; y < f->valid[3]; y++)
            for (int x = f->valid[0]; x < f->valid[2]; x++)
                *shade_at(image, f, p, x, y) = (float)value[p < 3 ? p : 2];
}
