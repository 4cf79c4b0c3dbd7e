/* The graph: binding, names, formats, histories, cycles, outputs with conversions. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "fake_graph.h"
#include "graph/base/alloc.h"
#include "graph/model/graph.h"

static const rl_step one_step[] = {{"run", .domain = RL_EVERY_PIXEL}};
#define FAKE(name_, ports_)                                                                                  \
    {                                                                                                        \
        .name = name_, .kernel = "f.cl", .ports = RL_ARRAY(ports_), .steps = RL_ARRAY(one_step)              \
    }

static const rl_port light_ports[] = {
    {PORT("albedo", RL_READ, RL_RGB)},
    {PORT("depth", RL_READ, RL_SCALAR)},
    {PORT("thickness", RL_READ, RL_SCALAR), .optional = true},
    {PORT("shadow", RL_READ, RL_LIGHTS), .optional = true},
    {PORT("diffuse", RL_WRITE, RL_RGB), .any_layout = true},
    {PORT("lit", RL_WRITE, RL_RGB)},
};
static const rl_port sss_ports[] = {
    {PORT("diffuse", RL_READ, RL_RGB), .layout = RL_PHASE4},
    {PORT("lit", RL_READ, RL_RGB)},
    {PORT("temp", RL_SCRATCH, RL_RGB)},
    {PORT("color", RL_WRITE, RL_RGB)},
};
static const rl_port taa_ports[] = {
    {PORT("color", RL_READ, RL_RGB)},
    {PORT("motion", RL_READ, RL_VEC2), .optional = true},
    {PORT("history", RL_HISTORY, RL_RGB), .of = "color"},
    {PORT("last_motion", RL_HISTORY, RL_VEC2), .of = "motion"},
    {PORT("depth", RL_READ, RL_SCALAR)},
    {PORT("last_z", RL_HISTORY, RL_SCALAR), .of = "depth"},
    {PORT("color", RL_WRITE, RL_RGB)},
};
static const rl_port mix_ports[] = {
    {PORT("a", RL_READ, RL_RGB)},
    {PORT("b", RL_READ, RL_RGB)},
    {PORT("out", RL_WRITE, RL_RGB)},
};
static const rl_port view_ports[] = {{PORT("from", RL_READ, RL_RGB)}, {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_port lamps_ports[] = {{PORT("out", RL_WRITE, RL_LIGHTS)}};
static const rl_port lost_ports[] = {{PORT("color", RL_READ, RL_RGB)},
                                     {PORT("old", RL_HISTORY, RL_RGB), .of = "colour"},
                                     {PORT("out", RL_WRITE, RL_RGB)}};
static const rl_port odd_ports[] = {{PORT("color", RL_READ, RL_RGB)},
                                    {PORT("old", RL_HISTORY, RL_SCALAR), .of = "color"},
                                    {PORT("out", RL_WRITE, RL_RGB)}};
static const rl_pass light = FAKE("lighting", light_ports), sss = FAKE("sss_burley", sss_ports),
                     taa = FAKE("taa", taa_ports), mix = FAKE("mix", mix_ports),
                     view = FAKE("view", view_ports), lamps = FAKE("lamps", lamps_ports),
                     lost = FAKE("lost", lost_ports), odd = FAKE("odd", odd_ports),
                     idle = {.name = "idle", .ports = RL_ARRAY(view_ports)};

static const rl_layer_info layers[] = {
    {"albedo", RL_RGB, 3},
    {"depth", RL_SCALAR, 1},
    {"normal", RL_NORMAL, 3},
    {"shadow.key", RL_SCALAR, 1},
};
static const rl_layer_info with_shadow[] = {
    {"albedo", RL_RGB, 3},
    {"depth", RL_SCALAR, 1},
    {"shadow", RL_LIGHTS, 2},
    {"thickness", RL_SCALAR, 0},
};

typedef struct fixture {
    rl_arena arena;
    rl_error err;
    const rl_graph *graph;
} fixture;

static int setup(void **state)
{
    static fixture f;
    f = (fixture){0};
    *state = &f;
    return 0;
}

static int teardown(void **state)
{
    rl_arena_free(&((fixture *)*state)->arena);
    return 0;
}

#define AT(line_)                                                                                            \
    {                                                                                                        \
        "p.yaml", line_, 7                                                                                   \
    }

static rl_code build(fixture *f, const rl_node *nodes, size_t n, const rl_wanted *wanted, size_t n_wanted)
{
    f->err = (rl_error){0};
    return rl_graph_build(&f->arena, nodes, n, layers, RL_ARRAY_LENGTH(layers), wanted, n_wanted, &f->graph,
                          &f->err);
}

static void expect_error(fixture *f, const rl_node *nodes, size_t n, int line, const char *text)
{
    assert_int_equal(build(f, nodes, n, NULL, 0), RL_E_CONFIG);
    assert_null(f->graph);
    assert_string_equal(f->err.text, text);
    assert_int_equal(f->err.line, line);
}

static const rl_node standard[] = {
    {"light", AT(1), &light, NULL, NULL, 0, NULL},
    {"sss", AT(2), &sss, NULL, INPUTS({"diffuse", "light.diffuse", AT(3)}, {"lit", "light.lit", AT(4)})},
    {"aa", AT(5), &taa, NULL, INPUTS({"color", "sss.color", AT(6)})},
};

/* The image on a node's port of that role. */
static const char *on_port(const rl_graph *g, size_t node, const char *name, rl_role role)
{
    for (size_t p = 0; p < g->nodes[node].pass->ports.n; p++) {
        const rl_port *port = &g->nodes[node].pass->ports.rows[p];
        if (port->role == role && !strcmp(port->name, name))
            return g->nodes[node].images[p] < 0 ? "-" : g->images[g->nodes[node].images[p]].name;
    }
    return "?";
}

