/* Executes a plan without pixels: each buffer holds a token that says which image of which frame is in it,
 * and every read checks that it finds the right one. Knows nothing of how plans are made. */
#ifndef RL_TESTS_PLAN_SIMULATOR_H
#define RL_TESTS_PLAN_SIMULATOR_H

#include "graph/model/plan.h"

/* The first broken promise in `frames` frames, as text in a static buffer, or NULL. */
const char *simulate_plan(const rl_plan *plan, int frames);

#endif
