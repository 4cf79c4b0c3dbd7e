/* The passes that this build knows. Functions that work on the registry have a variant that takes one, so
 * that tests can bring passes of their own. */
#ifndef RL_MODEL_REGISTRY_H
#define RL_MODEL_REGISTRY_H

#include "graph/model/pass.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_registry {
    const rl_pass *const *passes;
    size_t n;
} rl_registry;

/* Every pass of the build, in the order of registry.c. Constant; any thread. */
const rl_registry *rl_registry_all(void);

/* NULL when there is none. */
const rl_pass *rl_registry_find(const rl_registry *registry, const char *name);

#ifdef __cplusplus
}
#endif
#endif
