#include "tests/fake_experiment.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "tests/fake_graph.h"

static const char *const materials[FAKE_MATERIALS] = {"", "skin", "plaster", "dot", "absent"};
static const char *const variant_names[FAKE_VARIANTS] = {"post",   "pre_post", "third",
                                                         "fourth", "fifth",    "sixth"};

/* light (all), sss (the first), sss@2 (the others), aa (the first). */
static const rl_node nodes[] = {
    {.name = "light", .pass = &fake_lighting},
    {.name = "sss", .pass = &fake_sss, INPUTS({"diffuse", "light.diffuse", {0}}, {"lit", "light.lit", {0}})},
    {.name = "sss@2",
     .pass = &fake_sss,
     INPUTS({"diffuse", "light.diffuse", {0}}, {"lit", "light.lit", {0}})},
    {.name = "aa", .pass = &fake_taa, INPUTS({"color", "sss.color", {0}})},
};

rl_experiment *fake_experiment_new(size_t captures)
{
    static const int numbers[FAKE_FRAMES] = {1, 2, 5};
    rl_experiment *e = calloc(1, sizeof *e);
    assert_non_null(e);
    memcpy(e->frames, numbers, sizeof numbers);
    for (size_t c = 0; c < captures; c++) {
        e->manifests[c].name = c ? "bust" : "monkey";
        e->sequences[c].manifest = &e->manifests[c];
        e->sequences[c].frames = (rl_frames){e->frames, FAKE_FRAMES};
    }
    e->session.content = 0x0123456789abcdefu;
    e->session.pipeline = &e->pipeline;
    e->session.sequences = e->sequences;
    e->session.n_sequences = captures;
    e->session.outputs = e->outputs;
    e->plan.graph = fake_graph(&e->arena, nodes, 4, NULL, 0);
    e->cost = (rl_experiment_cost){1.5, 2, true};
    for (int v = 0; v < FAKE_VARIANTS; v++) {
        e->used[0][v] = true;
        e->used[1][v] = e->used[3][v] = v == 0;
        e->used[2][v] = v > 0;
    }
    return e;
}

void fake_experiment_free(rl_experiment *e)
{
    rl_arena_free(&e->arena);
    free(e);
}

/* ---- what experiment.h promises ------------------------------------------------------------------------ */

size_t rl_experiment_variants(const rl_experiment *e)
{
    (void)e;
    return FAKE_VARIANTS;
}

const rl_session *rl_experiment_session(const rl_experiment *e, size_t variant)
{
    (void)variant;
    return &e->session;
}

size_t rl_experiment_groups(const rl_experiment *e, size_t capture)
{
    (void)e, (void)capture;
    return 1;
}

const char *rl_experiment_group_reason(const rl_experiment *e, size_t capture, size_t group)
{
    (void)e, (void)capture, (void)group;
    return NULL;
}

const rl_plan *rl_experiment_plan(const rl_experiment *e, size_t capture, size_t group)
{
    (void)capture, (void)group;
    return &e->plan;
}

const char *const *rl_experiment_materials(const rl_experiment *e, size_t capture, size_t *n)
{
    (void)e, (void)capture;
    *n = FAKE_MATERIALS;
    return materials;
}

bool rl_experiment_node(const rl_experiment *e, size_t capture, size_t i, rl_merged_node *out)
{
    (void)capture;
    if (i >= 4)
        return false;
    *out = (rl_merged_node){.group = 0,
                            .node = (int)i,
                            .name = nodes[i].name,
                            .pass = nodes[i].pass,
                            .used = e->used[i],
                            .ms = i ? 1.5 : -1};
    return true;
}

void rl_experiment_cost_of(const rl_experiment *e, rl_experiment_cost *out)
{
    *out = e->cost;
}

const char *rl_experiment_image_name(const rl_experiment *e, size_t variant, rl_compared which)
{
    (void)e, (void)variant;
    return which == RL_COMPARED_LINEAR ? "aa.color" : "sRGB / ACES";
}

/* Never called; here so that no part of the real one is linked beside this. */
rl_code rl_experiment_open(const rl_options *options, const rl_variant *variants, size_t n_variants,
                           rl_experiment **out, rl_error *err)
{
    (void)options, (void)variants, (void)n_variants, (void)out;
    return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "a fake experiment cannot be opened");
}

void rl_experiment_close(rl_experiment **experiment)
{
    *experiment = NULL;
}

rl_code rl_experiment_run(rl_experiment *experiment, const rl_experiment_hooks *hooks,
                          rl_run_summary *summary, rl_error *err)
{
    (void)experiment, (void)hooks, (void)summary;
    return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "a fake experiment cannot run");
}

