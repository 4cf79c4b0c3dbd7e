/* shadow: screen over a capture of two spheres on a floor, whose true shadows are known: what the camera sees
 * of their cause must be found, to two pixels. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/capture_run.h"
#include "tests/tool_run.h"

enum { WIDTH = 216, HEIGHT = 144, SAMPLES = 300 };

/* What the march could know of a pixel. */
enum { SKIPPED, LIT, SHADOWED, HIDDEN_LIT, HIDDEN_SHADOWED };

static bool in_picture(const scene *s, const double *p)
{
    const scene_camera *c = &s->camera;
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = c->view[4 * i] * p[0] + c->view[4 * i + 1] * p[1] + c->view[4 * i + 2] * p[2] +
               c->view[4 * i + 3];
    double half = tan(c->fov_x / 2);
    return v[2] < 0 && fabs(v[0] / v[2]) < half && fabs(v[1] / v[2]) < half * c->display[3] / c->display[2];
}

/* Is a shadowed pixel's occluder seen by the camera, does a lit one's ray pass behind something? */
static int classify(const scene *s, size_t i, const double *light, const double *eye)
{
    double p[3], way[3], nl = 0, from[3];
    for (int k = 0; k < 3; k++) {
        p[k] = s->plane[SCENE_POSITION + k][i];
        way[k] = light[k] - p[k];
        nl += way[k] * s->plane[SCENE_NORMAL + k][i];
        from[k] = p[k] + 1e-9 * s->plane[SCENE_NORMAL + k][i];
    }
    if (!s->id[i] || nl <= 0)
        return SKIPPED;
    uint32_t blocker = scene_first(from, way, 1);
    bool hidden = false, seen = false;
    for (int t = 1; t < SAMPLES; t++) {
        double at[3], ray[3];
        for (int k = 0; k < 3; k++) {
            at[k] = p[k] + way[k] * t / SAMPLES;
            ray[k] = at[k] - eye[k];
        }
        if (!in_picture(s, at))
            break;
        uint32_t first = scene_first(eye, ray, 1 - 1e-6);
        hidden = hidden || first;
        seen = seen || (blocker && first == blocker && scene_inside(at) == blocker);
    }
    if (blocker)
        return seen ? SHADOWED : HIDDEN_SHADOWED;
    return hidden ? HIDDEN_LIT : LIT;
}

static double *visibility(const scene *s, const char *folder, const char *lights)
{
    static const char *const color[] = {"c.color"};
    const rl_options options = {.dump = color, .n_dump = 1};
    double *out = calloc(s->n, sizeof *out);
    for (int march = 0; march < 2; march++) {
        char text[2048];
        rl_error err = {0};
        snprintf(text, sizeof text, "%slights:\n  key: {%s, shadow: %s}\n", capture_pipeline, lights,
                 march ? "screen" : "none");
        char *graph = strstr(text, "{pass: lighting}");
        assert_non_null(graph);
        char with[4096];
        snprintf(with, sizeof with, "%.*s{pass: lighting, shadow_thickness_m: 1.1}%s", (int)(graph - text),
                 text, graph + strlen("{pass: lighting}"));
        rl_session *r = capture_open(folder, with, &options);
        if (rl_session_process(r, 0, 1, NULL, &err))
            fail_msg("%s: %s", err.file, err.text);
        rl_image_view v = capture_image(r, "c.color");
        for (size_t i = 0; i < s->n; i++) {
            double value = (double)v.plane[1][i / WIDTH * v.stride + i % WIDTH];
            out[i] = march ? (out[i] > 0 ? value / out[i] : 0) : value;
        }
        rl_session_close(&r);
    }
    return out;
}

/* What the march takes for shadow, rightly or not. */
static bool looks_dark(int kind)
{
    return kind == SHADOWED || kind == HIDDEN_LIT || kind == HIDDEN_SHADOWED;
}

/* Within two pixels of a place where that or the object changes. */
static bool near_edge(const scene *s, const int *kind, int x, int y)
{
    size_t at = (size_t)y * WIDTH + (size_t)x;
    for (int dy = -2; dy <= 2; dy++)
        for (int dx = -2; dx <= 2; dx++) {
            int nx = x + dx, ny = y + dy;
            if (nx < 0 || ny < 0 || nx >= WIDTH || ny >= HEIGHT)
                continue;
            size_t n = (size_t)ny * WIDTH + (size_t)nx;
            if (kind[n] == SKIPPED || s->id[n] != s->id[at] || looks_dark(kind[at]) != looks_dark(kind[n]))
                return true;
        }
    return false;
}

static void test_truth(void **state)
{
    (void)state;
    scene_camera c = scene_camera_default();
    for (int i = 2; i < 4; i++)
        c.data[i] = c.display[i] = i == 2 ? WIDTH : HEIGHT;
    scene s = scene_make(&c, SCENE_KEY, 0);
    const capture_form plain = {.name = "plain", .compression = RL_EXR_ZIP};
    const double light[3] = {0.9, 0.8, -1.2}, eye[3] = {0.2, 0.3, 0.6};
    char *folder = folder_new();
    capture_write(folder, &plain, &s, 1);
    capture_manifest(folder, &plain, &s, 1);
    double *seen = visibility(&s, folder, "type: point, position: [0.9, 0.8, -1.2], intensity: 3");
    int *kind = calloc(s.n, sizeof *kind);
    size_t all[5] = {0}, wrong[5] = {0}, far_wrong = 0, ball = 0, acne = 0;
    for (size_t i = 0; i < s.n; i++)
        kind[i] = classify(&s, i, light, eye);
    for (size_t i = 0; i < s.n; i++) {
        bool dark = kind[i] == SHADOWED || kind[i] == HIDDEN_SHADOWED;
        bool off = kind[i] != SKIPPED && (seen[i] < 0.5) != dark,
             known = kind[i] == LIT || kind[i] == SHADOWED;
        all[kind[i]]++;
        wrong[kind[i]] += off;
        far_wrong += off && known && !near_edge(&s, kind, (int)i % WIDTH, (int)i / WIDTH);
        ball += kind[i] == LIT && s.id[i] != 2;
        acne += kind[i] == LIT && s.id[i] != 2 && off;
        assert_true(kind[i] == SKIPPED || seen[i] == 0 || fabs(seen[i] - 1) < 1e-6);
    }
    printf("truth: lit %zu of %zu wrong, shadowed %zu of %zu; beyond 2 pixels of an edge %zu; lit balls %zu "
           "of %zu; ray passes "
           "behind something %zu of %zu, occluder out of sight %zu of %zu\n",
           wrong[LIT], all[LIT], wrong[SHADOWED], all[SHADOWED], far_wrong, acne, ball, wrong[HIDDEN_LIT],
           all[HIDDEN_LIT], wrong[HIDDEN_SHADOWED], all[HIDDEN_SHADOWED]);
    assert_true(all[LIT] > 4000 && all[SHADOWED] > 500 && ball > 1000);
    assert_true((double)(wrong[LIT] + wrong[SHADOWED]) < 0.01 * (double)(all[LIT] + all[SHADOWED]));
    assert_int_equal(far_wrong, 0);
    assert_true((double)acne <= 0.001 * (double)ball);
    free(kind);
    free(seen);
    folder_remove(folder);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_truth)};
    return cmocka_run_group_tests(tests, capture_setup, capture_teardown);
}
