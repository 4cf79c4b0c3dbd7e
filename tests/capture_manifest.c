#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/capture_parts.h"

#include <math.h>

#include "tests/tool_run.h"

static void print_numbers(rl_str *y, const double *v, int n)
{
    for (int i = 0; i < n; i++)
        rl_str_printf(y, "%s%.17g", i ? ", " : "[", v[i]);
    rl_str_add(y, "]");
}

static void print_camera(rl_str *y, const capture_form *f, const scene *s, int n)
{
    rl_str_printf(y, "camera:\n  forward: %s\n  matrix: %s", f->forward_z ? "+z" : "-z",
                  f->camera == CAMERA_HEADER ? "header"
                  : f->camera == CAMERA_LIST ? "["
                                             : "");
    for (int i = 0; i < (f->camera == CAMERA_HEADER ? 0 : f->camera == CAMERA_LIST ? n : 1); i++) {
        double m[16];
        capture_matrix(f, &s[i].camera, m);
        rl_str_add(y, i ? ", " : "");
        print_numbers(y, m, 16);
    }
    rl_str_printf(y, "%s\n  fov_x: %s", f->camera == CAMERA_LIST ? "]" : "",
                  f->fov <= FOV_WINDOW ? "header"
                  : f->fov == FOV_LIST ? "["
                                       : "");
    for (int i = 0; i < (f->fov == FOV_LIST ? n : f->fov == FOV_MANIFEST); i++)
        rl_str_printf(y, "%s%.17g", i ? ", " : "", s[i].camera.fov_x * 180 / 3.14159265358979323846);
    rl_str_printf(y, "%s\n  jitter: ", f->fov == FOV_LIST ? "]" : "");
    if (f->jitter_in_manifest)
        print_numbers(y, s->camera.jitter, 2);
    else
        rl_str_add(y, "header");
    rl_str_add(y, "\n");
}

static void print_keys(rl_str *y, const capture_form *f, int layer)
{
    static const char *const encodings[] = {"signed", "unsigned", "octahedral"},
                             *const kinds[] = {"planar", "radial", "device"},
                             *const units[] = {"pixels", "uv", "ndc"};
    switch (layer) {
    case 0:
        rl_str_printf(y, ", colorspace: %s", f->colorspace ? f->colorspace : "lin_rec709");
        break;
    case 1:
        rl_str_printf(y, ", space: %s, encoding: %s", f->normal_camera ? "camera" : "world",
                      encodings[f->normal]);
        break;
    case 2:
        rl_str_printf(y, ", kind: %s", kinds[f->depth]);
        if (f->depth == DEPTH_DEVICE && isinf(f->far))
            rl_str_printf(y, ", near: %.17g, far: .inf, reversed: %s", f->near / capture_metres(f),
                          f->reversed ? "true" : "false");
        else if (f->depth == DEPTH_DEVICE)
            rl_str_printf(y, ", near: %.17g, far: %.17g, reversed: %s", f->near / capture_metres(f),
                          f->far / capture_metres(f), f->reversed ? "true" : "false");
        if (f->empty_key)
            rl_str_printf(y, ", empty: %s", f->empty_key);
        break;
    case 4:
        if (f->remap[1] > 0) {
            rl_str_add(y, ", remap: ");
            print_numbers(y, f->remap, 2);
        }
        break;
    case 5:
        rl_str_printf(y, ", unit: %s, points: %s, y: %s", units[f->motion],
                      f->motion_next ? "next" : "previous", f->motion_up ? "up" : "down");
        break;
    default:
        break;
    }
}

static void print_layers(rl_str *y, const capture_form *f)
{
    rl_str_add(y, "layers:\n");
    for (int i = 0; i < LAYERS; i++) {
        if (i >= 6 && f->shadows)
            continue;
        if (i == 6)
            rl_str_add(y, "  shadow:\n");
        rl_str_printf(y, i < 6 ? "  %s: {channels: [" : "    %.3s: {channels: [",
                      capture_layers[i].name + (i < 6 ? 0 : 7));
        for (int c = 0; c < capture_channels(f, i); c++)
            rl_str_printf(y, "%s\"%s\"", c ? ", " : "",
                          f->files == FILES_ONE ? capture_layers[i].full[c] : capture_layers[i].bare[c]);
        rl_str_add(y, "]");
        print_keys(y, f, i);
        if (f->files == FILES_PARTS)
            rl_str_printf(y, ", part: %s", capture_layers[i].name);
        rl_str_add(y, "}\n");
    }
    rl_str_printf(y, f->shadows ? "  shadow: %s\n" : "%s", f->shadows ? f->shadows : "");
}

static void print_files(rl_str *y, const capture_form *f)
{
    if (f->files != FILES_LAYERS || f->pattern) {
        rl_str_printf(y, "files: %s\n", f->pattern ? f->pattern : "cap.####.exr");
        return;
    }
    rl_str_add(y, "files:\n");
    for (int i = 0; i < LAYERS; i++)
        rl_str_printf(y, "  %s: %s.%%04d.exr\n", capture_layers[i].name, capture_layers[i].name);
}

static void print_lights(rl_str *y, const capture_form *f)
{
    static const double key[] = SCENE_KEY_POSITION, rim[] = SCENE_RIM_POSITION, axis[] = SCENE_RIM_DIRECTION,
                        sun[] = SCENE_SUN_DIRECTION;
    static const double power[3][3] = {SCENE_KEY_INTENSITY, SCENE_RIM_INTENSITY, SCENE_SUN_IRRADIANCE};
    double p[3];
    if (f->no_lights || f->lights) {
        rl_str_add(y, f->lights ? f->lights : "");
        return;
    }
    for (int i = 0; i < 3; i++)
        p[i] = key[i] / capture_metres(f);
    rl_str_add(y, "lights:\n  key: {type: point, position: ");
    print_numbers(y, p, 3);
    rl_str_add(y, ", intensity: ");
    print_numbers(y, power[0], 3);
    for (int i = 0; i < 3; i++)
        p[i] = rim[i] / capture_metres(f);
    rl_str_add(y, "}\n  rim: {type: spot, position: ");
    print_numbers(y, p, 3);
    rl_str_add(y, ", direction: ");
    print_numbers(y, axis, 3);
    rl_str_printf(y, ", angle: %g, blend: %g, intensity: ", SCENE_RIM_ANGLE, SCENE_RIM_BLEND);
    print_numbers(y, power[1], 3);
    rl_str_add(y, "}\n  sun: {type: directional, direction: ");
    print_numbers(y, sun, 3);
    rl_str_add(y, ", irradiance: ");
    print_numbers(y, power[2], 3);
    rl_str_add(y, "}\n");
}

void capture_manifest(const char *folder, const capture_form *f, const scene *s, int n)
{
    rl_str y = {0};
    rl_str_printf(&y, "relit_capture: 1\nname: %s\nunit: %s\n", f->title ? f->title : "cap",
                  f->unit ? f->unit : "m");
    print_files(&y, f);
    print_camera(&y, f, s, n);
    print_layers(&y, f);
    print_lights(&y, f);
    rl_str_printf(&y, f->frames ? "frames: %s\n" : "%s", f->frames ? f->frames : "");
    rl_str_printf(&y, f->stencil_names ? "stencil_names: %s\n" : "%s",
                  f->stencil_names ? f->stencil_names : "");
    rl_str_add(&y, f->extra ? f->extra : "");
    assert_false(y.failed);
    file_write(folder, "capture.yaml", y.text, y.length);
    rl_str_free(&y);
}
