#include "tests/page_make.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab_page_parts.h"

#define N (PAGE_WIDTH * PAGE_HEIGHT)

static const char *const materials[] = {"", "skin", "plaster", "wax"};

float page_make_linear(int variant, int index, int channel, int x, int y)
{
    int step = variant < 0 ? 1 : variant * 6;
    if (x < 8) /* a column for each of the largest and smallest values */
        return (float[]){0, -0.125f, 1, 64, 65504, 0.0009765625f, 8, 0.25f}[x];
    return (float)((x * (3 - channel) + y * (1 + channel) + index * 4 + step * channel + step) % 512) / 256;
}

int page_make_flip(int index, int x, int y)
{
    return (x + 2 * y + 5 * index) % 256;
}

unsigned page_make_id(int x, int y)
{
    return (unsigned)(x / 16 + y / 16) % 4;
}

void page_make_display(const float in[3], float out[3])
{
    for (int c = 0; c < 3; c++) {
        float x = fmaxf(0.8f * in[c] + 0.1f * in[(c + 1) % 3] + 0.1f * in[(c + 2) % 3], 0);
        out[c] = sqrtf(x / (x + 0.6f) + 0.01f) - 0.1f;
    }
}

static rl_code display(const void *ctx, float *r, float *g, float *b, size_t n, rl_error *err)
{
    (void)ctx;
    (void)err;
    for (size_t i = 0; i < n; i++) {
        float out[3], in[3] = {r[i], g[i], b[i]};
        page_make_display(in, out);
        r[i] = out[0];
        g[i] = out[1];
        b[i] = out[2];
    }
    return RL_OK;
}

double page_make_mean(int index, int pair)
{
    return (index == 3 ? 0.031 : 0.012 + 0.001 * index) / (1 + pair);
}

/* Of a frame: [variants + 1 reference][compared][3][N], ids, two maps. */
typedef struct frame_data {
    float pixels[PAGE_VARIANTS + 1][RL_COMPARED][3][N];
    uint32_t ids[N];
    float maps[RL_PAGE_MAPS][N];
    rl_compared_image images[PAGE_VARIANTS + 1][RL_COMPARED];
} frame_data;

static void fill_frame(frame_data *d, int index)
{
    for (int v = 0; v <= PAGE_VARIANTS; v++) {
        for (int i = 0; i < N; i++) {
            float in[3], out[3];
            for (int c = 0; c < 3; c++)
                in[c] =
                    page_make_linear(v < PAGE_VARIANTS ? v : -1, index, c, i % PAGE_WIDTH, i / PAGE_WIDTH);
            page_make_display(in, out);
            for (int c = 0; c < 3; c++) {
                d->pixels[v][RL_COMPARED_LINEAR][c][i] = in[c];
                d->pixels[v][RL_COMPARED_DISPLAY][c][i] = out[c];
            }
        }
        for (int k = 0; k < RL_COMPARED; k++)
            d->images[v][k] =
                (rl_compared_image){PAGE_WIDTH,
                                    PAGE_HEIGHT,
                                    {d->pixels[v][k][0], d->pixels[v][k][1], d->pixels[v][k][2]},
                                    PAGE_WIDTH};
    }
    for (int i = 0; i < N; i++) {
        d->ids[i] = page_make_id(i % PAGE_WIDTH, i / PAGE_WIDTH);
        d->maps[0][i] = (float)page_make_flip(index, i % PAGE_WIDTH, i / PAGE_WIDTH) / 255;
        d->maps[1][i] = d->maps[0][i] / 2;
    }
}

static const float *map_of(const void *ctx, size_t pair, rl_metric metric)
{
    const frame_data *d = ctx;
    return pair == 1 && metric == RL_METRIC_HDRFLIP ? NULL : d->maps[metric == RL_METRIC_HDRFLIP];
}

/* ---- metrics.json -------------------------------------------------------------------------------------- */

