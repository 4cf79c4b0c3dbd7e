#include "fake_graph.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <cmocka.h>

static const rl_step one_step[] = {{"run", .domain = RL_EVERY_VECTOR}};
static const rl_step two_steps[] = {{"prepare", .domain = RL_EVERY_VECTOR},
                                    {"filter", .domain = RL_EVERY_PHASE}};

static const rl_port lighting_ports[] = {
    {PORT("albedo", RL_READ, RL_RGB)},
    {PORT("depth", RL_READ, RL_SCALAR)},
    {PORT("shadow", RL_READ, RL_LIGHTS), .optional = true},
    {PORT("diffuse", RL_WRITE, RL_RGB), .any_layout = true},
    {PORT("lit", RL_WRITE, RL_RGB)},
};
static const rl_port sss_ports[] = {
    {PORT("diffuse", RL_READ, RL_RGB), .layout = RL_PHASE4},
    {PORT("lit", RL_READ, RL_RGB)},
    {PORT("depth", RL_READ, RL_SCALAR), .layout = RL_PHASE4},
    {PORT("temp", RL_SCRATCH, RL_VEC2), .layout = RL_PHASE4},
    {PORT("color", RL_WRITE, RL_RGB)},
};
static const rl_port taa_ports[] = {
    {PORT("color", RL_READ, RL_RGB)},
    {PORT("depth", RL_READ, RL_SCALAR)},
    {PORT("history", RL_HISTORY, RL_RGB), .of = "color"},
    {PORT("last_z", RL_HISTORY, RL_SCALAR), .of = "depth"},
    {PORT("color", RL_WRITE, RL_RGB)},
};
static const rl_port view_ports[] = {{PORT("from", RL_READ, RL_RGB)}, {PORT("to", RL_WRITE, RL_RGB)}};

const rl_pass fake_lighting = {
    .name = "lighting", .ports = RL_ARRAY(lighting_ports), .steps = RL_ARRAY(one_step)};
const rl_pass fake_sss = {.name = "sss_burley", .ports = RL_ARRAY(sss_ports), .steps = RL_ARRAY(two_steps)};
const rl_pass fake_taa = {.name = "taa", .ports = RL_ARRAY(taa_ports), .steps = RL_ARRAY(one_step)};
const rl_pass fake_view = {.name = "view", .ports = RL_ARRAY(view_ports), .steps = RL_ARRAY(one_step)};

static const rl_node_input spare_inputs[] = {{"from", "aa.color", {0}}};
static const rl_node_input aa_inputs[] = {{"color", "sss.color", {0}}};
static const rl_node_input sss_inputs[] = {{"diffuse", "light.diffuse", {0}}, {"lit", "light.lit", {0}}};
const rl_node fake_nodes[4] = {
    {.name = "spare", .pass = &fake_view, .inputs = spare_inputs, .n_inputs = 1},
    {.name = "aa", .pass = &fake_taa, .inputs = aa_inputs, .n_inputs = 1},
    {.name = "light", .pass = &fake_lighting},
    {.name = "sss", .pass = &fake_sss, .inputs = sss_inputs, .n_inputs = 2},
};

const rl_graph *fake_graph(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_wanted *wanted,
                           size_t n_wanted)
{
    static const rl_layer_info layers[] = {
        {"albedo", RL_RGB, 3}, {"depth", RL_SCALAR, 1}, {"normal", RL_NORMAL, 3}, {"shadow", RL_LIGHTS, 2}};
    const rl_graph *graph = NULL;
    rl_error err = {0};
    if (rl_graph_build(arena, nodes, n_nodes, layers, RL_ARRAY_LENGTH(layers), wanted, n_wanted, &graph,
                       &err) != RL_OK)
        fail_msg("%s", err.text);
    return graph;
}
