/* The plan as JSON: everything that the text says, by index and by name. */
#include <jansson.h>
#include <limits.h>

#include "graph/base/text.h"
#include "graph/model/plan.h"

/* jansson answers NULL or -1 when memory is out and passes NULL on, so one flag at the end is enough. */
typedef struct writer {
    const rl_plan *plan;
    const rl_geometry *g; /* or NULL */
    int in_flight;
    bool failed;
} writer;

static void put(writer *w, json_t *object, const char *key, json_t *value)
{
    w->failed |= json_object_set_new(object, key, value) != 0;
}

static void append(writer *w, json_t *array, json_t *value)
{
    w->failed |= json_array_append_new(array, value) != 0;
}

static json_t *number(size_t n)
{
    return json_integer(n > (size_t)LLONG_MAX ? LLONG_MAX : (json_int_t)n);
}

/* -1 reads as null. */
static json_t *index_or_null(int i)
{
    return i < 0 ? json_null() : json_integer(i);
}

static json_t *indices(writer *w, const int *list, size_t n)
{
    json_t *array = json_array();
    for (size_t i = 0; i < n; i++)
        append(w, array, index_or_null(list[i]));
    return array;
}

static json_t *steps_json(writer *w)
{
    static const char *const kinds[] = {
        [RL_STEP_KERNEL] = "kernel",
        [RL_STEP_CONVERT] = "convert",
        [RL_STEP_COPY] = "copy",
    };
    json_t *array = json_array();
    for (size_t i = 0; i < w->plan->n_steps; i++) {
        const rl_plan_step *step = &w->plan->steps[i];
        json_t *o = json_object();
        put(w, o, "kind", json_string(kinds[step->kind]));
        if (step->kind == RL_STEP_KERNEL) {
            const rl_graph_node *node = &w->plan->graph->nodes[step->node];
            put(w, o, "node", json_string(node->name));
            put(w, o, "pass", json_string(node->pass->name));
            put(w, o, "entry", json_string(node->pass->steps.rows[step->step].entry));
        }
        put(w, o, "buffers", indices(w, step->buffers, (size_t)step->n_buffers));
        append(w, array, o);
    }
    return array;
}

static json_t *buffers_json(writer *w)
{
    json_t *array = json_array();
    for (size_t i = 0; i < w->plan->n_buffers; i++) {
        const rl_buffer *b = &w->plan->buffers[i];
        json_t *o = json_object();
        put(w, o, "name", json_string(b->name));
        put(w, o, "scratch", json_boolean(b->image < 0));
        put(w, o, "class", json_string(rl_buffer_class_name(b->kind)));
        put(w, o, "layout", json_string(rl_layout_name(b->layout)));
        put(w, o, "planes", json_integer(b->planes));
        if (b->image >= 0)
            put(w, o, "format", json_string(rl_format_name(w->plan->graph->images[b->image].format)));
        put(w, o, "slot", index_or_null(b->slot));
        put(w, o, "first", json_integer(b->first));
        put(w, o, "last", json_integer(b->last));
        if (w->g)
            put(w, o, "bytes", number(rl_buffer_bytes(b, w->g)));
        append(w, array, o);
    }
    return array;
}

static json_t *ports_json(writer *w, const rl_graph_node *node, const int *buffers)
{
    static const char *const roles[] = {
        [RL_READ] = "read",       [RL_WRITE] = "write",         [RL_HISTORY] = "history",
        [RL_SCRATCH] = "scratch", [RL_REDUCTION] = "reduction",
    };
    json_t *array = json_array();
    for (size_t p = 0; p < node->pass->ports.n; p++) {
        const rl_port *port = &node->pass->ports.rows[p];
        const int image = node->images[p];
        json_t *o = json_object();
        put(w, o, "name", json_string(port->name));
        put(w, o, "role", json_string(roles[port->role]));
        put(w, o, "format", json_string(rl_format_name(port->format)));
        put(w, o, "image", image < 0 ? json_null() : json_string(w->plan->graph->images[image].name));
        if (buffers)
            put(w, o, "buffer", index_or_null(buffers[p]));
        append(w, array, o);
    }
    return array;
}

