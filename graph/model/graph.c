#include "graph/model/graph.h"

#include <string.h>

#include "graph/model/graph_build.h"

const char *rl_format_name(rl_format format)
{
    static const char *const names[] = {
        [RL_RGB] = "rgb", [RL_NORMAL] = "normal", [RL_VEC2] = "vec2", [RL_SCALAR] = "scalar",
        [RL_ID] = "id",   [RL_LIGHTS] = "lights", [RL_SUMS] = "sums",
    };
    return (unsigned)format < RL_ARRAY_LENGTH(names) ? names[format] : "unknown";
}

int rl_format_planes(rl_format format)
{
    static const int planes[] = {
        [RL_RGB] = 3, [RL_NORMAL] = 3, [RL_VEC2] = 2, [RL_SCALAR] = 1,
        [RL_ID] = 1,  [RL_LIGHTS] = 0, [RL_SUMS] = 0,
    };
    return (unsigned)format < RL_ARRAY_LENGTH(planes) ? planes[format] : 0;
}

int rl_graph_find(const rl_graph *graph, const char *name)
{
    for (size_t i = 0; i < graph->n_images; i++)
        if (!strcmp(graph->images[i].name, name))
            return (int)i;
    return -1;
}

/* ---- walking ---------------------------------------------------------------------------------------------
 */

/* The producer behind the next READ port of a node at or after *port, or -1 when there is none left. */
static int next_producer(const rl_image *images, const rl_graph_node *node, size_t *port)
{
    while (*port < node->pass->ports.n) {
        size_t p = (*port)++;
        if (node->pass->ports.rows[p].role == RL_READ && node->images[p] >= 0 &&
            images[node->images[p]].node >= 0)
            return images[node->images[p]].node;
    }
    return -1;
}

/* The stack from `closing` upwards is the cycle, each node needing the next: data flows the other way. */
static size_t cut_cycle(const int *stack, size_t depth, int closing, int *order)
{
    size_t from = depth, n = 0;
    while (stack[from - 1] != closing)
        from--;
    for (size_t i = depth; i >= from; i--)
        order[n++] = stack[i - 1];
    return n;
}

rl_code rl_graph_walk(rl_arena *arena, const rl_image *images, const rl_graph_node *nodes, size_t n_nodes,
                      const int *roots, size_t n_roots, int *order, size_t *n_order, bool *cycle,
                      rl_error *err)
{
    enum { NEW, OPEN, DONE };
    unsigned char *state = rl_arena_alloc(arena, n_nodes);
    size_t *port = rl_arena_array(arena, n_nodes, sizeof *port);
    int *stack = rl_arena_array(arena, n_nodes, sizeof *stack);
    *n_order = 0;
    *cycle = false;
    if (!state || !port || !stack)
        return rl_fail_memory(err, n_nodes * (1 + sizeof *port + sizeof *stack));
    for (size_t r = 0; r < n_roots; r++) {
        size_t depth = 0;
        if (roots[r] >= 0 && state[roots[r]] == NEW) {
            state[roots[r]] = OPEN;
            stack[depth++] = roots[r];
        }
        while (depth) {
            int node = stack[depth - 1], need = next_producer(images, &nodes[node], &port[node]);
            if (need < 0) {
                state[node] = DONE;
                order[(*n_order)++] = node;
                depth--;
            } else if (state[need] == NEW) {
                state[need] = OPEN;
                stack[depth++] = need;
            } else if (state[need] == OPEN) {
                *cycle = true;
                *n_order = cut_cycle(stack, depth, need, order);
                return RL_OK;
            }
        }
    }
    return RL_OK;
}

