/* How wrong is each scattering model? Runs them all on a captured frame and compares with a path-traced
 * truth (tests/accuracy_scene.h says what the folder holds). Not a test; from the project's folder:
 *
 *     make accuracy TRUTH=folder [OUT=folder]
 *
 * Error is mean |result - truth| / mean truth, bias mean (result - truth) / mean truth, per channel, over the
 * pixels of a material at least 2 from a silhouette, a material's border or a hard shadow's edge.
 * Models are found in the registry: every pass from diffuse and lit to color, with every word of the
 * parameters that change its code. Pictures: OUT/MODEL.png, blue too dark, red too bright, full colour 10 %.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/pass.h"
#include "tests/accuracy_scene.h"

static bool has_port(const rl_pass *pass, const char *name, rl_role role)
{
    for (size_t i = 0; i < pass->ports.n; i++)
        if (!strcmp(pass->ports.rows[i].name, name) && pass->ports.rows[i].role == role)
            return true;
    return false;
}

static const rl_param *row_named(rl_params rows, const char *name)
{
    for (size_t i = 0; i < rows.n; i++)
        if (!strcmp(rows.rows[i].name, name))
            return &rows.rows[i];
    return NULL;
}

/* Word i of "a|b|c"; false: there are fewer. */
static bool word_at(const rl_param *row, size_t i, char *out, size_t size)
{
    const char *at = row->words ? row->words : row->type == RL_BOOL ? "true|false" : NULL;
    for (; at && i; i--) {
        at = strchr(at, '|');
        at = at ? at + 1 : NULL;
    }
    if (at)
        snprintf(out, size, "%.*s", (int)strcspn(at, "|"), at);
    return at != NULL;
}

typedef struct models {
    accuracy_model *list;
    size_t n, room;
} models;

static bool add(models *all, const accuracy_model *model)
{
    if (all->n == all->room) {
        size_t room = all->room ? 2 * all->room : 32;
        accuracy_model *list = rl_realloc(all->list, room * sizeof *list);
        if (!list)
            return false;
        all->list = list;
        all->room = room;
    }
    all->list[all->n++] = *model;
    return true;
}

/* Every word of the structural rows from `row` on; at the end, the numbers of taps and of frames. */
static bool expand(models *all, const rl_pass *pass, size_t row, const accuracy_model *so_far)
{
    accuracy_model next;
    char word[32];
    for (; row < pass->params.n; row++) {
        const rl_param *p = &pass->params.rows[row];
        if (!p->structural || (p->type != RL_ENUM && p->type != RL_BOOL))
            continue;
        for (size_t i = 0; word_at(p, i, word, sizeof word); i++) {
            next = *so_far;
            size_t a = strlen(next.name), b = strlen(next.sss);
            if (p->type == RL_BOOL)
                snprintf(next.name + a, sizeof next.name - a, " %s %s", p->name, word);
            else
                snprintf(next.name + a, sizeof next.name - a, " %s", word);
            snprintf(next.sss + b, sizeof next.sss - b, ", %s: %s", p->name, word);
            if (!expand(all, pass, row + 1, &next))
                return false;
        }
        return true;
    }
    if (!row_named(pass->params, "taps"))
        return add(all, so_far);
    static const char *const taps[] = {"21", "55", "auto"};
    for (size_t k = 0; k < 6; k++) {
        next = *so_far;
        next.settled = k & 1;
        size_t a = strlen(next.name), b = strlen(next.sss);
        snprintf(next.name + a, sizeof next.name - a, " %s%s", taps[k / 2], k & 1 ? ", 16 frames" : "");
        snprintf(next.sss + b, sizeof next.sss - b, ", taps: %s", taps[k / 2]);
        if (!add(all, &next))
            return false;
    }
    return true;
}

