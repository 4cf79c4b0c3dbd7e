/* How much faster sss_burley is than the talk's per-pixel kernel (tests/peers/talk_sss.cl), on the same
 * device in one run, and that both are the same filter: their noise against 4,096 taps. Not a test; run from
 * the project's folder:
 *
 *     make build/tests/bench_sss && build/tests/bench_sss
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "passes/burley.h"
#include "tests/cl_pass.h"
#include "tests/sss_twin.h"

extern const rl_pass rl_pass_sss_burley;

enum { WIDTH = 1920, HEIGHT = 1080, REPEAT = 10 };

static const twin_material materials[3] = {{0, {0, 0, 0}, 0, 0, {0}, 0, 0},
                                           {1, {3.0f, 1.2f, 0.7f}, 0, 0, {0}, 0, 0},
                                           {1, {6, 5, 3}, 1, 0, {0}, 0, 0}};

/* As peers/talk_sss.cl has it. */
typedef struct peer_material {
    int32_t has_profile;
    float d[3];
    int32_t pre_post, disney;
} peer_material;

typedef struct scene {
    frame_t frame;
    size_t n;
    float *diffuse, *lit, *albedo, *normal, *depth, *ours, *talk, *truth;
    uint32_t *stencil;
    double coverage;
} scene;

/* Bumpy balls of skin and wax before nothing, lit from one side, with hard shadows. About 60 % is covered. */
static void fill(scene *s)
{
    static const struct {
        float x, y, radius;
        uint32_t id;
    } balls[] = {{680, 540, 530, 1}, {1540, 420, 300, 2}, {1450, 900, 170, 1}};
    size_t covered = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            size_t i = (size_t)y * (size_t)s->frame.columns + (size_t)x;
            float metre = 0.75f / s->frame.camera.focal[0]; /* of a pixel */
            for (size_t k = 0; k < 3; k++) {
                float u = ((float)x - balls[k].x) / balls[k].radius,
                      v = ((float)y - balls[k].y) / balls[k].radius;
                float w = 1 - u * u - v * v;
                if (w <= 0)
                    continue;
                w = sqrtf(w);
                float light =
                    fmaxf(0, 0.6f * u - 0.5f * v + 0.62f * w) * (sinf(0.03f * (float)(x + y)) > -0.6f);
                s->stencil[i] = balls[k].id;
                s->depth[i] = 0.75f - w * balls[k].radius * metre +
                              0.0002f * sinf(0.2f * (float)x) * cosf(0.3f * (float)y);
                s->normal[i] = u;
                s->normal[s->n + i] = -v;
                s->normal[2 * s->n + i] = w;
                for (size_t c = 0; c < 3; c++) {
                    s->diffuse[c * s->n + i] = light * (1 - 0.1f * (float)c) + 0.02f;
                    s->albedo[c * s->n + i] = 0.8f - 0.2f * (float)c;
                    s->lit[c * s->n + i] = 0.01f;
                }
                covered++;
                break;
            }
        }
    s->coverage = (double)covered / (WIDTH * HEIGHT);
}

static bool scene_make(scene *s, float focal)
{
    memset(s, 0, sizeof *s);
    cl_frame(&s->frame, 0, 0, WIDTH, HEIGHT, focal);
    s->n = (size_t)s->frame.columns * (size_t)s->frame.rows;
    float **planes[] = {&s->diffuse, &s->lit,  &s->albedo, &s->normal,
                        &s->ours,    &s->talk, &s->truth,  &s->depth};
    for (size_t i = 0; i < 8; i++)
        *planes[i] = rl_calloc(3 * s->n, 4);
    s->stencil = rl_calloc(s->n, 4);
    for (size_t i = 0; i < 8; i++)
        if (!*planes[i] || !s->stencil)
            return false;
    fill(s);
    return true;
}

static void scene_free(scene *s)
{
    float *planes[] = {s->diffuse, s->lit,   s->albedo, s->normal,          s->ours,
                       s->talk,    s->truth, s->depth,  (float *)s->stencil};
    for (size_t i = 0; i < 9; i++)
        rl_free(planes[i]);
}

enum { AREA = 0, PLAIN = 1, SURFACE = 2 };

static double run_ours(cl_session *session, const scene *s, int taps, int weighting, int repeat, float *color)
{
    const struct {
        int32_t taps, orientation, weighting, rotation, seed;
    } params = {taps, 0, weighting, 3, 0};
    const cl_image images[] = {{"diffuse", s->diffuse, NULL}, {"lit", s->lit, NULL},
                               {"albedo", s->albedo, NULL},   {"normal", s->normal, NULL},
                               {"depth", s->depth, NULL},     {"stencil", s->stencil, NULL},
                               {"color", NULL, color}};
    double ms[8] = {0};
    cl_job job = {
        &rl_pass_sss_burley, &s->frame, &params, materials, sizeof materials, images, 7, repeat, ms, 0};
    return cl_run(session, &job) ? ms[0] + ms[1] + ms[2] + ms[3] : -1;
}

