#include "graph/tool/ab_report.h"

const char *rl_ab_material_name(const rl_ab_report *report, size_t capture, int material)
{
    size_t n;
    const char *const *names = rl_experiment_materials(report->experiment, capture, &n);
    return material >= 0 && (size_t)material < n ? names[material] : NULL;
}

const char *rl_ab_capture_name(const rl_ab_report *report, size_t capture)
{
    return rl_session_capture_name(rl_experiment_session(report->experiment, 0), capture);
}

const char *rl_ab_reference_name(const rl_ab_report *report, size_t pair)
{
    int v = report->plan->pairs[pair].reference;
    return v == RL_AB_AGAINST ? report->plan->against : report->plan->variants[v].name;
}

const char *rl_ab_test_name(const rl_ab_report *report, size_t pair)
{
    return report->plan->variants[report->plan->pairs[pair].test].name;
}