/* "sss -> aa -> sss", from the node that the file lists first. */
static rl_code fail_cycle(rl_graph_builder *b, const int *cycle, size_t n)
{
    size_t start = 0;
    rl_str text = {0};
    for (size_t i = 1; i < n; i++)
        if (cycle[i] < cycle[start])
            start = i;
    for (size_t i = 0; i <= n; i++)
        rl_str_printf(&text, "%s%s", i ? " -> " : "", b->nodes[cycle[(start + i) % n]].name);
    rl_code code =
        rl_fail(b->err, RL_E_CONFIG, b->nodes[cycle[start]].where,
                "the graph has a cycle: %s (only a history port may look back)", rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

static rl_code check_cycles(rl_graph_builder *b)
{
    int *order = rl_arena_array(b->arena, b->n_nodes, sizeof *order);
    int *roots = rl_arena_array(b->arena, b->n_nodes, sizeof *roots);
    if (!order || !roots)
        return rl_fail_memory(b->err, 2 * b->n_nodes * sizeof *order);
    for (size_t i = 0; i < b->n_nodes; i++)
        roots[i] = (int)i;
    size_t n = 0;
    bool cycle = false;
    rl_code code = rl_graph_walk(b->arena, b->images, b->nodes, b->n_nodes, roots, b->n_nodes, order, &n,
                                 &cycle, b->err);
    return code == RL_OK && cycle ? fail_cycle(b, order, n) : code;
}

/* ---- nodes and images ------------------------------------------------------------------------------------
 */

static rl_code add_image(rl_graph_builder *b, const char *group, const char *name, rl_image image)
{
    image.name = rl_arena_printf(b->arena, "%s.%s", group, name);
    if (!image.name)
        return rl_fail_memory(b->err, strlen(group) + strlen(name) + 2);
    b->images[b->n_images++] = image;
    return RL_OK;
}

static rl_code check_pass(rl_graph_builder *b, const char *name, rl_where where, const rl_pass *pass)
{
    if (!pass->steps.n)
        return rl_fail(b->err, RL_E_INTERNAL, where, "pass '%s' (%s) has no steps", name, pass->name);
    for (size_t p = 0; p < pass->ports.n; p++) {
        const rl_port *port = &pass->ports.rows[p];
        if (port->format == RL_LIGHTS && (port->role == RL_WRITE || port->role == RL_SCRATCH))
            return rl_fail(
                b->err, RL_E_CONFIG, where,
                "pass '%s' (%s): port '%s' cannot be of type lights: only the capture has a plane a light",
                name, pass->name, port->name);
    }
    return RL_OK;
}

static rl_code add_node(rl_graph_builder *b, const rl_node *node)
{
    rl_code code = check_pass(b, node->name, node->where, node->pass);
    const size_t n_ports = node->pass->ports.n;
    int *bound = rl_arena_array(b->arena, n_ports, sizeof *bound);
    if (code != RL_OK)
        return code;
    if (!bound)
        return rl_fail_memory(b->err, n_ports * sizeof *bound);
    int index = (int)b->n_nodes++;
    b->bound[index] = bound;
    b->nodes[index] = (rl_graph_node){.name = node->name,
                                      .where = node->where,
                                      .pass = node->pass,
                                      .params = node->params,
                                      .images = bound};
    for (size_t p = 0; p < n_ports && code == RL_OK; p++) {
        const rl_port *port = &node->pass->ports.rows[p];
        bound[p] = -1;
        if (!rl_port_makes(port))
            continue;
        bound[p] = (int)b->n_images;
        code = add_image(b, node->name, port->name,
                         (rl_image){.format = port->format,
                                    .planes = rl_format_planes(port->format),
                                    .node = index,
                                    .port = (int)p});
    }
    return code;
}

static rl_code add_nodes(rl_graph_builder *b, const rl_node *nodes, size_t n_nodes)
{
    for (size_t i = 0; i < n_nodes; i++) {
        if (!strcmp(nodes[i].name, "capture"))
            return rl_fail(b->err, RL_E_CONFIG, nodes[i].where,
                           "a pass cannot be named 'capture': that is the name of the capture's layers");
        for (size_t j = 0; j < i; j++)
            if (!strcmp(nodes[i].name, nodes[j].name))
                return rl_fail(b->err, RL_E_CONFIG, nodes[i].where, "two passes are named '%s'",
                               nodes[i].name);
        rl_code code = add_node(b, &nodes[i]);
        if (code != RL_OK)
            return code;
    }
    return RL_OK;
}

static rl_code add_layers(rl_graph_builder *b, const rl_layer_info *layers, size_t n_layers)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < n_layers && code == RL_OK; i++)
        if (layers[i].planes > 0)
            code = add_image(
                b, "capture", layers[i].name,
                (rl_image){
                    .format = layers[i].format, .planes = layers[i].planes, .node = -1, .port = (int)i});
    return code;
}

/* ---- outputs ---------------------------------------------------------------------------------------------
 */

/* The READ and the WRITE port of a pass that converts, or false. */
static bool convert_ports(const rl_pass *pass, size_t *read, size_t *write)
{
    size_t n_reads = 0, n_writes = 0;
    for (size_t p = 0; p < pass->ports.n; p++) {
        if (pass->ports.rows[p].role == RL_READ) {
            *read = p;
            n_reads++;
        } else if (pass->ports.rows[p].role == RL_WRITE) {
            *write = p;
            n_writes++;
        }
    }
    return n_reads == 1 && n_writes == 1;
}