static void binds_inputs(void **state)
{
    fixture *f = *state;
    assert_int_equal(build(f, standard, 3, NULL, 0), RL_OK);
    const rl_graph *g = f->graph;
    assert_int_equal(g->n_nodes, 3);
    assert_string_equal(on_port(g, 0, "albedo", RL_READ), "capture.albedo");
    assert_string_equal(on_port(g, 0, "thickness", RL_READ), "-");
    assert_string_equal(on_port(g, 0, "shadow", RL_READ), "-");
    assert_string_equal(on_port(g, 1, "diffuse", RL_READ), "light.diffuse");
    assert_string_equal(on_port(g, 1, "temp", RL_SCRATCH), "-");
    /* one name, two ports: what it reads, what it writes; history prefers what it writes */
    assert_string_equal(on_port(g, 2, "color", RL_READ), "sss.color");
    assert_string_equal(on_port(g, 2, "color", RL_WRITE), "aa.color");
    assert_string_equal(on_port(g, 2, "history", RL_HISTORY), "aa.color");
    assert_string_equal(on_port(g, 2, "last_z", RL_HISTORY), "capture.depth");
    assert_string_equal(on_port(g, 2, "last_motion", RL_HISTORY), "-");
    int lit = rl_graph_find(g, "light.lit");
    assert_true(lit >= 0);
    assert_int_equal(g->images[lit].node, 0);
    assert_int_equal(g->images[lit].port, 5);
    assert_int_equal(g->images[lit].planes, 3);
    int key = rl_graph_find(g, "capture.shadow.key");
    assert_true(key >= 0);
    assert_int_equal(g->images[key].node, -1);
    assert_int_equal(g->images[key].port, 3);
    assert_int_equal(rl_graph_find(g, "light.nothing"), -1);
}

static void binds_planes_of_lights(void **state)
{
    fixture *f = *state;
    const rl_graph *g = NULL;
    assert_int_equal(rl_graph_build(&f->arena, standard, 1, with_shadow, 4, NULL, 0, &g, &f->err), RL_OK);
    assert_string_equal(on_port(g, 0, "shadow", RL_READ), "capture.shadow");
    assert_int_equal(g->images[rl_graph_find(g, "capture.shadow")].planes, 2);
    assert_string_equal(on_port(g, 0, "thickness", RL_READ), "-"); /* a layer without planes is absent */
}

