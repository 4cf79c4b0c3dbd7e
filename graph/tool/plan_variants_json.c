/* The plan of several variants as JSON: an object a capture, each on its line. */
#include <inttypes.h>
#include <stdio.h>

#include "graph/tool/json_print.h"
#include "graph/tool/plan_variants_parts.h"

/* jansson passes NULL on when memory is out; rl_plan_variants_json looks once, at the end. */
static void put(json_t *object, const char *key, json_t *value, bool *failed)
{
    *failed |= json_object_set_new(object, key, value) != 0;
}

static void append(json_t *array, json_t *value, bool *failed)
{
    *failed |= json_array_append_new(array, value) != 0;
}

static json_t *variants_json(const rl_ab_plan *plan, bool *failed)
{
    json_t *array = json_array();
    for (size_t v = 0; v < plan->n_variants; v++) {
        const rl_variant *variant = &plan->variants[v];
        json_t *settings = json_array(), *o = json_object();
        for (size_t i = 0; i < variant->n_settings; i++)
            append(settings,
                   json_pack("{s:s, s:s}", "path", variant->settings[i].path, "value",
                             variant->settings[i].value),
                   failed);
        put(o, "name", json_string(variant->name), failed);
        put(o, "pipeline", json_string(variant->pipeline), failed);
        put(o, "settings", settings, failed);
        append(array, o, failed);
    }
    return array;
}

static json_t *cost_json(const rl_ab_plan *plan, const rl_experiment *e)
{
    rl_experiment_cost cost;
    rl_experiment_cost_of(e, &cost);
    return json_pack("{s:f, s:f, s:b, s:I}", "factor", cost.factor, "sum", cost.sum, "measured",
                     cost.measured, "variants", (json_int_t)plan->n_variants);
}

static json_t *nodes_json(const rl_ab_plan *plan, const rl_experiment *e, size_t capture, size_t group,
                          bool *failed)
{
    rl_merged_node node;
    json_t *array = json_array();
    for (size_t i = 0; rl_experiment_node(e, capture, i, &node); i++) {
        if (node.group != group)
            continue;
        json_t *used = json_array(), *o = json_object();
        char hash[24];
        snprintf(hash, sizeof hash, "%016" PRIx64, node.hash);
        for (size_t v = 0; v < plan->n_variants; v++)
            if (node.used[v])
                append(used, json_integer((json_int_t)v), failed);
        put(o, "name", json_string(node.name), failed);
        put(o, "pass", json_string(node.pass->name), failed);
        put(o, "hash", json_string(hash), failed);
        put(o, "variants", used, failed);
        put(o, "varied", json_boolean(!rl_variants_share(plan, &node)), failed);
        append(array, o, failed);
    }
    return array;
}

static json_t *group_json(const rl_ab_plan *plan, const rl_experiment *e, size_t capture, size_t group,
                          bool *failed, rl_error *err)
{
    const char *reason = rl_experiment_group_reason(e, capture, group);
    rl_str text = {0};
    json_t *o = json_object();
    put(o, "reason", reason ? json_string(reason) : json_null(), failed);
    put(o, "nodes", nodes_json(plan, e, capture, group, failed), failed);
    if (!rl_variants_group_plan(plan, e, capture, group, RL_PLAN_JSON, &text, err))
        put(o, "plan", json_loads(rl_str_text(&text), 0, NULL), failed);
    rl_str_free(&text);
    return o;
}

rl_code rl_plan_variants_json(const rl_ab_plan *plan, const rl_experiment *e, rl_str *out, rl_error *err)
{
    const rl_session *first = rl_experiment_session(e, 0);
    bool failed = false;
    for (size_t c = 0; c < rl_session_captures(first) && !failed && !err->code; c++) {
        json_t *o = json_object(), *groups = json_array();
        for (size_t g = 0; g < rl_experiment_groups(e, c); g++)
            append(groups, group_json(plan, e, c, g, &failed, err), &failed);
        put(o, "capture", json_string(rl_session_capture_name(first, c)), &failed);
        put(o, "variants", variants_json(plan, &failed), &failed);
        put(o, "cost", cost_json(plan, e), &failed);
        put(o, "compare_bytes", json_integer((json_int_t)rl_variants_compare_bytes(plan, e, c)), &failed);
        put(o, "groups", groups, &failed);
        rl_json_print(o, JSON_COMPACT | JSON_REAL_PRECISION(6), out);
        failed |= out->failed;
    }
    if (err->code)
        return err->code;
    return failed ? rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "out of memory while the plan was written as JSON")
                  : RL_OK;
}
