/* Profile rows whose value is given in other terms (rl_form in pass.h): a part of rl_materials_resolve, not
 * for others. */
#ifndef RL_MODEL_MATERIALS_FORMS_H
#define RL_MODEL_MATERIALS_FORMS_H

#include "graph/model/materials.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Puts what the forms of a profile derive into its entry, which holds the rest already. A form that the
 * profile chooses and a row of it that is missing, a row of a form that it does not choose, and a result
 * beyond the row's range are errors (RL_E_CONFIG) at their place. A profile that says nothing of a row's
 * forms leaves that row as it is. */
rl_code rl_forms_apply(const rl_materials *m, const rl_value *profile, const char *name, char *entry,
                       rl_error *err);

/* Whether the row has a value in the entry that a form derived or the profile gave; false for rows without
 * forms. */
bool rl_forms_derived(const rl_materials *m, const rl_param *row, const char *entry);

#ifdef __cplusplus
}
#endif
#endif