/* `in: {shadow: none}` leaves an optional layer out that the capture has. */
static void leaves_inputs_out(void **state)
{
    fixture *f = *state;
    const rl_graph *g = NULL;
    const rl_node dark = {"light", AT(1), &light, NULL, INPUTS({"shadow", "none", AT(2)})};
    assert_int_equal(rl_graph_build(&f->arena, &dark, 1, with_shadow, 4, NULL, 0, &g, &f->err), RL_OK);
    assert_string_equal(on_port(g, 0, "shadow", RL_READ), "-");
    assert_string_equal(on_port(g, 0, "albedo", RL_READ), "capture.albedo");
    const rl_node needed = {"light", AT(1), &light, NULL, INPUTS({"depth", "none", AT(2)})};
    expect_error(
        f, &needed, 1, 2,
        "pass 'light' (lighting): port 'depth' needs an image (scalar): only optional ones can be 'none'");
}

static void names_what_is_unknown(void **state)
{
    fixture *f = *state;
    const rl_node port = {"sss", AT(2), &sss, NULL, INPUTS({"difuse", "capture.albedo", AT(3)})};
    expect_error(
        f, &port, 1, 3,
        "pass 'sss' (sss_burley) has no input port 'difuse'; did you mean 'diffuse'? known: diffuse, lit");
    const rl_node written = {"sss", AT(2), &sss, NULL, INPUTS({"color", "capture.albedo", AT(3)})};
    expect_error(f, &written, 1, 3, "pass 'sss' (sss_burley) has no input port 'color'; known: diffuse, lit");
    const rl_node past = {"aa", AT(2), &taa, NULL, INPUTS({"history", "capture.albedo", AT(3)})};
    expect_error(f, &past, 1, 3,
                 "pass 'aa' (taa): port 'history' is the past of port 'color' and takes no image of its own");
    const rl_node node[] = {standard[0], {"aa", AT(2), &taa, NULL, INPUTS({"color", "lihgt.lit", AT(3)})}};
    expect_error(
        f, node, 2, 3,
        "pass 'aa' (taa): port 'color': no image 'lihgt.lit': the graph has no pass 'lihgt'; did you mean "
        "'light'? known: aa, capture, light");
    const rl_node image[] = {standard[0],
                             {"aa", AT(2), &taa, NULL, INPUTS({"color", "light.difuse", AT(3)})}};
    expect_error(
        f, image, 2, 3,
        "pass 'aa' (taa): port 'color': no image 'light.difuse': pass 'light' (lighting) does not write "
        "'difuse'; did you mean 'diffuse'? its images: diffuse, lit");
    const rl_node bare[] = {standard[0], {"aa", AT(2), &taa, NULL, INPUTS({"color", "light", AT(3)})}};
    expect_error(
        f, bare, 2, 3,
        "pass 'aa' (taa): port 'color': no image 'light': write 'light.IMAGE'; its images: diffuse, lit");
    const rl_node layer = {"aa", AT(2), &taa, NULL, INPUTS({"color", "capture.albdo", AT(3)})};
    expect_error(
        f, &layer, 1, 3,
        "pass 'aa' (taa): port 'color': no image 'capture.albdo': the capture has no layer 'albdo'; did you "
        "mean 'albedo'? its layers: albedo, depth, normal, shadow.key");
    const rl_node missing = {"sss", AT(2), &sss, NULL, INPUTS({"lit", "capture.albedo", AT(3)})};
    expect_error(
        f, &missing, 1, 2,
        "pass 'sss' (sss_burley): port 'diffuse' needs an image (rgb): `in:` does not name one and the "
        "capture has no layer 'diffuse'; its layers: albedo, depth, normal, shadow.key");
    const rl_node orphan = {"x", AT(2), &lost, NULL, INPUTS({"color", "capture.albedo", AT(3)})};
    expect_error(
        f, &orphan, 1, 2,
        "pass 'x' (lost): port 'old' is the past of port 'colour', which does not exist; did you mean "
        "'color'? known: color, out");
}