static void add_metrics(rl_str *s)
{
    const char *between = "";
    rl_str_add(s, "\"metrics\":[");
    for (int pair = 0; pair < 2; pair++)
        for (int f = 0; f < PAGE_FRAMES; f++)
            for (int m = 0; m < 4; m++)
                for (int k = 0; k < RL_METRICS; k++) {
                    double v = page_make_mean(f, pair) * (m == 1 ? 2.4 : m == 2 ? 0.3 : m == 3 ? 0.9 : 1);
                    double mean = k == RL_METRIC_PSNR   ? 30 - 20 * log10(v * 30)
                                  : k == RL_METRIC_SSIM ? 1 - v
                                                        : v * (k + 1);
                    rl_str_printf(s, "%s{\"capture\":0,\"pair\":%d,\"frame\":%d,\"material\":", between, pair,
                                  f + 101);
                    between = ",\n";
                    if (m)
                        rl_page_json_text(s, materials[m]);
                    else
                        rl_str_add(s, "null");
                    rl_str_printf(s, ",\"metric\":\"%s\",\"pixels\":%d,\"mean\":%.6g,",
                                  rl_metric_name((rl_metric)k), N / (m ? 4 : 1), mean);
                    if (k == RL_METRIC_PSNR)
                        rl_str_add(s, "\"median\":null,\"p95\":null,\"max\":null,");
                    else
                        rl_str_printf(s, "\"median\":%.6g,\"p95\":%.6g,\"max\":%.6g,", mean * 0.8, mean * 2.2,
                                      k == RL_METRIC_SSIM ? 1.0 : mean * 5);
                    rl_str_printf(s, "\"beyond_chance\":%s}", m == 2 ? "false" : "true");
                }
    rl_str_add(s, "],\n\"null\":[");
    for (int m = 0; m < 4; m++)
        for (int k = 0; k < RL_METRICS; k++) {
            double bound = k == RL_METRIC_PSNR ? 46 : k == RL_METRIC_SSIM ? 0.991 : 0.008 * (k + 1);
            rl_str_printf(s, "%s{\"capture\":0,\"material\":", m || k ? "," : "");
            if (m)
                rl_page_json_text(s, materials[m]);
            else
                rl_str_add(s, "null");
            rl_str_printf(s, ",\"metric\":\"%s\",\"n\":18,\"mean\":%g,\"median\":%g,\"p95\":%g,\"max\":%g}",
                          rl_metric_name((rl_metric)k), bound, bound * 0.8, bound * 2, bound * 4);
        }
    rl_str_add(s, "],\n");
}

static void add_graph(rl_str *s)
{
    static const struct {
        const char *name, *pass, *variants, *varied, *ms;
    } nodes[] = {{"light", "lighting", "0,1,2", "false", "1.31"},
                 {"sss", "sss_burley", "0", "true", "4.8"},
                 {"light@2", "lighting", "1", "true", "1.4"},
                 {"sss@2", "sss_burley", "1", "true", "4.9"},
                 {"sss@3", "sss_gaussian", "2", "true", "7.25"},
                 {"aa", "taa", "0", "true", "0.9"},
                 {"aa@2", "taa", "1", "true", "0.91"},
                 {"aa@3", "taa", "2", "true", "0.93"}};
    static const struct {
        const char *from, *to, *image, *port, *history;
    } edges[] = {{"capture", "light", "capture.albedo", "albedo", "false"},
                 {"capture", "light", "capture.normal", "normal", "false"},
                 {"capture", "light@2", "capture.albedo", "albedo", "false"},
                 {"capture", "sss", "capture.depth", "depth", "false"},
                 {"light", "sss", "light.diffuse", "diffuse", "false"},
                 {"light", "sss", "light.lit", "lit", "false"},
                 {"light@2", "sss@2", "light@2.diffuse", "diffuse", "false"},
                 {"light", "sss@3", "light.diffuse", "diffuse", "false"},
                 {"sss", "aa", "sss.color", "color", "false"},
                 {"aa", "aa", "aa.color", "last_color", "true"},
                 {"sss@2", "aa@2", "sss@2.color", "color", "false"},
                 {"aa@2", "aa@2", "aa@2.color", "last_color", "true"},
                 {"sss@3", "aa@3", "sss@3.color", "color", "false"}};
    rl_str_add(s, "\"graph\":[{\"capture\":0,\"group\":0,\"reason\":null,\"nodes\":[");
    for (size_t i = 0; i < sizeof nodes / sizeof *nodes; i++)
        rl_str_printf(s, "%s{\"name\":\"%s\",\"pass\":\"%s\",\"variants\":[%s],\"varied\":%s,\"ms\":%s}",
                      i ? "," : "", nodes[i].name, nodes[i].pass, nodes[i].variants, nodes[i].varied,
                      nodes[i].ms);
    rl_str_add(s, "],\"edges\":[");
    for (size_t i = 0; i < sizeof edges / sizeof *edges; i++)
        rl_str_printf(s, "%s{\"from\":\"%s\",\"to\":\"%s\",\"image\":\"%s\",\"port\":\"%s\",\"history\":%s}",
                      i ? "," : "", edges[i].from, edges[i].to, edges[i].image, edges[i].port,
                      edges[i].history);
    rl_str_add(s, "]}],\n");
}

