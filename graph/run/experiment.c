#include "graph/run/experiment_parts.h"

#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

/* ---- opening --------------------------------------------------------------------------------------------
 */

/* The error of one variant says whose it is. */
static void name_variant(const rl_variant *variant, rl_error *err)
{
    rl_error named = {.code = err->code, .line = err->line, .column = err->column};
    snprintf(named.file, sizeof named.file, "%s", err->file);
    snprintf(named.text, sizeof named.text, "variant '%.200s': %.1300s", variant->name, err->text);
    *err = named;
}

static rl_code open_variant(rl_experiment *x, size_t i, rl_error *err)
{
    const rl_variant *v = &x->variants[i];
    rl_options o = x->options;
    const size_t n = o.n_settings + v->n_settings;
    rl_setting *settings = rl_arena_array(&x->arena, n + 1, sizeof *settings);
    o.out = rl_path_join(&x->arena, x->options.out ? x->options.out : "out", v->name);
    if (!settings || !o.out)
        return rl_fail_memory(err, n * sizeof *settings);
    for (size_t k = 0; k < n; k++)
        settings[k] = k < o.n_settings ? o.settings[k] : v->settings[k - o.n_settings];
    o.pipeline = v->pipeline;
    o.pipeline_text = NULL;
    o.settings = settings;
    o.n_settings = n;
    rl_code code = rl_session_open_variant(&o, v->name, &x->sessions[i], err);
    if (code && x->n > 1)
        name_variant(v, err);
    return code;
}

static bool same_frames(const rl_sequence *a, const rl_sequence *b)
{
    return a->frames.n == b->frames.n &&
           !memcmp(a->frames.numbers, b->frames.numbers, a->frames.n * sizeof *a->frames.numbers);
}

/* One file has many spellings; the manifest with that of its folder without links. */
static rl_code print_spelled(const rl_manifest *m, rl_str *out, rl_error *err)
{
    rl_arena arena = {0};
    rl_manifest copy = *m;
    rl_code code = RL_OK;
    copy.patterns = rl_arena_array(&arena, (size_t)m->n_patterns, sizeof *copy.patterns);
    for (int i = 0; i < m->n_patterns && copy.patterns && !code; i++) {
        copy.patterns[i] = m->patterns[i];
        copy.patterns[i].path = rl_path_real(&arena, m->patterns[i].path);
        code = copy.patterns[i].path ? RL_OK : RL_E_MEMORY;
    }
    if (!copy.patterns || code)
        code = rl_fail_memory(err, (size_t)m->n_patterns * sizeof *copy.patterns);
    else
        rl_manifest_print(&copy, out);
    rl_arena_free(&arena);
    return !code && out->failed ? rl_fail_memory(err, out->room) : code;
}

static rl_code check_captures(const rl_experiment *x, rl_error *err)
{
    const rl_session *first = x->sessions[0];
    for (size_t i = 1; i < x->n; i++) {
        const rl_session *s = x->sessions[i];
        const char *what = s->n_sequences != first->n_sequences ? "another number of captures" : NULL;
        for (size_t k = 0; k < s->n_sequences && !what; k++) {
            const rl_sequence *a = &first->sequences[k], *b = &s->sequences[k];
            rl_str left = {0}, right = {0};
            rl_code code = print_spelled(a->manifest, &left, err);
            if (!code)
                code = print_spelled(b->manifest, &right, err);
            if (strcmp(rl_str_text(&left), rl_str_text(&right)))
                what = "another capture";
            else if (!same_frames(a, b))
                what = "other frames";
            rl_str_free(&left);
            rl_str_free(&right);
            if (code)
                return code;
        }
        if (what)
            return rl_fail_file(err, RL_E_CONFIG, x->variants[i].pipeline,
                                "variant '%s' processes %s than '%s'; --capture gives all the same one",
                                x->variants[i].name, what, x->variants[0].name);
    }
    return RL_OK;
}

static rl_code check_options(const rl_options *o, rl_error *err)
{
    if (o->shard[1] || o->resume || o->preroll)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                       "variants are compared in one run: --shard, --preroll and --resume do not apply");
    return RL_OK;
}

rl_code rl_experiment_open(const rl_options *options, const rl_variant *variants, size_t n,
                           rl_experiment **out, rl_error *err)
{
    *out = NULL;
    rl_experiment *x = rl_calloc(1, sizeof *x);
    if (!x)
        return rl_fail_memory(err, sizeof *x);
    x->options = *options;
    x->log = options->log;
    x->variants = variants;
    x->sessions = rl_arena_array(&x->arena, n + 1, sizeof *x->sessions);
    rl_code code = x->sessions ? check_options(options, err) : rl_fail_memory(err, n * sizeof *x->sessions);
    if (!code && !n)
        code = rl_fail(err, RL_E_USAGE, RL_NOWHERE, "an experiment needs a variant");
    x->n = code ? 0 : n;
    for (size_t i = 0; i < n && !code; i++)
        code = open_variant(x, i, err);
    if (!code)
        code = check_captures(x, err);
    x->n_captures = code ? 0 : x->sessions[0]->n_sequences;
    x->captures = rl_arena_array(&x->arena, x->n_captures + 1, sizeof *x->captures);
    if (!code && !x->captures)
        code = rl_fail_memory(err, x->n_captures * sizeof *x->captures);
    for (size_t k = 0; k < x->n_captures && !code; k++)
        code = rl_experiment_merge(x, k, err);
    if (code)
        rl_experiment_close(&x);
    *out = x;
    return code;
}

void rl_experiment_close(rl_experiment **experiment)
{
    rl_experiment *x = *experiment;
    *experiment = NULL;
    if (!x)
        return;
    for (size_t i = 0; i < x->n; i++)
        rl_session_close(&x->sessions[i]); /* executors before their device */
    rl_device_close(&x->device);
    rl_arena_free(&x->arena);
    rl_free(x);
}

/* ---- looking --------------------------------------------------------------------------------------------
 */

size_t rl_experiment_variants(const rl_experiment *x)
{
    return x->n;
}

const rl_session *rl_experiment_session(const rl_experiment *x, size_t variant)
{
    return variant < x->n ? x->sessions[variant] : NULL;
}

size_t rl_experiment_groups(const rl_experiment *x, size_t capture)
{
    return capture < x->n_captures ? x->captures[capture].n_groups : 0;
}

static const rl_group *group_at(const rl_experiment *x, size_t capture, size_t group)
{
    return group < rl_experiment_groups(x, capture) ? &x->captures[capture].groups[group] : NULL;
}

const char *rl_experiment_group_reason(const rl_experiment *x, size_t capture, size_t group)
{
    const rl_group *g = group_at(x, capture, group);
    return g ? g->reason : NULL;
}

const rl_plan *rl_experiment_plan(const rl_experiment *x, size_t capture, size_t group)
{
    const rl_group *g = group_at(x, capture, group);
    return g ? g->plan : NULL;
}

const char *const *rl_experiment_materials(const rl_experiment *x, size_t capture, size_t *n)
{
    *n = 0;
    if (capture >= x->n_captures)
        return NULL;
    const rl_materials *m = rl_experiment_sequence(x, 0, capture)->materials;
    *n = m->count;
    return m->names;
}

const char *rl_experiment_image_name(const rl_experiment *x, size_t variant, rl_compared which)
{
    if (variant >= x->n)
        return NULL;
    const rl_compared_names *names = &x->sessions[variant]->compared;
    return which == RL_COMPARED_LINEAR ? names->linear : names->display;
}
