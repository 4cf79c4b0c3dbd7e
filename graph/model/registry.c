#include "graph/model/registry.h"

#include <string.h>

/* One line a pass, in the order in which `relit passes` lists them. X(NAME) stands for rl_pass_NAME of
 * passes/NAME.c. */
#define RL_PASSES(X)                                                                                         \
    X(lighting)                                                                                              \
    X(back_lighting)                                                                                         \
    X(translucency)                                                                                          \
    X(sss_burley)                                                                                            \
    X(sss_gaussian)                                                                                          \
    X(sss_reference)                                                                                         \
    X(combine)                                                                                               \
    X(geometric_normal)                                                                                      \
    X(curvature)                                                                                             \
    X(taa)

#define RL_DECLARE(name) extern const rl_pass rl_pass_##name;
RL_PASSES(RL_DECLARE)
#undef RL_DECLARE

#define RL_ADDRESS(name) &rl_pass_##name,
static const rl_pass *const passes[] = {RL_PASSES(RL_ADDRESS) NULL};
#undef RL_ADDRESS

const rl_registry *rl_registry_all(void)
{
    static const rl_registry all = {passes, RL_ARRAY_LENGTH(passes) - 1};
    return &all;
}

const rl_pass *rl_registry_find(const rl_registry *registry, const char *name)
{
    for (size_t i = 0; i < registry->n; i++)
        if (!strcmp(registry->passes[i]->name, name))
            return registry->passes[i];
    return NULL;
}

size_t rl_pass_count(void)
{
    return rl_registry_all()->n;
}

const rl_pass *rl_pass_at(size_t i)
{
    return rl_registry_all()->passes[i];
}

const rl_pass *rl_pass_find(const char *name)
{
    return rl_registry_find(rl_registry_all(), name);
}
