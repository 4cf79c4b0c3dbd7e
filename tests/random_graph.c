#include "random_graph.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

enum { MOST_NODES = 10, MOST_IMAGES = 64, MOST_PORTS = 12 };

typedef struct made_image {
    const char *name, *layer; /* layer: its name as an implicit input, or NULL */
    rl_format format;
} made_image;

typedef struct maker {
    rl_arena *arena;
    unsigned long long state;
    made_image images[MOST_IMAGES];
    size_t n_images;
} maker;

/* splitmix64: any seed is a good one. */
static unsigned below(maker *m, unsigned n)
{
    unsigned long long z = m->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (unsigned)((z ^ (z >> 31)) % n);
}

static bool chance(maker *m, unsigned percent)
{
    return below(m, 100) < percent;
}

static const char *numbered(maker *m, const char *prefix, size_t i)
{
    const char *text = rl_arena_printf(m->arena, "%s%zu", prefix, i);
    assert_non_null(text);
    return text;
}

static rl_layout any_layout(maker *m)
{
    return chance(m, 40) ? RL_PHASE4 : RL_LINEAR;
}

static rl_format made_format(maker *m)
{
    static const rl_format formats[] = {RL_RGB, RL_RGB, RL_RGB, RL_SCALAR, RL_VEC2, RL_ID};
    return formats[below(m, RL_ARRAY_LENGTH(formats))];
}

static const rl_layer_info *make_layers(maker *m, size_t n)
{
    rl_layer_info *layers = rl_arena_array(m->arena, n, sizeof *layers);
    assert_non_null(layers);
    for (size_t i = 0; i < n; i++) {
        const bool lights = chance(m, 15);
        const rl_format format = lights ? RL_LIGHTS : made_format(m);
        static const int planes[] = {[RL_RGB] = 3, [RL_VEC2] = 2, [RL_SCALAR] = 1, [RL_ID] = 1};
        layers[i] =
            (rl_layer_info){numbered(m, "layer", i), format, lights ? 1 + (int)below(m, 5) : planes[format]};
        const char *name = rl_arena_printf(m->arena, "capture.%s", layers[i].name);
        m->images[m->n_images++] = (made_image){name, layers[i].name, format};
    }
    return layers;
}

/* Ports of a new pass that reads what exists; `inputs` names the images. */
static size_t make_ports(maker *m, rl_port *ports, rl_node_input *inputs, size_t *n_inputs)
{
    size_t n = 0, reads = below(m, 4), writes = 1 + below(m, 3),
           histories = chance(m, 35) ? 1 + below(m, 2) : 0;
    for (size_t i = 0; i < reads; i++) {
        /* recent images more often: chains, not fans */
        size_t span = chance(m, 50) && m->n_images > 4 ? 4 : m->n_images;
        const made_image *image = &m->images[m->n_images - 1 - below(m, (unsigned)span)];
        const bool implicit = image->layer && chance(m, 50);
        bool taken = false;
        for (size_t j = 0; j < n; j++)
            taken |= implicit && !strcmp(ports[j].name, image->layer);
        const char *name = implicit && !taken ? image->layer : numbered(m, "p", i);
        ports[n++] =
            (rl_port){.name = name, .role = RL_READ, .format = image->format, .layout = any_layout(m)};
        if (!implicit || taken)
            inputs[(*n_inputs)++] = (rl_node_input){name, image->name, RL_NOWHERE};
    }
    if (chance(m, 20))
        ports[n++] = (rl_port){.name = "absent", .role = RL_READ, .format = RL_RGB, .optional = true};
    for (size_t i = 0; i < writes; i++) /* may have the name of an input */
        ports[n++] = (rl_port){.name = numbered(m, chance(m, 50) ? "p" : "w", i),
                               .role = RL_WRITE,
                               .format = made_format(m),
                               .layout = any_layout(m),
                               .any_layout = chance(m, 40)};
    for (size_t i = 0, now = n; i < histories; i++) {
        const rl_port *of = &ports[below(m, (unsigned)now)];
        for (size_t j = 0; j < now; j++) /* an output hides the input of its name */
            if (ports[j].role == RL_WRITE && !strcmp(ports[j].name, of->name))
                of = &ports[j];
        ports[n++] = (rl_port){.name = numbered(m, "h", i),
                               .role = RL_HISTORY,
                               .format = of->format,
                               .of = of->name,
                               .layout = any_layout(m)};
    }
    for (size_t i = 0, scratch = chance(m, 40) ? 1 + below(m, 2) : 0; i < scratch; i++)
        ports[n++] = (rl_port){.name = numbered(m, "s", i),
                               .role = RL_SCRATCH,
                               .format = made_format(m),
                               .layout = any_layout(m)};
    /* roles in any order */
    for (size_t i = n; i > 1; i--) {
        size_t j = below(m, (unsigned)i);
        rl_port t = ports[i - 1];
        ports[i - 1] = ports[j];
        ports[j] = t;
    }
    return n;
}