static bool find_models(models *all)
{
    accuracy_model none = {.name = "no scattering", .sss = "pass: combine"};
    bool ok = add(all, &none);
    for (size_t i = 0; ok && i < rl_pass_count(); i++) {
        const rl_pass *pass = rl_pass_at(i);
        accuracy_model model = {.unit = 0};
        if (!strcmp(pass->name, "combine") || !has_port(pass, "diffuse", RL_READ) ||
            !has_port(pass, "lit", RL_READ) || !has_port(pass, "color", RL_WRITE))
            continue;
        snprintf(model.name, sizeof model.name, "%s", pass->name);
        snprintf(model.sss, sizeof model.sss, "pass: %s", pass->name);
        bool mixture = row_named(pass->profile_keys, "gaussians") ||
                       !row_named(pass->profile_keys, "scatter_distance_mm");
        ok = expand(all, pass, 0, &model);
        if (ok && mixture) { /* published sets, then those that were fitted to d */
            snprintf(model.name, sizeof model.name, "%s, fitted to d,", pass->name);
            model.set = "fitted";
            ok = expand(all, pass, 0, &model);
        }
    }
    const rl_pass *lighting = rl_pass_find("lighting");
    const rl_param *diffuse = lighting ? row_named(lighting->shading_keys, "diffuse") : NULL;
    accuracy_model sg = {.name = "spherical Gaussians", .sss = "pass: combine", .shading = "sg"};
    char word[32];
    for (size_t i = 0; ok && diffuse && word_at(diffuse, i, word, sizeof word); i++)
        if (!strcmp(word, "sg"))
            ok = add(all, &sg);
    return ok;
}

/* Differences beside the truth's mean, as a picture. */
static bool write_picture(const accuracy_scene *s, const char *name, const float *color, const float *truth)
{
    rl_error err = {0};
    char path[1024], *file;
    int at = snprintf(path, sizeof path, "%s/", s->out);
    file = path + at;
    snprintf(file, sizeof path - (size_t)at, "%s.png", name);
    for (; *file; file++)
        *file = *file == ' ' || *file == ',' ? '_' : *file;
    float *planes = rl_calloc(3 * s->n, sizeof *planes);
    if (!planes)
        return false;
    for (size_t i = 0; i < s->n; i++) {
        float t = 0, d = 0;
        for (size_t c = 0; c < 3; c++) {
            t += truth[c * s->n + i];
            d += color[c * s->n + i] - truth[c * s->n + i];
        }
        d = t > 0 ? fmaxf(-1, fminf(1, 10 * d / t)) : 0;
        float base = s->id[i] ? (s->clear[i] ? 1.0f : 0.6f) : 0.2f;
        planes[i] = base * (d < 0 ? 1 + d : 1);
        planes[s->n + i] = base * (1 - fabsf(d));
        planes[2 * s->n + i] = base * (d > 0 ? 1 - d : 1);
    }
    rl_image_planes image = {
        .width = s->width, .height = s->height, .channels = 3, .stride = (size_t)s->width};
    for (size_t c = 0; c < 3; c++)
        image.plane[c] = planes + c * s->n;
    rl_code code =
        rl_image_file_write(path, &image, &(rl_image_options){.type = RL_IMAGE_U8}, NULL, NULL, &err);
    if (code)
        fprintf(stderr, "%s: error: %s\n", path, err.text);
    rl_free(planes);
    return !code;
}

/* The largest difference to the unfiltered surface when the camera is so far away that the filter is smaller
 * than half a pixel. */
static bool far_away(accuracy_scene *s, const accuracy_model *model, const float *bare, float *color,
                     double *worst)
{
    accuracy_model far = *model;
    far.unit = 1000;
    *worst = 0;
    if (!accuracy_render(s, &far, ACCURACY_MAIN, color))
        return false;
    for (size_t i = 0; i < 3 * s->n; i++)
        if (s->clear[i % s->n] && bare[i] > 0)
            *worst = fmax(*worst, fabs((double)color[i] / bare[i] - 1));
    return true;
}

