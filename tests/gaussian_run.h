/* sss_gaussian on made-up scenes. Failures fail the test. */
#ifndef RL_TESTS_GAUSSIAN_RUN_H
#define RL_TESTS_GAUSSIAN_RUN_H

#include "tests/gaussian_twin.h"
#include "tests/sss_scene.h"

extern const rl_pass rl_pass_sss_gaussian;

enum { SEPARABLE = 1, FULL = 0 };

/* Shaded like sss_materials: those resolve. 1 and 2 are the sets of skin and wax. */
extern const gaussian_material gaussian_mixtures[SSS_MATERIALS];

/* Fill s->color and s->filtered; the weighting is the scene's. */
void gaussian_run_on(sss_scene *s, int separable, const gaussian_material *m, size_t bytes, cl_session *on);
void gaussian_run(sss_scene *s, int separable); /* gaussian_mixtures */
/* A scene of material 1 alone, which is `m`. */
void gaussian_run_one(sss_scene *s, int separable, const gaussian_material *m);

#endif