/* The image that `pass` makes of *image; an equal conversion that another output asked for is shared. */
static rl_code convert_image(rl_graph_builder *b, size_t first_added, const rl_wanted *wanted, size_t layer,
                             int *image)
{
    const rl_pass *pass = wanted->convert[layer];
    const rl_output_layer *l = &wanted->layers[layer];
    const void *params = wanted->convert_params ? wanted->convert_params[layer] : NULL;
    size_t read = 0, write = 0;
    if (!convert_ports(pass, &read, &write))
        return rl_fail(b->err, RL_E_INTERNAL, l->where,
                       "pass '%s' cannot convert output '%s': it needs one port to read and one to write",
                       pass->name, wanted->name);
    for (size_t i = first_added; i < b->n_nodes; i++)
        if (b->nodes[i].pass == pass && b->nodes[i].params == params && b->nodes[i].images[read] == *image) {
            *image = b->nodes[i].images[write];
            return RL_OK;
        }
    const bool plain = wanted->n_layers == 1 || !l->name || !*l->name;
    const char *name =
        rl_arena_printf(b->arena, "output.%s%s%s", wanted->name, plain ? "" : ".", plain ? "" : l->name);
    if (!name)
        return rl_fail_memory(b->err, strlen(wanted->name) + 16);
    if (b->images[*image].format != pass->ports.rows[read].format)
        return rl_fail(
            b->err, RL_E_CONFIG, l->where,
            "output '%s': only %s images are colour-converted, '%s' is %s; leave out colorspace, display, "
            "view, look and exposure",
            wanted->name, rl_format_name(pass->ports.rows[read].format), b->images[*image].name,
            rl_format_name(b->images[*image].format));
    rl_code code = add_node(b, &(rl_node){.name = name, .pass = pass, .params = params});
    if (code != RL_OK)
        return code;
    b->bound[b->n_nodes - 1][read] = *image;
    *image = b->nodes[b->n_nodes - 1].images[write];
    return RL_OK;
}

/* Data beside colours in one file stays as it is: a conversion is of the colours. */
static bool is_data_beside(const rl_graph_builder *b, const rl_wanted *wanted, size_t layer, int image)
{
    size_t read = 0, write = 0;
    return wanted->n_layers > 1 && convert_ports(wanted->convert[layer], &read, &write) &&
           b->images[image].format != wanted->convert[layer]->ports.rows[read].format;
}

static rl_code add_output(rl_graph_builder *b, size_t first_added, const rl_wanted *wanted,
                          rl_graph_output *out)
{
    int *images = rl_arena_array(b->arena, wanted->n_layers, sizeof *images);
    const char *user = rl_arena_printf(b->arena, "output '%s'", wanted->name);
    if (!images || !user)
        return rl_fail_memory(b->err, wanted->n_layers * sizeof *images);
    *out = (rl_graph_output){wanted->name, images, wanted->n_layers};
    rl_code code = RL_OK;
    for (size_t i = 0; i < wanted->n_layers && code == RL_OK; i++) {
        code = rl_graph_resolve(b, wanted->layers[i].image, wanted->layers[i].where, user, &images[i]);
        if (code == RL_OK && wanted->convert && wanted->convert[i] &&
            !is_data_beside(b, wanted, i, images[i]))
            code = convert_image(b, first_added, wanted, i, &images[i]);
    }
    return code;
}

/* ---- all of it -------------------------------------------------------------------------------------------
 */

static rl_code make_room(rl_graph_builder *b, const rl_node *nodes, size_t n_nodes, size_t n_layers,
                         const rl_wanted *wanted, size_t n_wanted)
{
    size_t most_nodes = n_nodes, most_images = n_layers;
    for (size_t i = 0; i < n_nodes; i++)
        most_images += nodes[i].pass->ports.n;
    for (size_t i = 0; i < n_wanted; i++) {
        most_nodes += wanted[i].n_layers;
        most_images += wanted[i].n_layers;
    }
    b->images = rl_arena_array(b->arena, most_images, sizeof *b->images);
    b->nodes = rl_arena_array(b->arena, most_nodes, sizeof *b->nodes);
    b->bound = rl_arena_array(b->arena, most_nodes, sizeof *b->bound);
    if (!b->images || !b->nodes || !b->bound)
        return rl_fail_memory(b->err, most_images * sizeof *b->images + most_nodes * sizeof *b->nodes);
    return RL_OK;
}

rl_code rl_graph_build(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_layer_info *layers,
                       size_t n_layers, const rl_wanted *wanted, size_t n_wanted, const rl_graph **out,
                       rl_error *err)
{
    rl_graph_builder b = {.arena = arena, .err = err};
    rl_graph *graph = rl_arena_alloc(arena, sizeof *graph);
    rl_graph_output *outputs = rl_arena_array(arena, n_wanted, sizeof *outputs);
    *out = NULL;
    if (!graph || !outputs)
        return rl_fail_memory(err, sizeof *graph + n_wanted * sizeof *outputs);
    rl_code code = make_room(&b, nodes, n_nodes, n_layers, wanted, n_wanted);
    if (code == RL_OK)
        code = add_layers(&b, layers, n_layers);
    if (code == RL_OK)
        code = add_nodes(&b, nodes, n_nodes);
    for (size_t i = 0; i < n_nodes && code == RL_OK; i++)
        code = rl_graph_bind(&b, i, nodes[i].inputs, nodes[i].n_inputs);
    if (code == RL_OK)
        code = check_cycles(&b);
    for (size_t i = 0; i < n_wanted && code == RL_OK; i++)
        code = add_output(&b, n_nodes, &wanted[i], &outputs[i]);
    if (code != RL_OK)
        return code;
    *graph = (rl_graph){b.images, b.n_images, b.nodes, b.n_nodes, outputs, n_wanted};
    *out = graph;
    return RL_OK;
}
