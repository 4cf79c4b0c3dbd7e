/* metrics.json. The rows of a long sequence are hundreds of thousands: text is made row by row, without a
 * tree of the whole. */
#include "graph/tool/ab_json.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/session.h"
#include "graph/tool/ab_energy.h"
#include "graph/tool/ab_fail.h"
#include "graph/tool/ab_json_parts.h"

/* ---- values -------------------------------------------------------------------------------------------- */

void rl_ab_json_text(rl_str *out, const char *text)
{
    json_t *value = json_string(text);
    char *copy = value ? NULL : rl_strdup(text), *quoted;
    for (char *c = copy; c && *c; c++)
        if ((unsigned char)*c >= 0x80)
            *c = '?';
    if (copy)
        value = json_string(copy);
    quoted = value ? json_dumps(value, JSON_ENCODE_ANY) : NULL;
    if (quoted)
        rl_str_add(out, quoted);
    else
        out->failed = true;
    free(quoted);
    json_decref(value);
    rl_free(copy);
}

void rl_ab_json_number(rl_str *out, double value)
{
    char number[32];
    rl_str_add(out, isfinite(value) ? rl_format_double(value, number) : "null");
}

static void text_or_null(rl_str *out, const char *text)
{
    if (text)
        rl_ab_json_text(out, text);
    else
        rl_str_add(out, "null");
}

static void stats_json(rl_str *out, const double stats[RL_STATS])
{
    for (int i = 0; i < RL_STATS; i++) {
        rl_str_printf(out, ", \"%s\": ", rl_stat_name((rl_stat)i));
        rl_ab_json_number(out, stats[i]);
    }
}

/* In front of an element of a list, a line each. */
static void element(rl_str *out, size_t i)
{
    rl_str_add(out, i ? ",\n  " : "\n  ");
}

/* ---- what was compared --------------------------------------------------------------------------------- */

static void variants_json(const rl_ab_report *r, rl_str *out)
{
    rl_str_add(out, " \"variants\": [");
    for (size_t v = 0; v < r->plan->n_listed; v++) {
        const rl_variant *variant = &r->plan->variants[v];
        element(out, v);
        rl_str_add(out, "{\"name\": ");
        rl_ab_json_text(out, variant->name);
        rl_str_add(out, ", \"pipeline\": ");
        rl_ab_json_text(out, variant->pipeline);
        rl_str_add(out, ", \"settings\": [");
        for (size_t i = 0; i < variant->n_settings; i++) {
            rl_str_add(out, i ? ", {\"path\": " : "{\"path\": ");
            rl_ab_json_text(out, variant->settings[i].path);
            rl_str_add(out, ", \"value\": ");
            rl_ab_json_text(out, variant->settings[i].value);
            rl_str_add(out, "}");
        }
        rl_str_printf(out, "], \"hash\": \"%016" PRIx64 "\"}",
                      rl_experiment_session(r->experiment, v)->content);
    }
    rl_str_add(out, "],\n \"parameters\": [");
    for (size_t i = 0; i < r->plan->n_parameters; i++) {
        const rl_ab_parameter *p = &r->plan->parameters[i];
        element(out, i);
        rl_str_add(out, "{\"path\": ");
        rl_ab_json_text(out, p->path);
        rl_str_add(out, ", \"values\": [");
        for (size_t v = 0; v < r->plan->n_listed; v++) {
            rl_str_add(out, v ? ", " : "");
            text_or_null(out, p->values[v]);
        }
        rl_str_add(out, "]}");
    }
    rl_str_add(out, "],\n");
}

/* "aa.color, linear Rec. 709" */
static void image_json(const rl_ab_report *r, const char *space, rl_str *out)
{
    rl_str text = {0};
    rl_str_printf(&text, "%s, %s", rl_experiment_image_name(r->experiment, 0, RL_COMPARED_LINEAR), space);
    rl_ab_json_text(out, rl_str_text(&text));
    out->failed = out->failed || text.failed;
    rl_str_free(&text);
}

static void pairs_json(const rl_ab_report *r, rl_str *out)
{
    rl_str_add(out, " \"pairs\": [");
    for (size_t i = 0; i < r->plan->n_pairs; i++) {
        const rl_ab_pair *pair = &r->plan->pairs[i];
        rl_str_add(out, i ? ", {\"reference\": " : "{\"reference\": ");
        if (pair->reference == RL_AB_AGAINST)
            rl_str_add(out, "null");
        else
            rl_str_printf(out, "%d", pair->reference);
        rl_str_printf(out, ", \"test\": %d}", pair->test);
    }
    rl_str_add(out, "],\n \"against\": ");
    text_or_null(out, r->plan->against);
    rl_str_add(out, ",\n \"images\": {\"linear\": ");
    image_json(r, "linear Rec. 709", out);
    rl_str_add(out, ", \"display\": ");
    image_json(r, rl_experiment_image_name(r->experiment, 0, RL_COMPARED_DISPLAY), out);
    rl_str_add(out, "},\n");
}

static void captures_json(const rl_ab_report *r, rl_str *out)
{
    const rl_session *session = rl_experiment_session(r->experiment, 0);
    rl_str_add(out, " \"captures\": [");
    for (size_t c = 0; c < rl_session_captures(session); c++) {
        size_t n;
        const char *const *materials = rl_experiment_materials(r->experiment, c, &n);
        element(out, c);
        rl_str_add(out, "{\"name\": ");
        rl_ab_json_text(out, rl_session_capture_name(session, c));
        rl_str_add(out, ", \"frames\": [");
        for (size_t i = 0; i < rl_session_frames(session, c); i++)
            rl_str_printf(out, "%s%lld", i ? ", " : "", rl_session_frame(session, c, i));
        rl_str_printf(out, "], \"width\": %d, \"height\": %d, \"materials\": [", r->results->sizes[c].width,
                      r->results->sizes[c].height);
        for (size_t i = 0; i < n; i++) {
            rl_str_add(out, i ? ", " : "");
            rl_ab_json_text(out, materials[i]);
        }
        rl_str_add(out, "]}");
    }
    rl_str_add(out, "],\n");
}

