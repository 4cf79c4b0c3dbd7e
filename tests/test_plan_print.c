/* What `relit plan` shows: text, graphviz, JSON. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include <jansson.h>

#include "fake_graph.h"
#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/plan.h"

static rl_arena arena;
static rl_str text;

static int teardown(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    rl_str_free(&text);
    return 0;
}

/* The standard graph and a pass behind it; a preview that is converted, the result itself, two AOVs. */
static const rl_plan *make(const char *preview)
{
    static const rl_pass *const convert[] = {&fake_view};
    static const rl_output_layer color[] = {{"", "aa.color", {0}}};
    static const rl_output_layer aovs[] = {{"d", "light.diffuse", {0}}, {"z", "capture.depth", {0}}};
    static const rl_output_layer toned[] = {{"", "tone.to", {0}}};
    const rl_node nodes[] = {
        fake_nodes[0],
        fake_nodes[1],
        fake_nodes[2],
        fake_nodes[3],
        {.name = "tone", .pass = &fake_view, INPUTS({"from", "aa.color", {0}})},
    };
    const rl_wanted wanted[] = {
        {preview, {0}, toned, convert, NULL, 1},
        {"beauty", {0}, color, NULL, NULL, 1},
        {"aovs", {0}, aovs, NULL, NULL, 2},
    };
    const rl_plan *plan = NULL;
    assert_int_equal(rl_plan_make(&arena, fake_graph(&arena, nodes, 5, wanted, 3), &plan, NULL), RL_OK);
    return plan;
}

static rl_geometry small(void)
{
    rl_geometry g;
    assert_int_equal(rl_geometry_make(-5, 0, 100, 10, &g, NULL), RL_OK);
    return g;
}

static const char expected[] =
    "order (' marks the phase4 layout)\n"
    "    0  light           lighting run: capture.albedo, capture.depth, capture.shadow -> light.diffuse, "
    "light.lit\n"
    "    1  (convert)       capture.depth from linear to phase4\n"
    "    2  (convert)       light.diffuse from linear to phase4\n"
    "    3  sss             sss_burley prepare: light.diffuse', light.lit, capture.depth' -> sss.color\n"
    "    4  sss             sss_burley filter: light.diffuse', light.lit, capture.depth' -> sss.color\n"
    "    5  aa              taa run: sss.color, capture.depth, past aa.color, past capture.depth -> "
    "aa.color\n"
    "    6  tone            view run: aa.color -> tone.to\n"
    "    7  output.preview  view run: tone.to -> output.preview.to\n"
    "    8  (copy)          capture.depth to its history\n"
    "    9  (copy)          aa.color to its output\n"
    "\n"
    "images (each from the step that fills it to the last that reads it)\n"
    "  capture.albedo      3 x linear  #.........  source      28.0 KiB x 2\n"
    "  capture.depth       1 x linear  ##########  source      10.0 KiB x 2\n"
    "  capture.shadow      2 x linear  #.........  source      19.0 KiB x 2\n"
    "  light.lit           3 x linear  #####.....  slot 0      28.0 KiB\n"
    "  capture.depth       1 x phase4  .####.....  slot 1      16.0 KiB\n"
    "  light.diffuse       3 x phase4  ..###.....  slot 2      46.0 KiB\n"
    "  sss.color           3 x linear  ...###....  slot 3      28.0 KiB\n"
    "  sss.temp            2 x phase4  ...##.....  slot 4      31.0 KiB  scratch\n"
    "  tone.to             3 x linear  ......##..  slot 0      28.0 KiB\n"
    "  light.diffuse       3 x linear  ##########  sink        28.0 KiB x 2\n"
    "  output.preview.to   3 x linear  .......###  sink        28.0 KiB x 2\n"
    "  aa.color            3 x linear  .........#  sink        28.0 KiB x 2\n"
    "  capture.depth       1 x linear  ##########  history     10.0 KiB x 2\n"
    "  aa.color            3 x linear  ##########  history     28.0 KiB x 2\n"
    "\n"
    "slots\n"
    "    0   3 planes    28.0 KiB  light.lit 0-4, tone.to 6-7\n"
    "    1   1 plane     16.0 KiB  capture.depth' 1-4\n"
    "    2   3 planes    46.0 KiB  light.diffuse' 2-4\n"
    "    3   3 planes    28.0 KiB  sss.color 3-5\n"
    "    4   2 planes    31.0 KiB  sss.temp' 3-4\n"
    "\n"
    "memory (100 x 10 pixels at (-5, 0) in buffers of 192 x 12, 2 frames in flight)\n"
    "  sources                 114.0 KiB\n"
    "  images between passes   149.0 KiB  (177.0 KiB if none shared a slot)\n"
    "  outputs                 168.0 KiB\n"
    "  history                  76.0 KiB\n"
    "  total                   507.0 KiB  with reuse, 535.0 KiB without (5 % saved)\n"
    "\n"
    "outputs\n"
    "  preview: output.preview.to\n"
    "  beauty: aa.color\n"
    "  aovs: light.diffuse, capture.depth\n"
    "\n"
    "culled\n"
    "  spare (view): no output needs it\n";

static void text_tells_everything(void **state)
{
    (void)state;
    const rl_geometry g = small();
    rl_plan_print_text(make("preview"), &g, 2, &text);
    assert_string_equal(rl_str_text(&text), expected);
}

