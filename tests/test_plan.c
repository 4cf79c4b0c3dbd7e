/* Plans: order, culling, layouts, history, slots, geometry, bytes, on graphs small enough to know the answer.
 */
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "fake_graph.h"
#include "graph/base/alloc.h"
#include "graph/model/plan.h"
#include "kernels/shared.h"
#include "plan_simulator.h"

static const rl_step one_step[] = {{"run", .domain = RL_EVERY_VECTOR}};
#define FAKE(name_, ports_)                                                                                  \
    {                                                                                                        \
        .name = name_, .ports = RL_ARRAY(ports_), .steps = RL_ARRAY(one_step)                                \
    }
static const rl_port phase_ports[] = {{PORT("from", RL_READ, RL_RGB), .layout = RL_PHASE4},
                                      {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_port free_ports[] = {{PORT("from", RL_READ, RL_RGB)},
                                     {PORT("to", RL_WRITE, RL_RGB), .any_layout = true}};
static const rl_port past_ports[] = {{PORT("from", RL_READ, RL_RGB)},
                                     {PORT("old", RL_HISTORY, RL_RGB), .of = "from"},
                                     {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_port past4_ports[] = {{PORT("from", RL_READ, RL_RGB)},
                                      {PORT("old", RL_HISTORY, RL_RGB), .of = "from", .layout = RL_PHASE4},
                                      {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_port mix_ports[] = {
    {PORT("a", RL_READ, RL_RGB)}, {PORT("b", RL_READ, RL_RGB)}, {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_port narrow_ports[] = {{PORT("from", RL_READ, RL_RGB)}, {PORT("to", RL_WRITE, RL_SCALAR)}};
static const rl_port wide_ports[] = {{PORT("from", RL_READ, RL_SCALAR)}, {PORT("to", RL_WRITE, RL_RGB)}};
static const rl_pass phase = FAKE("phase", phase_ports), any = FAKE("any", free_ports),
                     past = FAKE("past", past_ports), past4 = FAKE("past4", past4_ports),
                     mix = FAKE("mix", mix_ports), narrow = FAKE("narrow", narrow_ports),
                     wide = FAKE("wide", wide_ports);

/* A node with one input "from", and one with "a" and "b". */
#define NODE(name_, pass_, image_)                                                                           \
    {                                                                                                        \
        .name = name_, .pass = pass_, INPUTS({"from", image_, {0}})                                          \
    }
#define MIX(name_, a_, b_)                                                                                   \
    {                                                                                                        \
        .name = name_, .pass = &mix, INPUTS({"a", a_, {0}}, {"b", b_, {0}})                                  \
    }

static rl_arena arena;

static int teardown(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    return 0;
}

/* Plans for outputs of one image each, and lets the simulator look at it. */
static const rl_plan *plan_for(const rl_node *nodes, size_t n, const char *const *images, size_t n_images)
{
    rl_wanted wanted[4] = {0};
    rl_output_layer layers[4] = {0};
    for (size_t i = 0; i < n_images; i++) {
        layers[i] = (rl_output_layer){"", images[i], {0}};
        wanted[i] = (rl_wanted){.name = images[i], .layers = &layers[i], .n_layers = 1};
    }
    const rl_graph *graph = fake_graph(&arena, nodes, n, wanted, n_images);
    const rl_plan *plan = NULL;
    rl_error err = {0};
    assert_int_equal(rl_plan_make(&arena, graph, &plan, &err), RL_OK);
    assert_int_equal(err.code, RL_OK);
    const char *fault = simulate_plan(plan, 3);
    if (fault)
        fail_msg("%s", fault);
    return plan;
}
#define PLAN(nodes, ...)                                                                                     \
    plan_for(nodes, RL_ARRAY_LENGTH(nodes), (const char *const[]){__VA_ARGS__},                              \
             sizeof((const char *const[]){__VA_ARGS__}) / sizeof(char *))

static int count(const rl_plan *plan, rl_step_kind kind)
{
    int n = 0;
    for (size_t i = 0; i < plan->n_steps; i++)
        n += plan->steps[i].kind == kind;
    return n;
}

/* The only buffer of that image, layout and class; -1: none. */
static int find(const rl_plan *plan, const char *name, rl_layout layout, rl_buffer_class kind)
{
    int found = -1;
    for (size_t i = 0; i < plan->n_buffers; i++) {
        const rl_buffer *b = &plan->buffers[i];
        if (!strcmp(b->name, name) && b->layout == layout && b->kind == kind) {
            assert_int_equal(found, -1);
            found = (int)i;
        }
    }
    return found;
}

static int find_all(const rl_plan *plan, const char *name)
{
    int n = 0;
    for (size_t i = 0; i < plan->n_buffers; i++)
        n += !strcmp(plan->buffers[i].name, name);
    return n;
}

static void orders_and_culls(void **state)
{
    (void)state;
    const rl_plan *plan = PLAN(fake_nodes, "aa.color");
    static const char *const order[] = {"light", "sss", "aa"};
    assert_int_equal(plan->n_nodes, 3);
    for (int i = 0; i < 3; i++)
        assert_string_equal(plan->graph->nodes[plan->nodes[i].node].name, order[i]);
    assert_int_equal(plan->n_culled, 1);
    assert_string_equal(plan->graph->nodes[plan->culled[0]].name, "spare");
    assert_int_equal(find_all(plan, "capture.normal"), 0); /* a layer that nobody reads is not loaded */

    plan = PLAN(fake_nodes, "light.lit");
    assert_int_equal(plan->n_nodes, 1);
    assert_int_equal(plan->n_culled, 3);
    assert_int_equal(find(plan, "light.diffuse", RL_LINEAR, RL_BUFFER_TRANSIENT) >= 0,
                     1); /* it is written anyway */

    plan = PLAN(fake_nodes, "capture.normal"); /* nothing to run */
    assert_int_equal(plan->n_steps, 0);
    assert_int_equal(plan->n_culled, 4);
    assert_int_equal(plan->outputs[0][0], find(plan, "capture.normal", RL_LINEAR, RL_BUFFER_SOURCE));
}

/* Two branches: each is finished before the next begins, so that only its end lives on. */
static void finishes_a_branch_first(void **state)
{
    (void)state;
    const rl_node nodes[] = {
        NODE("a1", &fake_view, "capture.albedo"),
        NODE("b1", &fake_view, "capture.albedo"),
        NODE("a2", &fake_view, "a1.to"),
        NODE("b2", &fake_view, "b1.to"),
        MIX("end", "a2.to", "b2.to"),
    };
    const rl_plan *plan = PLAN(nodes, "end.to");
    static const char *const order[] = {"a1", "a2", "b1", "b2", "end"};
    for (int i = 0; i < 5; i++)
        assert_string_equal(plan->graph->nodes[plan->nodes[i].node].name, order[i]);
    assert_int_equal(plan->n_slots, 3);
}

static void follows_consumers_layout(void **state)
{
    (void)state;
    const rl_node only4[] = {NODE("src", &any, "capture.albedo"), NODE("p", &phase, "src.to"),
                             NODE("q", &phase, "src.to"), MIX("end", "p.to", "q.to")};
    const rl_plan *plan = PLAN(only4, "end.to");
    assert_int_equal(count(plan, RL_STEP_CONVERT), 0);
    assert_true(find(plan, "src.to", RL_PHASE4, RL_BUFFER_TRANSIENT) >= 0);
    assert_int_equal(find_all(plan, "src.to"), 1);

    /* both layouts: linear is stored, one conversion serves both consumers, right before the first */
    const rl_node both[] = {NODE("src", &any, "capture.albedo"), NODE("v", &fake_view, "src.to"),
                            MIX("w", "v.to", "src.to"),          NODE("p", &phase, "src.to"),
                            NODE("q", &phase, "src.to"),         MIX("pq", "p.to", "q.to"),
                            MIX("end", "w.to", "pq.to")};
    plan = PLAN(both, "end.to");
    assert_int_equal(count(plan, RL_STEP_CONVERT), 1);
    assert_int_equal(plan->steps[3].kind, RL_STEP_CONVERT); /* behind src, v, w; before p */
    assert_int_equal(plan->steps[3].buffers[0], find(plan, "src.to", RL_LINEAR, RL_BUFFER_TRANSIENT));
    assert_int_equal(plan->steps[3].buffers[1], find(plan, "src.to", RL_PHASE4, RL_BUFFER_TRANSIENT));

    /* the writer reads linear */
    const rl_node out[] = {NODE("src", &any, "capture.albedo"), NODE("p", &phase, "src.to")};
    plan = PLAN(out, "p.to", "src.to");
    assert_int_equal(count(plan, RL_STEP_CONVERT), 1);
    assert_true(find(plan, "src.to", RL_LINEAR, RL_BUFFER_SINK) >= 0);

    /* a layer arrives linear */
    const rl_node layer[] = {NODE("p", &phase, "capture.albedo")};
    plan = PLAN(layer, "p.to");
    assert_int_equal(plan->steps[0].kind, RL_STEP_CONVERT);
    assert_true(find(plan, "capture.albedo", RL_PHASE4, RL_BUFFER_TRANSIENT) >= 0);
}

static void keeps_history(void **state)
{
    (void)state;
    const rl_plan *plan = PLAN(fake_nodes, "aa.color");
    const int color = find(plan, "aa.color", RL_LINEAR, RL_BUFFER_HISTORY);
    const int sink = find(plan, "aa.color", RL_LINEAR, RL_BUFFER_SINK);
    const int depth = find(plan, "capture.depth", RL_LINEAR, RL_BUFFER_HISTORY);
    assert_true(color >= 0 && sink >= 0 && depth >= 0);
    assert_int_equal(plan->nodes[2].buffers[2], color);
    assert_int_equal(plan->nodes[2].buffers[3], depth);
    assert_int_equal(plan->nodes[2].buffers[4], color);
    assert_int_equal(plan->outputs[0][0], sink);
    assert_int_equal(count(plan, RL_STEP_COPY), 2); /* depth to its pair, color to the writer */

    /* two nodes that look back at one layer share the pair; a node's image lives in its pair, without a copy
     */
    const rl_node shared[] = {NODE("a", &past, "capture.albedo"), NODE("b", &past, "capture.albedo"),
                              NODE("c", &past, "a.to"), MIX("end", "b.to", "c.to")};
    plan = PLAN(shared, "end.to");
    assert_int_equal(count(plan, RL_STEP_COPY), 1);
    assert_true(find(plan, "capture.albedo", RL_LINEAR, RL_BUFFER_HISTORY) >= 0);
    assert_int_equal(find_all(plan, "capture.albedo"), 2);
    assert_true(find(plan, "a.to", RL_LINEAR, RL_BUFFER_HISTORY) >= 0);
    assert_int_equal(find_all(plan, "a.to"), 1);

    /* a past in another layout is converted straight into the pair */
    const rl_node other[] = {NODE("a", &past4, "capture.albedo"), NODE("b", &past4, "a.to")};
    plan = PLAN(other, "b.to");
    assert_int_equal(count(plan, RL_STEP_COPY), 0);
    assert_int_equal(count(plan, RL_STEP_CONVERT), 2);
    assert_true(find(plan, "capture.albedo", RL_PHASE4, RL_BUFFER_HISTORY) >= 0);
    assert_true(find(plan, "a.to", RL_PHASE4, RL_BUFFER_HISTORY) >= 0);
    assert_true(find(plan, "a.to", RL_LINEAR, RL_BUFFER_TRANSIENT) >= 0);
}

static void shares_slots(void **state)
{
    (void)state;
    const rl_node chain[] = {
        NODE("a", &fake_view, "capture.albedo"), NODE("b", &fake_view, "a.to"), NODE("c", &fake_view, "b.to"),
        NODE("d", &fake_view, "c.to"),           NODE("e", &fake_view, "d.to"),
    };
    const rl_plan *plan = PLAN(chain, "e.to");
    assert_int_equal(plan->n_slots, 2);
    rl_geometry g;
    assert_int_equal(rl_geometry_make(0, 0, 100, 10, &g, NULL), RL_OK);
    const size_t image = ((size_t)3 * 128 * 12 + 2 * RL_GUARD) * 4;
    assert_int_equal(rl_buffer_bytes(&plan->buffers[0], &g), image);
    assert_int_equal(rl_slot_bytes(plan, 0, &g), image);
    assert_int_equal(rl_plan_bytes(plan, &g, 3), 2 * image + 3 * image + 3 * image); /* slots, source, sink */
    assert_int_equal(rl_plan_bytes_unshared(plan, &g, 3), 4 * image + 3 * image + 3 * image);

    /* a slot that grows: one plane first, three later */
    const rl_node grows[] = {NODE("n", &narrow, "capture.albedo"), NODE("w", &wide, "n.to"),
                             NODE("x", &fake_view, "w.to"), NODE("y", &fake_view, "x.to")};
    plan = PLAN(grows, "y.to");
    assert_int_equal(plan->n_slots, 2);
    assert_int_equal(plan->slot_planes[0], 3);
    assert_int_equal(rl_slot_bytes(plan, 0, &g), image);

    /* the other layout has margins, and an odd number of cache lines a sub-row */
    const rl_buffer phases = {.planes = 2, .layout = RL_PHASE4};
    assert_int_equal(rl_buffer_bytes(&phases, &g),
                     ((size_t)2 * 16 * 3 * (32 + 2 * RL_MARGIN4 + 16) + 2 * RL_GUARD) * 4);

    /* history takes two, whatever is in flight */
    plan = PLAN(fake_nodes, "aa.color");
    const rl_buffer *pair = &plan->buffers[find(plan, "aa.color", RL_LINEAR, RL_BUFFER_HISTORY)];
    assert_int_equal(rl_buffer_copies(pair, 5), 2);
    const size_t scalar = ((size_t)128 * 12 + 2 * RL_GUARD) * 4,
                 lights = ((size_t)2 * 128 * 12 + 2 * RL_GUARD) * 4;
    assert_int_equal(rl_plan_bytes(plan, &g, 2) - rl_plan_bytes(plan, &g, 1), /* one more frame in flight */
                     image + scalar + lights /* albedo, depth, shadow */ + image /* sink */);
}

static void check_geometry(const rl_geometry *g)
{
    assert_int_equal(g->origin_x % 64, 0);
    assert_int_equal(g->origin_y % 4, 0);
    assert_int_equal(g->columns % 64, 0);
    assert_int_equal(g->rows % 4, 0);
    assert_true(g->origin_x <= g->x && g->x - g->origin_x < 64);
    assert_true(g->origin_y <= g->y && g->y - g->origin_y < 4);
    assert_true(g->origin_x + g->columns >= g->x + g->width &&
                g->origin_x + g->columns < g->x + g->width + 64);
    assert_true(g->origin_y + g->rows >= g->y + g->height && g->origin_y + g->rows < g->y + g->height + 4);
    assert_true(g->stride >= g->columns && g->stride % 32 == 0 && g->stride % 512 != 0);
    assert_int_equal(g->plane, g->stride * g->rows);
    assert_true(g->stride4 >= g->columns / 4 + 2 * RL_MARGIN4 && g->stride4 % 32 == 16);
    assert_int_equal(g->plane4, 16 * (g->rows / 4) * g->stride4);
    /* the last sample of the last sub-image, with its margin, is the last of the plane */
    assert_true((15 * (g->rows / 4) + g->rows / 4 - 1) * g->stride4 + 2 * RL_MARGIN4 + g->columns / 4 <=
                g->plane4);
}

static void measures_windows(void **state)
{
    (void)state;
    rl_geometry g;
    for (int x = -130; x <= 130; x += 1)
        for (int width = 1; width <= 200; width += 33) {
            assert_int_equal(rl_geometry_make(x, -x / 3, width, width / 2 + 1, &g, NULL), RL_OK);
            check_geometry(&g);
        }
    assert_int_equal(rl_geometry_make(-1, -1, 1, 1, &g, NULL), RL_OK);
    assert_int_equal(g.origin_x, -64);
    assert_int_equal(g.origin_y, -4);
    assert_int_equal(g.columns, 64);
    assert_int_equal(g.rows, 4);
    assert_int_equal(rl_geometry_make(0, 0, 1920, 1080, &g, NULL), RL_OK);
    assert_int_equal(g.stride, 1920);
    assert_int_equal(rl_geometry_make(0, 0, 2048, 16, &g, NULL), RL_OK);
    assert_int_equal(g.stride, 2080);

    rl_error err = {0};
    assert_int_equal(rl_geometry_make(0, 0, 0, 5, &g, &err), RL_E_FORMAT);
    static const int huge[][4] = {{0, 0, INT_MAX, INT_MAX},
                                  {INT_MIN, INT_MIN, INT_MAX, INT_MAX},
                                  {0, 0, 40000, 40000},
                                  {INT_MAX, INT_MAX, 1, 1},
                                  {0, 0, INT_MAX, 1}};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(huge); i++)
        assert_int_equal(rl_geometry_make(huge[i][0], huge[i][1], huge[i][2], huge[i][3], &g, NULL),
                         RL_E_MEMORY);
}

/* 26,000 x 26,000 pixels: an rgb image can be indexed, a shadow layer of many lights cannot. */
static void refuses_what_int_cannot_index(void **state)
{
    (void)state;
    rl_geometry g;
    assert_int_equal(rl_geometry_make(0, 0, 26000, 26000, &g, NULL), RL_OK);
    const rl_node view[] = {NODE("a", &fake_view, "capture.albedo")};
    assert_int_equal(rl_plan_fits(PLAN(view, "a.to"), &g, NULL), RL_OK);
    const rl_layer_info layers[] = {
        {"albedo", RL_RGB, 3}, {"depth", RL_SCALAR, 1}, {"shadow", RL_LIGHTS, 40}};
    const rl_output_layer lit[] = {{"", "light.lit", {0}}};
    const rl_wanted wanted = {.name = "lit", .layers = lit, .n_layers = 1};
    const rl_graph *graph = NULL;
    const rl_plan *plan = NULL;
    rl_error err = {0};
    assert_int_equal(rl_graph_build(&arena, &fake_nodes[2], 1, layers, 3, &wanted, 1, &graph, NULL), RL_OK);
    assert_int_equal(rl_plan_make(&arena, graph, &plan, NULL), RL_OK);
    assert_int_equal(rl_plan_fits(plan, &g, &err), RL_E_MEMORY);
    assert_non_null(strstr(err.text, "'capture.shadow' has 40 planes"));
}

static void survives_failing_memory(void **state)
{
    (void)state;
    for (unsigned long n = 1;; n++) {
        rl_arena separate = {0};
        const rl_output_layer color[] = {{"", "aa.color", {0}}};
        const rl_wanted wanted = {.name = "color", .layers = color, .n_layers = 1};
        const rl_graph *graph = fake_graph(&arena, fake_nodes, 4, &wanted, 1);
        const rl_plan *plan = NULL;
        rl_alloc_fail_at(n, 1);
        rl_code code = rl_plan_make(&separate, graph, &plan, NULL);
        rl_alloc_fail_at(0, 0);
        rl_arena_free(&separate);
        if (code == RL_OK) {
            assert_true(n > 1);
            break;
        }
        assert_int_equal(code, RL_E_MEMORY);
        assert_null(plan);
    }
}

#define TEST(f) cmocka_unit_test_teardown(f, teardown)
/* Sums, and what is there for them alone, exist when an output asks. */
static void makes_sums_on_request(void **state)
{
    static const rl_port ports[] = {{PORT("from", RL_READ, RL_RGB)},
                                    {PORT("own", RL_SCRATCH, RL_RGB)},
                                    {PORT("lost", RL_SCRATCH, RL_RGB), .with = "sums"},
                                    {PORT("sums", RL_REDUCTION, RL_SUMS)},
                                    {PORT("to", RL_WRITE, RL_RGB)}};
    static const rl_step steps[] = {{"run", .domain = RL_EVERY_VECTOR},
                                    {"add_up", .domain = RL_EVERY_BAND, .with = "sums"}};
    static const rl_pass adder = {.name = "adder", .ports = RL_ARRAY(ports), .steps = RL_ARRAY(steps)};
    const rl_node nodes[] = {NODE("a", &adder, "capture.albedo"), NODE("b", &adder, "a.to")};
    const char *const images[] = {"b.to", "a.sums"};
    rl_geometry g;
    rl_error err = {0};
    (void)state;
    assert_int_equal(rl_geometry_make(0, 0, 100, 50, &g, &err), RL_OK);
    const rl_plan *plan = plan_for(nodes, 2, images, 1);
    assert_int_equal(plan->n_steps, 2);
    for (size_t n = 0; n < 2; n++)
        assert_true(plan->nodes[n].buffers[1] >= 0 && plan->nodes[n].buffers[2] < 0 &&
                    plan->nodes[n].buffers[3] < 0);
    plan = plan_for(nodes, 2, images, 2);
    assert_int_equal(plan->n_steps, 3); /* of a alone */
    assert_string_equal(plan->graph->nodes[plan->steps[1].node].name, "a");
    assert_true(plan->nodes[0].buffers[2] >= 0 && plan->nodes[1].buffers[2] < 0 &&
                plan->nodes[1].buffers[3] < 0);
    const rl_buffer *sums = &plan->buffers[plan->nodes[0].buffers[3]];
    assert_int_equal(plan->outputs[1][0], plan->nodes[0].buffers[3]);
    assert_true(sums->kind == RL_BUFFER_SINK && sums->planes == 0);
    assert_int_equal(rl_buffer_bytes(sums, &g), (RL_SUM_FLOATS + 2 * RL_GUARD) * sizeof(float));
    plan = plan_for(nodes, 2, images + 1, 1); /* the node runs for its sums alone */
    assert_int_equal(plan->n_steps, 2);
    assert_int_equal(plan->n_culled, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(orders_and_culls),
        TEST(finishes_a_branch_first),
        TEST(follows_consumers_layout),
        TEST(keeps_history),
        TEST(shares_slots),
        TEST(measures_windows),
        TEST(refuses_what_int_cannot_index),
        TEST(makes_sums_on_request),
        TEST(survives_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