static void refuses_what_does_not_fit(void **state)
{
    fixture *f = *state;
    const rl_node wrong = {"aa", AT(2), &taa, NULL, INPUTS({"color", "capture.depth", AT(3)})};
    expect_error(f, &wrong, 1, 3, "pass 'aa' (taa): port 'color' takes rgb, 'capture.depth' is scalar");
    const rl_layer_info flat[] = {{"albedo", RL_SCALAR, 1}, {"depth", RL_SCALAR, 1}};
    assert_int_equal(rl_graph_build(&f->arena, standard, 1, flat, 2, NULL, 0, &f->graph, &f->err),
                     RL_E_CONFIG);
    const rl_node past = {"x", AT(2), &odd, NULL, INPUTS({"color", "capture.albedo", AT(3)})};
    expect_error(f, &past, 1, 2, "pass 'x' (odd): port 'old' takes scalar, 'capture.albedo' is rgb");
    const rl_node twice = {"aa", AT(2), &taa, NULL,
                           INPUTS({"color", "capture.albedo", AT(3)}, {"color", "capture.albedo", AT(4)})};
    expect_error(f, &twice, 1, 4, "pass 'aa' (taa): input 'color' is given twice");
    const rl_node many = {"lamps", AT(2), &lamps, NULL, NULL, 0, NULL};
    expect_error(
        f, &many, 1, 2,
        "pass 'lamps' (lamps): port 'out' cannot be of type lights: only the capture has a plane a light");
    const rl_node same[] = {standard[0], {"light", AT(9), &light, NULL, NULL, 0, NULL}};
    expect_error(f, same, 2, 9, "two passes are named 'light'");
    const rl_node capture = {"capture", AT(8), &light, NULL, NULL, 0, NULL};
    expect_error(f, &capture, 1, 8,
                 "a pass cannot be named 'capture': that is the name of the capture's layers");
    const rl_node lazy = {"i", AT(8), &idle, NULL, INPUTS({"from", "capture.albedo", AT(3)})};
    assert_int_equal(build(f, &lazy, 1, NULL, 0), RL_E_INTERNAL);
}

static void prints_cycles_whole(void **state)
{
    fixture *f = *state;
    /* data runs b -> c -> a -> b; d hangs on the cycle and is no part of it */
    const rl_node loop[] = {
        {"d", AT(1), &view, NULL, INPUTS({"from", "a.out", AT(1)})},
        {"a", AT(2), &mix, NULL, INPUTS({"a", "capture.albedo", AT(2)}, {"b", "c.out", AT(2)})},
        {"b", AT(3), &mix, NULL, INPUTS({"a", "a.out", AT(3)}, {"b", "capture.albedo", AT(3)})},
        {"c", AT(4), &mix, NULL, INPUTS({"a", "b.out", AT(4)}, {"b", "b.out", AT(4)})},
    };
    expect_error(f, loop, 4, 2,
                 "the graph has a cycle: a -> b -> c -> a (only a history port may look back)");
    const rl_node self = {"a", AT(2), &mix, NULL,
                          INPUTS({"a", "a.out", AT(2)}, {"b", "capture.albedo", AT(2)})};
    expect_error(f, &self, 1, 2, "the graph has a cycle: a -> a (only a history port may look back)");
}