static bool print_models(accuracy_scene *s, const models *all, float *color, float *bare)
{
    const accuracy_model far_bare = {.sss = "pass: combine", .unit = 1000};
    if (!accuracy_render(s, &far_bare, ACCURACY_MAIN, bare))
        return false;
    printf("| error, %% (bias, %%) |");
    for (size_t m = 0; m < s->n_materials; m++)
        if (s->materials[m].d_mm[0] > 0)
            printf(" %s R | G | B |", s->materials[m].name);
    printf(" far away |\n| --- |");
    for (size_t m = 0; m < s->n_materials; m++)
        if (s->materials[m].d_mm[0] > 0)
            printf(" --- | --- | --- |");
    printf(" --- |\n");
    for (const accuracy_model *model = all->list; model < all->list + all->n; model++) {
        double error[3], bias[3], worst;
        if (!accuracy_render(s, model, ACCURACY_MAIN, color) ||
            !write_picture(s, model->name, color, s->truth.planes))
            return false;
        printf("| %s |", model->name);
        for (const accuracy_material *m = s->materials; m < s->materials + s->n_materials; m++) {
            if (m->d_mm[0] <= 0)
                continue;
            accuracy_error(s, color, s->truth.planes, s->clear, m->id, error, bias);
            for (size_t c = 0; c < 3; c++)
                printf(" %.2f (%+.2f) |", 100 * error[c], 100 * bias[c]);
        }
        if (!far_away(s, model, bare, color, &worst))
            return false;
        printf(" %.3f |\n", 100 * worst);
        fflush(stdout);
    }
    return true;
}

/* Light that comes through from behind. */
static bool print_rim(accuracy_scene *s, float *color)
{
    static const char *const passes[][2] = {{"combine", "pass: combine"},
                                            {"sss_reference", "pass: sss_reference"},
                                            {"sss_burley, 16 frames", "pass: sss_burley, taps: auto"}};
    const rl_pass *lighting = rl_pass_find("lighting");
    const rl_param *from = lighting ? row_named(lighting->profile_keys, "thickness_from") : NULL;
    if (!from || !s->rim_truth.planes || !s->rim_lambert.planes)
        return true;
    printf("\n| rim light from behind, error, %% (bias, %%) | R | G | B |\n| --- | --- | --- | --- |\n");
    for (size_t i = 0; i < 3; i++) {
        bool more = true, gathered = false;
        for (size_t k = 0; more; k++) { /* 0: no transmission */
            accuracy_model model = {.settled = i == 2};
            double error[3], bias[3];
            snprintf(model.sss, sizeof model.sss, "%s", passes[i][1]);
            more = k == 0 || word_at(from, k - 1, model.thickness, sizeof model.thickness);
            if (!more && (!s->has_back || gathered))
                continue;
            if (!more) { /* behind the last word: the gather */
                snprintf(model.thickness, sizeof model.thickness, "%s", ACCURACY_GATHER);
                gathered = more = true;
            }
            if (!accuracy_render(s, &model, ACCURACY_RIM, color))
                return false;
            snprintf(model.name, sizeof model.name, "rim %s %s", passes[i][0], k ? model.thickness : "none");
            if (!write_picture(s, model.name, color, s->rim_truth.planes))
                return false;
            size_t n = accuracy_error(s, color, s->rim_truth.planes, s->ear, s->materials[0].id, error, bias);
            if (!n) /* nothing to see */
                return true;
            printf("| %s, thickness: %s (%zu pixels) |", passes[i][0], k ? model.thickness : "none", n);
            for (size_t c = 0; c < 3; c++)
                printf(" %.1f (%+.1f) |", 100 * error[c], 100 * bias[c]);
            printf("\n");
        }
    }
    return true;
}

int main(int argc, char **argv)
{
    accuracy_scene scene = {0};
    models all = {0};
    if (argc < 2 || argc > 3) {
        fprintf(stderr, "usage: accuracy TRUTH [OUT]\n");
        return 2;
    }
    bool ok = accuracy_scene_open(&scene, argv[1], argc > 2 ? argv[2] : "out/accuracy") && find_models(&all);
    float *color = rl_calloc(6 * scene.n + 1, sizeof *color);
    ok = ok && color && print_models(&scene, &all, color, color + 3 * scene.n) && print_rim(&scene, color);
    rl_free(color);
    rl_free(all.list);
    accuracy_scene_close(&scene);
    return ok ? 0 : 1;
}
