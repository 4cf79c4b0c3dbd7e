#include "tests/ab_values.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "graph/base/alloc.h"

void ab_values_make(ab_values *v, rl_experiment *e, size_t n_variants, size_t n_listed)
{
    memset(v, 0, sizeof *v);
    fake_plan_make(&v->p, n_variants, n_listed);
    for (int i = 0; i < 2; i++)
        v->sizes[i] = (rl_ab_size){FAKE_WIDTH, FAKE_HEIGHT};
    v->results = (rl_ab_results){.values = v->values, .nulls = v->nulls, .sizes = v->sizes};
    v->report = (rl_ab_report){.command = "relit ab a.yaml",
                               .plan = &v->p.plan,
                               .experiment = e,
                               .results = &v->results,
                               .frames = FAKE_FRAMES,
                               .seconds = 3};
}

void ab_values_add(ab_values *v, size_t capture, size_t pair, size_t index, int material, double mean,
                   double p95)
{
    static const double factor[RL_METRICS] = {1, 2, 0, 0, 0.5, 0.5};
    for (int m = 0; m < RL_METRICS; m++) {
        assert_true(v->results.n_values < AB_MOST_VALUES);
        rl_ab_value *out = &v->values[v->results.n_values++];
        *out = (rl_ab_value){
            .pair = pair,
            .capture = capture,
            .index = index,
            .frame = v->report.experiment->frames[index],
            .material = material,
            .metric = (rl_metric)m,
            .pixels = 100,
            .stats = {factor[m] * mean, factor[m] * mean / 2, factor[m] * p95, factor[m] * p95 * 2}};
        if (m == RL_METRIC_PSNR) {
            out->stats[0] = mean > 0 ? 40 : (double)INFINITY;
            out->stats[1] = out->stats[2] = out->stats[3] = NAN;
        }
        if (m == RL_METRIC_SSIM)
            for (int s = 0; s < RL_STATS; s++)
                out->stats[s] = mean > 0 ? 0.9 : 1;
    }
}

void ab_values_null(ab_values *v, size_t capture, int material, double mean)
{
    v->nulls[v->results.n_nulls++] = (rl_ab_null){.capture = capture,
                                                  .material = material,
                                                  .metric = RL_METRIC_FLIP,
                                                  .n = 9,
                                                  .bounds = {mean, mean / 2, 2 * mean, 4 * mean}};
}

void ab_values_starve(const ab_values *v, ab_writer *write)
{
    size_t before = rl_alloc_live();
    for (unsigned long n = 1, done = 0; !done; n++) {
        rl_str text = {0};
        rl_error err = {0};
        rl_alloc_fail_at(n, 0);
        rl_code code = write(&v->report, &text, &err);
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_int_equal(code, done ? RL_OK : RL_E_MEMORY);
        rl_str_free(&text);
        assert_int_equal(rl_alloc_live(), before);
    }
}
