/* The differences that chance alone makes; see rl_ab_null in ab.h. */
#include <math.h>

#include "graph/tool/ab_measure_parts.h"

void rl_ab_null_add(rl_ab_null *null, const rl_ab_sums *sums)
{
    bool rises = rl_metric_rises(null->metric);
    if (!sums->pixels)
        return;
    for (int i = 0; i < RL_STATS; i++) {
        double v = sums->stats[i], *bound = &null->bounds[i];
        if (!null->n || (rises ? v < *bound : v > *bound))
            *bound = v;
    }
    null->n++;
}

const rl_ab_null *rl_ab_null_of(const rl_ab_results *results, size_t capture, int material, rl_metric metric)
{
    for (size_t i = 0; i < results->n_nulls; i++) {
        const rl_ab_null *null = &results->nulls[i];
        if (null->capture == capture && null->material == material && null->metric == metric)
            return null;
    }
    return NULL;
}

int rl_ab_beyond_chance(const rl_ab_results *results, const rl_ab_value *value)
{
    const rl_ab_null *null = rl_ab_null_of(results, value->capture, value->material, value->metric);
    double v = value->stats[RL_STAT_MEAN], bound;
    if (!null || isnan(v))
        return -1;
    bound = null->bounds[RL_STAT_MEAN];
    return rl_metric_rises(value->metric) ? v < bound : v > bound;
}