static void converts_outputs(void **state)
{
    fixture *f = *state;
    static const int srgb, p3;
    const rl_pass *const one[] = {&view}, *const two[] = {&view, NULL};
    const void *const with_srgb[] = {&srgb}, *const with_p3[] = {&p3}, *const mixed[] = {&p3, NULL};
    const rl_output_layer color[] = {{"", "aa.color", AT(20)}};
    const rl_output_layer both[] = {{"beauty", "aa.color", AT(21)}, {"z", "capture.depth", AT(22)}};
    const rl_output_layer depth[] = {{"", "capture.depth", AT(23)}}, unknown[] = {{"", "aa.colr", AT(24)}};
    const rl_wanted wanted[] = {
        {"plain", AT(20), color, NULL, NULL, 1},
        {"a", AT(20), color, one, with_srgb, 1},
        {"b", AT(20), color, one, with_srgb, 1},
        {"c", AT(21), both, two, mixed, 2},
    };
    assert_int_equal(build(f, standard, 3, wanted, 4), RL_OK);
    const rl_graph *g = f->graph;
    assert_int_equal(g->n_outputs, 4);
    assert_int_equal(g->n_nodes, 5); /* a and b share one conversion */
    assert_string_equal(g->nodes[3].name, "output.a");
    assert_ptr_equal(g->nodes[3].params, &srgb);
    assert_string_equal(g->nodes[4].name, "output.c.beauty");
    assert_string_equal(g->images[g->outputs[0].images[0]].name, "aa.color");
    assert_string_equal(g->images[g->outputs[1].images[0]].name, "output.a.to");
    assert_int_equal(g->outputs[1].images[0], g->outputs[2].images[0]);
    assert_string_equal(g->images[g->outputs[3].images[0]].name, "output.c.beauty.to");
    assert_string_equal(g->images[g->outputs[3].images[1]].name, "capture.depth");
    assert_string_equal(on_port(g, 4, "from", RL_READ), "aa.color");

    const rl_wanted wrong = {"z", AT(23), depth, one, with_p3, 1},
                    gone = {"q", AT(24), unknown, NULL, NULL, 1};
    assert_int_equal(build(f, standard, 3, &wrong, 1), RL_E_CONFIG);
    assert_string_equal(
        f->err.text, "output 'z': only rgb images are colour-converted, 'capture.depth' is scalar; leave out "
                     "colorspace, display, view, look and exposure");
    assert_int_equal(f->err.line, 23);
    assert_int_equal(build(f, standard, 3, &gone, 1), RL_E_CONFIG);
    assert_string_equal(f->err.text,
                        "output 'q': no image 'aa.colr': pass 'aa' (taa) does not write 'colr'; did you "
                        "mean 'color'? its images: color");
    const rl_pass *const bad[] = {&mix};
    const rl_wanted unfit = {"m", AT(20), color, bad, NULL, 1};
    assert_int_equal(build(f, standard, 3, &unfit, 1), RL_E_INTERNAL);
}

/* A chain of many nodes, listed backwards: no recursion runs out of stack, no cycle is imagined. */
static void takes_long_chains(void **state)
{
    fixture *f = *state;
    enum { N = 3000 };
    rl_node *nodes = rl_arena_array(&f->arena, N, sizeof *nodes);
    rl_node_input *inputs = rl_arena_array(&f->arena, N, sizeof *inputs);
    for (int i = 0; i < N; i++) {
        inputs[i] = (rl_node_input){
            "from", i + 1 < N ? rl_arena_printf(&f->arena, "n%d.to", i + 1) : "capture.albedo", RL_NOWHERE};
        nodes[i] =
            (rl_node){rl_arena_printf(&f->arena, "n%d", i), RL_NOWHERE, &view, NULL, &inputs[i], 1, NULL};
    }
    assert_int_equal(build(f, nodes, N, NULL, 0), RL_OK);
    inputs[N - 1].image = "n0.to";
    assert_int_equal(build(f, nodes, N, NULL, 0), RL_E_CONFIG);
    assert_non_null(strstr(f->err.text, "cycle"));
}

/* Every allocation fails once: an error that says so, nothing lost. */
static void survives_failing_memory(void **state)
{
    fixture *f = *state;
    static const int p3;
    const rl_pass *const one[] = {&view};
    const void *const with_p3[] = {&p3};
    const rl_output_layer color[] = {{"", "aa.color", AT(20)}};
    const rl_wanted wanted = {"a", AT(20), color, one, with_p3, 1};
    const rl_node typo = {"aa", AT(2), &taa, NULL, INPUTS({"color", "capture.albdo", AT(3)})};
    for (int wrong = 0; wrong < 2; wrong++)
        for (unsigned long n = 1;; n++) {
            size_t before = rl_alloc_live();
            rl_alloc_fail_at(n, 1);
            rl_code code = wrong ? build(f, &typo, 1, NULL, 0) : build(f, standard, 3, &wanted, 1);
            rl_alloc_fail_at(0, 0);
            rl_arena_free(&f->arena);
            assert_int_equal(rl_alloc_live(), before);
            if (code != RL_E_MEMORY) {
                assert_int_equal(code, wrong ? RL_E_CONFIG : RL_OK);
                assert_true(n > 1);
                break;
            }
            assert_null(f->graph);
        }
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, setup, teardown)
int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(binds_inputs),          TEST(binds_planes_of_lights),    TEST(leaves_inputs_out),
        TEST(names_what_is_unknown), TEST(refuses_what_does_not_fit), TEST(prints_cycles_whole),
        TEST(converts_outputs),      TEST(takes_long_chains),         TEST(survives_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