/* ---- frames -------------------------------------------------------------------------------------------- */

static uint32_t material_at(int x, int y)
{
    if (x == 20 && (y == 20 || y == 21))
        return FAKE_DOT;
    if (hypot(x - 22, y - 20) < 14)
        return FAKE_SKIN;
    return x > 30 && y > 8 ? FAKE_PLASTER : 0;
}

void fake_frame_draw(rl_experiment *e, size_t capture, size_t index)
{
    for (int y = 0; y < FAKE_HEIGHT; y++)
        for (int x = 0; x < FAKE_WIDTH; x++)
            e->stencil[y * FAKE_STRIDE + x] = material_at(x, y);
    for (int v = 0; v < FAKE_VARIANTS; v++)
        for (int k = 0; k < RL_COMPARED; k++) {
            e->images[v][k] = (rl_compared_image){FAKE_WIDTH, FAKE_HEIGHT, {0}, FAKE_STRIDE};
            for (int c = 0; c < 3; c++) {
                float *plane = e->pixels[v][k][c];
                e->images[v][k].plane[c] = plane;
                for (int i = 0; i < FAKE_HEIGHT * FAKE_STRIDE; i++) {
                    int x = i % FAKE_STRIDE, y = i / FAKE_STRIDE;
                    double value =
                        0.75 + 0.4 * sin(0.23 * x + c + (double)index) + 0.35 * cos(0.31 * y * (1 + 0.2 * c));
                    plane[i] = x >= FAKE_WIDTH ? NAN /* between rows */
                                               : (float)(k == RL_COMPARED_LINEAR ? value : sqrt(value));
                }
            }
        }
    e->frame = (rl_experiment_frame){.capture = capture,
                                     .index = index,
                                     .frame = e->frames[index],
                                     .x = FAKE_X,
                                     .y = FAKE_Y,
                                     .width = FAKE_WIDTH,
                                     .height = FAKE_HEIGHT,
                                     .stencil = e->stencil,
                                     .stencil_stride = FAKE_STRIDE,
                                     .images = (const rl_compared_image(*)[RL_COMPARED])e->images};
}

void fake_frame_change(rl_experiment *e, int variant, int material, float amount)
{
    for (int i = 0; i < FAKE_HEIGHT * FAKE_STRIDE; i++)
        for (int c = 0; c < 3; c++)
            if (i % FAKE_STRIDE < FAKE_WIDTH &&
                (material == RL_AB_WHOLE || e->stencil[i] == (uint32_t)material)) {
                e->pixels[variant][RL_COMPARED_LINEAR][c][i] += amount * (float)(c + 1);
                e->pixels[variant][RL_COMPARED_DISPLAY][c][i] += 0.5f * amount * (float)(c + 1);
            }
}

void fake_frame_noise(rl_experiment *e, int variant, uint32_t seed, float amount)
{
    uint32_t state = seed * 2654435761u + 12345u;
    for (int i = 0; i < FAKE_HEIGHT * FAKE_STRIDE; i++)
        for (int c = 0; c < 3; c++) {
            state = state * 1664525u + 1013904223u;
            float r = amount * ((float)(state >> 8) / 8388608.f - 1);
            e->pixels[variant][RL_COMPARED_LINEAR][c][i] += r;
            e->pixels[variant][RL_COMPARED_DISPLAY][c][i] += 0.5f * r;
        }
}

void fake_plan_make(fake_plan *p, size_t n_variants, size_t n_listed)
{
    memset(p, 0, sizeof *p);
    for (size_t v = 0; v < n_variants; v++) {
        p->values[v] = v < n_listed ? variant_names[v] : NULL;
        p->settings[v] = (rl_setting){"profiles.skin.texturing", variant_names[v]};
        p->variants[v] = (rl_variant){variant_names[v], "configs/skin.yaml", &p->settings[v], 1, true};
        if (v && v < n_listed)
            p->pairs[p->plan.n_pairs++] = (rl_ab_pair){0, (int)v};
    }
    p->parameter = (rl_ab_parameter){"profiles.skin.texturing", p->values};
    p->plan.variants = p->variants;
    p->plan.n_variants = n_variants;
    p->plan.n_listed = n_listed;
    p->plan.parameters = &p->parameter;
    p->plan.n_parameters = 1;
    p->plan.pairs = p->pairs;
    p->plan.stochastic = n_variants > n_listed;
    p->plan.seeds = (int)(1 + n_variants - n_listed);
}