static char *talk_text(const scene *s, int taps)
{
    rl_str text = {0};
    char *source = cl_read_file("tests/peers/talk_sss.cl");
    const camera_t *c = &s->frame.camera;
    rl_str_printf(&text,
                  "#define WIDTH %d\n#define HEIGHT %d\n#define TAPS %d\n#define FOCAL_X %.9ef\n"
                  "#define FOCAL_Y %.9ef\n#define RAY_X %.9ef\n#define RAY_Y %.9ef\n",
                  s->frame.columns, s->frame.rows, taps, (double)c->focal[0], (double)c->focal[1],
                  (double)(0.5f + c->jitter[0] - c->centre[0]), (double)(0.5f + c->jitter[1] - c->centre[1]));
    rl_str_add(&text, source ? source : "");
    rl_free(source);
    return text.text;
}

static double run_talk(cl_session *session, const scene *s, int taps, int repeat)
{
    enum { MOST = 64 };
    float x[MOST], y[MOST], weight[MOST], table[3 * MOST];
    peer_material peers[3] = {0};
    float to_world[12];
    rl_burley_taps((size_t)taps, 0.5, x, y, weight);
    for (int i = 0; i < taps; i++) {
        table[3 * i] = x[i];
        table[3 * i + 1] = y[i];
        table[3 * i + 2] = weight[i];
    }
    for (int m = 0; m < 3; m++) {
        peers[m] =
            (peer_material){materials[m].has_profile, {0}, materials[m].texturing, materials[m].diffuse == 0};
        for (int c = 0; c < 3; c++)
            peers[m].d[c] = materials[m].scatter_distance_mm[c] * 1e-3f;
    }
    memcpy(to_world, s->frame.camera.to_world, sizeof to_world);
    const cl_buffer buffers[] = {{s->diffuse, s->n * 12, false}, {s->lit, s->n * 12, false},
                                 {s->albedo, s->n * 12, false},  {s->normal, s->n * 12, false},
                                 {s->depth, s->n * 4, false},    {s->stencil, s->n * 4, false},
                                 {s->talk, s->n * 12, true},     {table, sizeof table, false},
                                 {peers, sizeof peers, false},   {to_world, sizeof to_world, false}};
    char *text = talk_text(s, taps);
    size_t global[2] = {(size_t)s->frame.columns, (size_t)s->frame.rows},
           best_local[2][2] = {{64, 1}, {8, 4}};
    double best = -1;
    for (int i = 0; i < 2 && text; i++) { /* the local size that suits it better */
        double ms = cl_run_text(session, text, "talk_sss", buffers, 10, global, best_local[i], repeat);
        if (ms < 0)
            return -1;
        best = best < 0 || ms < best ? ms : best;
    }
    rl_free(text);
    return best;
}

/* Root of the mean squared difference to the converged result, over what scatters. */
static double noise(const scene *s, const float *color)
{
    double sum = 0;
    size_t n = 0;
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < s->n; i++)
            if (s->stencil[i]) {
                double d = color[c * s->n + i] - s->truth[c * s->n + i];
                sum += d * d;
                n++;
            }
    return sqrt(sum / (double)n);
}

/* What the weightings cost, as multiples of `plain`. */
static bool print_weightings(cl_session *session, const scene *s, int taps)
{
    double best[3] = {1e30, 1e30, 1e30};
    for (int round = 0; round < 5; round++)
        for (int k = 0; k < 3; k++) {
            double ms = run_ours(session, s, taps, k, REPEAT, s->ours);
            if (ms < 0)
                return false;
            best[k] = fmin(best[k], ms);
        }
    printf("  %d taps: area %.1f ms, plain %.1f ms, surface %.1f ms; surface takes %.2f times area\n", taps,
           best[AREA], best[PLAIN], best[SURFACE], best[SURFACE] / best[AREA]);
    return true;
}

int main(void)
{
    static const float focal[] = {900, 5800}; /* pixels; radius about 60 and 380 pixels for skin */
    static const int taps[] = {21, 55};
    int status = EXIT_FAILURE;
    cl_session *session = cl_open(0);
    scene s = {0};
    for (size_t f = 0; session && f < 2; f++) {
        if (!scene_make(&s, focal[f]) || run_ours(session, &s, 4096, PLAIN, 1, s.truth) < 0)
            goto done;
        printf("%dx%d, %.1f %% subsurface, radius %.0f px (skin)\n", WIDTH, HEIGHT, 100 * s.coverage,
               RL_BURLEY_RADIUS * 0.003 * (double)focal[f] / 0.65);
        for (size_t t = 0; t < 2; t++) {
            double ours = 1e30, talk = 1e30;
            for (int round = 0; round < 3; round++) { /* in turns, as the machine's speed drifts */
                double a = run_ours(session, &s, taps[t], PLAIN, REPEAT, s.ours),
                       b = run_talk(session, &s, taps[t], 2);
                if (a < 0 || b < 0)
                    goto done;
                ours = fmin(ours, a);
                talk = fmin(talk, b);
            }
            printf("  %d taps: sss_burley %.1f ms, talk %.1f ms, ratio %.1f; noise %.2e and %.2e\n", taps[t],
                   ours, talk, talk / ours, noise(&s, s.ours), noise(&s, s.talk));
            if (!print_weightings(session, &s, taps[t]))
                goto done;
        }
        scene_free(&s);
        memset(&s, 0, sizeof s);
    }
    status = session ? EXIT_SUCCESS : EXIT_FAILURE;
done:
    scene_free(&s);
    cl_close(&session);
    return status;
}