static void add_energy(rl_str *s)
{
    rl_str_add(s, "\"energy\":[");
    for (int v = 0; v < 2; v++)
        for (int m = 1; m < 3; m++) {
            rl_str_printf(
                s,
                "%s{\"capture\":0,\"variant\":%d,\"node\":\"sss\",\"pass\":\"sss_burley\",\"frame\":101,"
                "\"material\":",
                v || m > 1 ? "," : "", v);
            rl_page_json_text(s, materials[m]);
            rl_str_add(s, ",\"in\":[0.4,0.3,0.2],\"out\":[0.39,0.29,0.2],\"border\":[0.004,0.002,0.001],"
                          "\"off_screen\":[0.001,0,0],\"clamped\":[0,0,0]}");
        }
    rl_str_add(s, "],\n");
}

static void add_variants(rl_str *s, const char *name)
{
    const char *names[PAGE_VARIANTS] = {"post", name, "gaussian"};
    rl_str_add(s, "\"variants\":[");
    for (int v = 0; v < PAGE_VARIANTS; v++) {
        rl_str_add(s, v ? ",{\"name\":" : "{\"name\":");
        rl_page_json_text(s, names[v]);
        rl_str_printf(s, ",\"pipeline\":\"configs/skin.yaml\",\"settings\":[],\"hash\":\"%016x\"}", v + 1);
    }
    rl_str_add(s, "],\n\"parameters\":[{\"path\":\"profiles.skin.texturing\",\"values\":[\"post\",");
    rl_page_json_text(s, name);
    rl_str_add(s, ",\"post\"]},{\"path\":\"graph.sss.pass\",\"values\":[\"sss_burley\",\"sss_burley\","
                  "\"sss_gaussian\"]},{\"path\":\"graph.sss.taps\",\"values\":[\"auto\",\"auto\",null]}],\n");
}

static void make_metrics(const page_make_options *o, const char *name, rl_str *s)
{
    rl_str_add(s, "{\"relit\":\"0.1.0\",\"command\":");
    rl_str command = {0}, summary = {0};
    rl_str_printf(&command, "relit ab configs/skin.yaml --vary profiles.skin.texturing=post,%s", name);
    rl_page_json_text(s, rl_str_text(&command));
    rl_str_printf(
        &summary,
        "%s differs most from post on skin: FLIP 0.074 at frame 104 (mean over frames 0.038), five times "
        "what chance makes. plaster stays within it.",
        name);
    rl_str_add(s, ",\"summary\":");
    rl_page_json_text(s, rl_str_text(&summary));
    rl_str_add(s, ",\n");
    add_variants(s, name);
    rl_str_printf(
        s, "\"pairs\":[{\"reference\":%s,\"test\":1},{\"reference\":%s,\"test\":2}],\"against\":%s,\n",
        o->reference ? "null" : "0", o->reference ? "null" : "0", o->reference ? "\"ref\"" : "null");
    rl_str_add(
        s, "\"images\":{\"linear\":\"aa.color, linear Rec. 709\",\"display\":\"aa.color, sRGB / Test\"},\n");
    rl_str_printf(s,
                  "\"captures\":[{\"name\":\"monkey\",\"frames\":[101,102,103,104,105,106],\"width\":%d,"
                  "\"height\":%d,\"materials\":[\"\",\"skin\",\"plaster\",\"wax\"]}],\n",
                  PAGE_WIDTH, PAGE_HEIGHT);
    add_metrics(s);
    add_graph(s);
    add_energy(s);
    rl_str_add(s,
               "\"stochastic\":true,\"seeds\":3,\n\"cost\":{\"factor\":2.31,\"sum\":3.06,\"measured\":true,"
               "\"frames\":6,\"seconds\":1.23,\"variants\":3,\"predicted\":2.2},\n\"thresholds\":[{\"what\":"
               "\"flip.p95\",\"limit\":0.05,\"over\":[{\"capture\":0,\"pair\":0,\"frame\":104,\"material\":"
               "\"skin\",\"value\":0.163}]},{\"what\":\"max.mean\",\"limit\":0.9,\"over\":[]}]}\n");
    s->failed |= command.failed || summary.failed;
    rl_str_free(&command);
    rl_str_free(&summary);
}