static void make_node(maker *m, size_t index, rl_node *node)
{
    static const rl_step steps[] = {
        {"a", .domain = RL_EVERY_PIXEL}, {"b", .domain = RL_EVERY_VECTOR}, {"c", .domain = RL_EVERY_PHASE}};
    rl_port *ports = rl_arena_array(m->arena, MOST_PORTS, sizeof *ports);
    rl_node_input *inputs = rl_arena_array(m->arena, MOST_PORTS, sizeof *inputs);
    rl_pass *pass = rl_arena_alloc(m->arena, sizeof *pass);
    assert_true(ports && inputs && pass);
    size_t n_inputs = 0, n = make_ports(m, ports, inputs, &n_inputs);
    *pass = (rl_pass){.name = "random", .ports = {ports, n}, .steps = {steps, 1 + below(m, 3)}};
    *node = (rl_node){numbered(m, "n", index), RL_NOWHERE, pass, NULL, inputs, n_inputs, NULL};
    for (size_t p = 0; p < n; p++)
        if (ports[p].role == RL_WRITE) {
            const char *name = rl_arena_printf(m->arena, "%s.%s", node->name, ports[p].name);
            m->images[m->n_images++] = (made_image){name, NULL, ports[p].format};
        }
}

static void make_wanted(maker *m, size_t index, rl_wanted *wanted)
{
    static const rl_port ports[] = {
        {.name = "from", .role = RL_READ, .format = RL_RGB},
        {.name = "to", .role = RL_WRITE, .format = RL_RGB, .any_layout = true},
    };
    static const rl_step steps[] = {{"a", .domain = RL_EVERY_VECTOR}};
    static const rl_pass convert = {.name = "convert", .ports = RL_ARRAY(ports), .steps = RL_ARRAY(steps)};
    static const int params[2];
    size_t n = 1 + below(m, 3);
    rl_output_layer *layers = rl_arena_array(m->arena, n, sizeof *layers);
    const rl_pass **converts = rl_arena_array(m->arena, n, sizeof *converts);
    const void **with = rl_arena_array(m->arena, n, sizeof *with);
    assert_true(layers && converts && with);
    for (size_t i = 0; i < n; i++) {
        const made_image *image = &m->images[below(m, (unsigned)m->n_images)];
        layers[i] = (rl_output_layer){n > 1 ? numbered(m, "l", i) : "", image->name, RL_NOWHERE};
        converts[i] = image->format == RL_RGB && chance(m, 50) ? &convert : NULL;
        with[i] = &params[below(m, 2)];
    }
    *wanted = (rl_wanted){numbered(m, "o", index), RL_NOWHERE, layers, converts, with, n};
}

const rl_graph *random_graph(rl_arena *arena, unsigned long long seed)
{
    maker m = {.arena = arena, .state = seed};
    rl_node nodes[MOST_NODES];
    rl_wanted wanted[3];
    const rl_graph *graph = NULL;
    rl_error err = {0};
    size_t n_layers = 1 + below(&m, 5), n_nodes = 1 + below(&m, MOST_NODES), n_wanted = 1 + below(&m, 3);
    const rl_layer_info *layers = make_layers(&m, n_layers);
    for (size_t i = 0; i < n_nodes; i++)
        make_node(&m, i, &nodes[i]);
    for (size_t i = n_nodes; i > 1; i--) { /* the order of a file says nothing */
        size_t j = below(&m, (unsigned)i);
        rl_node t = nodes[i - 1];
        nodes[i - 1] = nodes[j];
        nodes[j] = t;
    }
    for (size_t i = 0; i < n_wanted; i++)
        make_wanted(&m, i, &wanted[i]);
    rl_code code = rl_graph_build(arena, nodes, n_nodes, layers, n_layers, wanted, n_wanted, &graph, &err);
    if (code != RL_OK)
        print_error("random graph %llu: %s\n", seed, err.text);
    assert_int_equal(code, RL_OK);
    return graph;
}
