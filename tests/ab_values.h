/* Hand-made results of `relit ab` for tests of what is written about them. Include cmocka.h first. */
#ifndef RL_TESTS_AB_VALUES_H
#define RL_TESTS_AB_VALUES_H

#include "graph/tool/ab_fail.h"
#include "tests/fake_experiment.h"

enum { AB_MOST_VALUES = 512 };

typedef struct ab_values {
    fake_plan p;
    rl_ab_value values[AB_MOST_VALUES];
    rl_ab_null nulls[64];
    rl_ab_size sizes[2];
    rl_ab_results results;
    rl_ab_report report;
} ab_values;

/* n_listed variants of n_variants, no values yet. */
void ab_values_make(ab_values *v, rl_experiment *e, size_t n_variants, size_t n_listed);
/* A value of each metric: flip's mean and p95 are given, hdrflip's are twice that, rmse and max a half; psnr
 * 40 and ssim 0.9. 0: equal images. */
void ab_values_add(ab_values *v, size_t capture, size_t pair, size_t index, int material, double mean,
                   double p95);
/* The bounds of flip's mean, and twice that for p95. */
void ab_values_null(ab_values *v, size_t capture, int material, double mean);

/* What is written about a report. */
typedef rl_code ab_writer(const rl_ab_report *report, rl_str *out, rl_error *err);
/* Fails each allocation of `write` in turn: an error of memory, and nothing is left behind. */
void ab_values_starve(const ab_values *v, ab_writer *write);

#endif