/* ---- the page ------------------------------------------------------------------------------------------ */

static rl_code give_frame(rl_ab_page *page, const page_make_options *o, frame_data *d, int index,
                          rl_error *err)
{
    const rl_error lost = {.code = RL_E_IO, .text = "monkey.0102.exr cannot be opened: <b>No such file</b>"};
    char paths[PAGE_VARIANTS][512];
    const char *lists[PAGE_VARIANTS][1];
    const char *const *files[PAGE_VARIANTS];
    const size_t n_files[PAGE_VARIANTS] = {1, 1, 1};
    for (int v = 0; v < PAGE_VARIANTS; v++) {
        snprintf(paths[v], sizeof paths[v], "%s/variant %d/monkey.%04d.exr", o->folder, v, 101 + index);
        lists[v][0] = paths[v];
        files[v] = lists[v];
    }
    rl_ab_value values[2];
    for (int p = 0; p < 2; p++)
        values[p] = (rl_ab_value){.pair = (size_t)p,
                                  .index = (size_t)index,
                                  .frame = 101 + index,
                                  .material = RL_AB_WHOLE,
                                  .metric = RL_METRIC_FLIP,
                                  .stats = {page_make_mean(index, p)}};
    const rl_ab_results results = {.values = values, .n_values = 2};
    fill_frame(d, index);
    const rl_experiment_frame frame = {.index = (size_t)index,
                                       .frame = 101 + index,
                                       .error = index == o->failed ? &lost : NULL,
                                       .x = 10,
                                       .y = 20,
                                       .width = PAGE_WIDTH,
                                       .height = PAGE_HEIGHT,
                                       .stencil = d->ids,
                                       .stencil_stride = PAGE_WIDTH,
                                       .images = (const rl_compared_image(*)[RL_COMPARED])d->images,
                                       .files = files,
                                       .n_files = n_files};
    const rl_ab_page_input input = {.frame = &frame,
                                    .results = &results,
                                    .map = map_of,
                                    .ctx = d,
                                    .reference = o->reference ? d->images[PAGE_VARIANTS] : NULL};
    return rl_ab_page_frame(page, &input, err);
}

rl_code page_make(const page_make_options *o, rl_ab_page_summary *out, rl_error *err)
{
    const char *name = o->name ? o->name : "pre_post";
    const rl_variant variants[] = {{.name = "post"}, {.name = name}, {.name = "gaussian"}};
    const rl_ab_pair pairs[] = {{o->reference ? RL_AB_AGAINST : 0, 1}, {o->reference ? RL_AB_AGAINST : 0, 2}};
    const rl_ab_plan plan = {.variants = variants,
                             .n_variants = PAGE_VARIANTS,
                             .n_listed = PAGE_VARIANTS,
                             .pairs = pairs,
                             .n_pairs = 2};
    const size_t n_frames[] = {PAGE_FRAMES}, display_of[PAGE_VARIANTS] = {0};
    const rl_ab_page_display displays[] = {{"sRGB / Test", display, NULL}};
    const rl_ab_page_source source = {1, n_frames, displays, o->plain ? 0 : 1, display_of};
    const rl_ab_page_options options = {
        .folder = o->folder, .frames = o->report_frames, .budget = o->budget, .log = o->log};
    rl_ab_page *page = NULL;
    rl_str metrics = {0};
    frame_data *d = rl_malloc(sizeof *d);
    rl_code code = d ? rl_ab_page_new(&plan, &source, &options, &page, err) : rl_fail_memory(err, sizeof *d);
    for (int i = 0; i < PAGE_FRAMES && !code; i++)
        code = give_frame(page, o, d, i, err);
    make_metrics(o, name, &metrics);
    if (!code && metrics.failed)
        code = rl_fail_memory(err, metrics.length);
    if (!code)
        code = rl_ab_page_write(page, o->path, rl_str_text(&metrics), out, err);
    rl_ab_page_free(&page);
    rl_str_free(&metrics);
    rl_free(d);
    return code;
}
