/* What `relit plan` shows. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/plan.h"
#include "fake_graph.h"

static const rl_plan *make(rl_arena *arena)
{
    static const rl_pass *const convert[] = {&fake_view};
    static const rl_output_layer color[] =
        {
            {"", "aa.color", {0}}
    },
                                 aovs[] = {{"d", "light.diffuse", {0}}, {"z", "capture.depth", {0}}};
    const rl_wanted wanted[] = {
        {"preview", {0}, color, convert, NULL, 1},
        {"beauty",  {0}, color, NULL,    NULL, 1},
        {"aovs",    {0}, aovs,  NULL,    NULL, 2},
    };
    const rl_plan *plan = NULL;
    assert_int_equal(rl_plan_make(arena, fake_graph(arena, fake_nodes, 4, wanted, 3), &plan, NULL), RL_OK);
    return plan;
}

static void t(void **state)
{
    (void)state;
    rl_arena arena = {0};
    const rl_plan *plan = make(&arena);
    rl_geometry g;
    rl_geometry_make(0, 0, 1920, 1080, &g, NULL);
    rl_str s = {0};
    rl_plan_print_text(plan, &g, 2, &s);
    rl_plan_print_dot(plan, &g, 2, &s);
    rl_plan_print_json(plan, &g, 2, &s, NULL);
    puts(rl_str_text(&s));
}
int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(t)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