/* ---- how much it differs ------------------------------------------------------------------------------- */

static void metrics_json(const rl_ab_report *r, rl_str *out)
{
    static const char *const beyond[] = {"null", "false", "true"};
    rl_str_add(out, " \"metrics\": [");
    for (size_t i = 0; i < r->results->n_values && !out->failed; i++) {
        const rl_ab_value *v = &r->results->values[i];
        element(out, i);
        rl_str_printf(out, "{\"capture\": %zu, \"pair\": %zu, \"frame\": %lld, \"material\": ", v->capture,
                      v->pair, v->frame);
        text_or_null(out, rl_ab_material_name(r, v->capture, v->material));
        rl_str_printf(out, ", \"metric\": \"%s\", \"pixels\": %zu", rl_metric_name(v->metric), v->pixels);
        stats_json(out, v->stats);
        rl_str_printf(out, ", \"beyond_chance\": %s}", beyond[rl_ab_beyond_chance(r->results, v) + 1]);
    }
    rl_str_add(out, "],\n \"null\": [");
    for (size_t i = 0, n = 0; i < r->results->n_nulls; i++) {
        const rl_ab_null *null = &r->results->nulls[i];
        if (!null->n) /* a material that no frame showed */
            continue;
        element(out, n++);
        rl_str_printf(out, "{\"capture\": %zu, \"material\": ", null->capture);
        text_or_null(out, rl_ab_material_name(r, null->capture, null->material));
        rl_str_printf(out, ", \"metric\": \"%s\", \"n\": %zu", rl_metric_name(null->metric), null->n);
        stats_json(out, null->bounds);
        rl_str_add(out, "}");
    }
    size_t replicates = r->plan->n_variants - r->plan->n_listed;
    rl_str_printf(out, "],\n \"stochastic\": %s, \"seeds\": %zu, \"false_positives\": ",
                  r->plan->stochastic ? "true" : "false", replicates + 1);
    rl_ab_json_number(out, replicates ? 1 / ((double)replicates + 1) : (double)NAN);
    rl_str_add(out, ",\n");
}

static void failures_json(const rl_ab_report *r, rl_str *out)
{
    rl_str_add(out, " \"failed\": [");
    for (size_t i = 0; i < r->n_failures; i++) {
        const rl_ab_failure *f = &r->failures[i];
        element(out, i);
        rl_str_printf(out, "{\"capture\": %zu, \"frame\": %lld, \"text\": ", f->capture, f->frame);
        rl_ab_json_text(out, f->text);
        rl_str_add(out, "}");
    }
    rl_str_add(out, "],\n");
}

static void offender_json(const rl_ab_report *r, const rl_ab_offender *o, rl_str *out)
{
    rl_str_printf(out, "{\"capture\": %zu, ", o->capture);
    if (o->pair >= 0) {
        rl_str_printf(out, "\"pair\": %d, ", o->pair);
    } else {
        rl_str_printf(out, "\"pair\": null, \"variant\": %d, \"node\": ", o->variant);
        rl_ab_json_text(out, o->node);
        rl_str_add(out, ", ");
    }
    rl_str_printf(out, "\"frame\": %lld, \"material\": ", o->frame);
    text_or_null(out, rl_ab_material_name(r, o->capture, o->material));
    rl_str_add(out, ", \"value\": ");
    rl_ab_json_number(out, o->value);
    rl_str_add(out, "}");
}

static void thresholds_json(const rl_ab_report *r, rl_str *out)
{
    char name[32];
    rl_str_add(out, " \"thresholds\": [");
    for (size_t i = 0; i < r->n_verdicts; i++) {
        const rl_ab_verdict *v = &r->verdicts[i];
        element(out, i);
        rl_str_add(out, "{\"what\": ");
        rl_ab_json_text(out, rl_threshold_name(&v->threshold, name));
        rl_str_add(out, ", \"limit\": ");
        rl_ab_json_number(out, v->threshold.limit);
        rl_str_add(out, ", \"over\": [");
        for (size_t k = 0; k < v->n_over; k++) {
            rl_str_add(out, k ? ", " : "");
            offender_json(r, &v->over[k], out);
        }
        rl_str_add(out, "]}");
    }
    rl_str_add(out, "]\n");
}

rl_code rl_ab_json(const rl_ab_report *r, rl_str *out, rl_error *err)
{
    rl_str_printf(out, "{\n \"relit\": \"%s\",\n \"command\": ", RL_VERSION);
    text_or_null(out, r->command);
    rl_str_add(out, ",\n \"summary\": ");
    text_or_null(out, r->summary);
    rl_str_add(out, ",\n");
    variants_json(r, out);
    pairs_json(r, out);
    captures_json(r, out);
    metrics_json(r, out);
    rl_ab_energy_json(r, out);
    rl_ab_json_graph(r, out);
    rl_ab_json_cost(r, out);
    failures_json(r, out);
    thresholds_json(r, out);
    rl_str_add(out, "}\n");
    return out->failed ? rl_fail_memory(err, out->room) : RL_OK;
}
