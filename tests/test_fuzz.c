/* A few thousand inputs of each fuzz target (tests/fuzz): always the same ones. `make fuzz` tries more. A
 * crash or a broken promise ends this program and names the input. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/fuzz/fuzz.h"

enum { LEAST = 200 }; /* inputs */

static void test_target(void **state)
{
    const fuzz_target *target = *state;
    uint64_t fine, more = 0, n = fuzz_run(target, 20261122, 0, 3000, 1.5, &fine);
    if (n < LEAST) /* a busy machine */
        n += fuzz_run(target, 20261122, n, LEAST - n, 60, &more);
    fine += more;
    assert_true(n >= LEAST);
    assert_true(fine > 0 && fine < n); /* changes are neither all harmless nor all refused at the door */
}

int main(void)
{
    struct CMUnitTest tests[16] = {0};
    for (size_t i = 0; i < fuzz_n_targets; i++)
        tests[i] = (struct CMUnitTest){.name = fuzz_targets[i].name,
                                       .test_func = test_target,
                                       .initial_state = (void *)(uintptr_t)&fuzz_targets[i]};
    return _cmocka_run_group_tests("fuzz", tests, fuzz_n_targets, NULL, NULL);
}
