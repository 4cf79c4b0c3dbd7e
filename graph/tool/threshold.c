#include "graph/tool/threshold.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/text.h"

rl_code rl_threshold_metric(const char *place, const char *option, const char *name, int *out, rl_error *err)
{
    const char *known[RL_METRICS];
    *out = rl_metric_named(name);
    if (*out >= 0)
        return RL_OK;
    for (int i = 0; i < RL_METRICS; i++)
        known[i] = rl_metric_name((rl_metric)i);
    rl_str text = {0};
    rl_suggest(&text, name, known, RL_METRICS, "known");
    rl_fail_file(err, RL_E_USAGE, place, "option '--%s': there is no metric '%s'%s", option, name,
                 rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

static rl_code find_stat(const char *place, const char *name, rl_stat *out, rl_error *err)
{
    const char *known[RL_STATS];
    int stat = rl_stat_named(name);
    if (stat >= 0) {
        *out = (rl_stat)stat;
        return RL_OK;
    }
    for (int i = 0; i < RL_STATS; i++)
        known[i] = rl_stat_name((rl_stat)i);
    rl_str text = {0};
    rl_suggest(&text, name, known, RL_STATS, "known");
    rl_fail_file(err, RL_E_USAGE, place, "option '--fail-over': there is no statistic '%s'%s", name,
                 rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

/* "flip.p95". */
static rl_code parse_name(const char *place, char *name, bool energy, rl_threshold *out, rl_error *err)
{
    char *dot = strchr(name, '.');
    if (energy && !strcmp(name, "energy")) {
        out->metric = RL_THRESHOLD_ENERGY;
        return RL_OK;
    }
    if (dot)
        *dot = 0;
    if (rl_threshold_metric(place, "fail-over", name, &out->metric, err) ||
        (dot && find_stat(place, dot + 1, &out->stat, err)))
        return err->code;
    if (out->metric == RL_METRIC_PSNR && out->stat != RL_STAT_MEAN)
        return rl_fail_file(err, RL_E_USAGE, place, "option '--fail-over': psnr has a mean, no %s",
                            rl_stat_name(out->stat));
    return RL_OK;
}

rl_code rl_threshold_parse(rl_arena *arena, const char *place, const char *text, bool energy,
                           rl_threshold *out, rl_error *err)
{
    const char *equals = strchr(text, '='), *number = equals ? equals + 1 : text;
    *out = (rl_threshold){RL_THRESHOLD_SHOWN, RL_STAT_MEAN, 0};
    if (equals) {
        char *name = rl_arena_strndup(arena, text, (size_t)(equals - text));
        if (!name)
            return rl_fail_memory(err, strlen(text));
        if (parse_name(place, name, energy, out, err))
            return err->code;
    }
    if (!rl_parse_double(number, &out->limit) || !isfinite(out->limit))
        return rl_fail_file(
            err, RL_E_USAGE, place,
            "option '--fail-over' takes [METRIC.STAT=]X, such as 0.02 or flip.p95=0.05, found "
            "'%s'",
            text);
    return RL_OK;
}

bool rl_threshold_is_over(rl_metric metric, double limit, double value)
{
    return rl_metric_rises(metric) ? !(value >= limit) : !(value <= limit);
}

const char *rl_threshold_name(const rl_threshold *threshold, char *out)
{
    if (threshold->metric == RL_THRESHOLD_ENERGY)
        return "energy";
    snprintf(out, 32, "%s.%s", rl_metric_name((rl_metric)threshold->metric), rl_stat_name(threshold->stat));
    return out;
}
