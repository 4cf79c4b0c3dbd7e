#include "graph/tool/ab_open.h"

#include <stdio.h>
#include <string.h>

static const char set[] = "--set ";

/* A session knows settings only: --set. */
static bool is_varied(const rl_ab_plan *plan, const char *setting)
{
    for (size_t v = 0; v < plan->n_variants; v++)
        for (size_t i = 0; i < plan->variants[v].n_settings; i++) {
            const rl_setting *s = &plan->variants[v].settings[i];
            size_t n = strlen(s->path);
            if (!strncmp(setting, s->path, n) && setting[n] == '=' && !strcmp(setting + n + 1, s->value))
                return true;
        }
    return false;
}

rl_code rl_ab_open(const rl_ab_plan *plan, const rl_options *options, rl_experiment **out, rl_error *err)
{
    rl_code code = rl_experiment_open(options, plan->variants, plan->n_variants, out, err);
    if (code && !strncmp(err->file, set, sizeof set - 1) && is_varied(plan, err->file + sizeof set - 1)) {
        char place[sizeof err->file];
        snprintf(place, sizeof place, "--vary %.*s", (int)sizeof place - 8, err->file + sizeof set - 1);
        memcpy(err->file, place, sizeof place);
        err->line = err->column = 0; /* the value alone is there, not the option as it was written */
    }
    return code;
}