static json_t *node_json(writer *w, int index, const int *buffers)
{
    const rl_graph_node *node = &w->plan->graph->nodes[index];
    json_t *o = json_object();
    put(w, o, "name", json_string(node->name));
    put(w, o, "pass", json_string(node->pass->name));
    put(w, o, "ports", ports_json(w, node, buffers));
    if (!buffers)
        put(w, o, "reason", json_string("no output needs it"));
    return o;
}

static json_t *outputs_json(writer *w)
{
    const rl_graph *graph = w->plan->graph;
    json_t *array = json_array();
    for (size_t i = 0; i < graph->n_outputs; i++) {
        const rl_graph_output *output = &graph->outputs[i];
        json_t *o = json_object(), *images = json_array();
        for (size_t k = 0; k < output->n_images; k++)
            append(w, images, json_string(graph->images[output->images[k]].name));
        put(w, o, "name", json_string(output->name));
        put(w, o, "images", images);
        put(w, o, "buffers", indices(w, w->plan->outputs[i], output->n_images));
        append(w, array, o);
    }
    return array;
}

static json_t *slots_json(writer *w)
{
    json_t *array = json_array();
    for (size_t s = 0; s < w->plan->n_slots; s++) {
        json_t *o = json_object(), *tenants = json_array();
        for (size_t i = 0; i < w->plan->n_buffers; i++)
            if (w->plan->buffers[i].slot == (int)s)
                append(w, tenants, number(i));
        put(w, o, "planes", json_integer(w->plan->slot_planes[s]));
        put(w, o, "buffers", tenants);
        if (w->g)
            put(w, o, "bytes", number(rl_slot_bytes(w->plan, (int)s, w->g)));
        append(w, array, o);
    }
    return array;
}

static json_t *memory_json(writer *w)
{
    const rl_geometry *g = w->g;
    json_t *o = json_object(), *window = json_array();
    put(w, o, "in_flight", json_integer(w->in_flight));
    put(w, o, "bytes", number(rl_plan_bytes(w->plan, g, w->in_flight)));
    put(w, o, "bytes_unshared", number(rl_plan_bytes_unshared(w->plan, g, w->in_flight)));
    const int numbers[] = {g->x, g->y, g->width, g->height};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(numbers); i++)
        append(w, window, json_integer(numbers[i]));
    put(w, o, "data_window", window);
    put(w, o, "columns", json_integer(g->columns));
    put(w, o, "rows", json_integer(g->rows));
    put(w, o, "stride", json_integer(g->stride));
    return o;
}

static int add_text(const char *text, size_t n, void *out)
{
    rl_str_addn(out, text, n);
    return ((rl_str *)out)->failed ? -1 : 0;
}

rl_code rl_plan_print_json(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out,
                           rl_error *err)
{
    writer w = {plan, g, in_flight, false};
    json_t *root = json_object(), *nodes = json_array(), *culled = json_array();
    for (size_t i = 0; i < plan->n_nodes; i++)
        append(&w, nodes, node_json(&w, plan->nodes[i].node, plan->nodes[i].buffers));
    for (size_t i = 0; i < plan->n_culled; i++)
        append(&w, culled, node_json(&w, plan->culled[i], NULL));
    put(&w, root, "nodes", nodes);
    put(&w, root, "steps", steps_json(&w));
    put(&w, root, "buffers", buffers_json(&w));
    put(&w, root, "slots", slots_json(&w));
    put(&w, root, "outputs", outputs_json(&w));
    put(&w, root, "culled", culled);
    if (g)
        put(&w, root, "memory", memory_json(&w));
    if (!w.failed)
        w.failed = json_dump_callback(root, add_text, out, JSON_INDENT(2)) != 0;
    rl_str_add(out, "\n");
    json_decref(root);
    return w.failed || out->failed
               ? rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "out of memory while the plan was written as JSON")
               : RL_OK;
}