/* Without a size there is no byte in it. */
static void text_needs_no_size(void **state)
{
    (void)state;
    rl_plan_print_text(make("preview"), NULL, 2, &text);
    assert_null(strstr(rl_str_text(&text), "KiB"));
    assert_null(strstr(rl_str_text(&text), "memory"));
    assert_non_null(strstr(rl_str_text(&text), "  light.lit           3 x linear  #####.....  slot 0  \n"));
}

static size_t occurrences(const char *of)
{
    size_t n = 0;
    for (const char *at = rl_str_text(&text); (at = strstr(at, of)); at += strlen(of))
        n++;
    return n;
}

static void dot_draws_passes_and_images(void **state)
{
    (void)state;
    const rl_geometry g = small();
    rl_plan_print_dot(make("pre\"view\\"), &g, 2, &text);
    assert_int_equal(occurrences("shape=ellipse"), 3); /* capture.normal is not connected */
    assert_int_equal(occurrences("shape=box"), 6);
    assert_int_equal(occurrences("shape=note"), 3);
    assert_int_equal(occurrences(" -> "), 3 + 3 + 4 + 1 + 1 + 1 + 4);
    assert_int_equal(occurrences("converted"), 2);
    assert_int_equal(occurrences("one frame before"), 2);
    assert_int_equal(occurrences("no output needs it"), 1);
    assert_int_equal(occurrences("style=dashed"), 2); /* the culled node and what it would read */
    assert_non_null(strstr(rl_str_text(&text), "n2 -> n3 [label=\"diffuse rgb, phase4\\nconverted\""));
    assert_non_null(strstr(rl_str_text(&text), "label=\"5. output.pre\\\"view\\\\\\nview\""));
    assert_non_null(strstr(rl_str_text(&text), "label=\"pre\\\"view\\\\\""));
}

static const char *string_at(const json_t *root, const char *list, size_t i, const char *key)
{
    const char *s = json_string_value(json_object_get(json_array_get(json_object_get(root, list), i), key));
    return s ? s : "(none)";
}

static void json_says_what_the_plan_says(void **state)
{
    (void)state;
    const rl_geometry g = small();
    const rl_plan *plan = make("pre\"view\\");
    rl_error err = {0};
    assert_int_equal(rl_plan_print_json(plan, &g, 3, &text, &err), RL_OK);
    json_t *root = json_loads(rl_str_text(&text), JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(root);
    assert_int_equal(json_array_size(json_object_get(root, "steps")), plan->n_steps);
    assert_int_equal(json_array_size(json_object_get(root, "nodes")), plan->n_nodes);
    assert_int_equal(json_array_size(json_object_get(root, "slots")), plan->n_slots);
    assert_int_equal(json_array_size(json_object_get(root, "outputs")), plan->graph->n_outputs);
    assert_string_equal(string_at(root, "steps", 0, "pass"), "lighting");
    assert_string_equal(string_at(root, "steps", 1, "kind"), "convert");
    assert_string_equal(string_at(root, "steps", 9, "kind"), "copy");
    assert_string_equal(string_at(root, "culled", 0, "name"), "spare");
    assert_string_equal(string_at(root, "culled", 0, "reason"), "no output needs it");
    assert_string_equal(string_at(root, "outputs", 0, "name"), "pre\"view\\");
    for (size_t i = 0; i < plan->n_buffers; i++) {
        const rl_buffer *b = &plan->buffers[i];
        const json_t *o = json_array_get(json_object_get(root, "buffers"), i);
        assert_string_equal(string_at(root, "buffers", i, "name"), b->name);
        assert_string_equal(string_at(root, "buffers", i, "layout"), rl_layout_name(b->layout));
        assert_string_equal(string_at(root, "buffers", i, "class"), rl_buffer_class_name(b->kind));
        assert_int_equal(json_integer_value(json_object_get(o, "first")), b->first);
        assert_int_equal(json_integer_value(json_object_get(o, "last")), b->last);
        assert_int_equal(json_is_null(json_object_get(o, "slot")), b->slot < 0);
        assert_int_equal(json_integer_value(json_object_get(o, "bytes")), rl_buffer_bytes(b, &g));
    }
    const json_t *memory = json_object_get(root, "memory");
    assert_int_equal(json_integer_value(json_object_get(memory, "bytes")), rl_plan_bytes(plan, &g, 3));
    assert_int_equal(json_integer_value(json_object_get(memory, "bytes_unshared")),
                     rl_plan_bytes_unshared(plan, &g, 3));
    assert_int_equal(json_integer_value(json_array_get(json_object_get(memory, "data_window"), 0)), -5);
    json_decref(root);
}

static void json_survives_failing_memory(void **state)
{
    (void)state;
    const rl_plan *plan = make("preview");
    rl_error err = {0};
    rl_alloc_fail_at(1, 1);
    rl_code code = rl_plan_print_json(plan, NULL, 1, &text, &err);
    rl_alloc_fail_at(0, 0);
    assert_int_equal(code, RL_E_MEMORY);
}

#define TEST(f) cmocka_unit_test_teardown(f, teardown)
int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(text_tells_everything),        TEST(text_needs_no_size),
        TEST(dot_draws_passes_and_images),  TEST(json_says_what_the_plan_says),
        TEST(json_survives_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
