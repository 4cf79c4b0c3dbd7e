/* JSON values of the commands as text. */
#ifndef RL_TOOL_JSON_PRINT_H
#define RL_TOOL_JSON_PRINT_H

#include <jansson.h>

#include "graph/base/text.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Appends the value, with jansson's flags, and a newline; out->failed when it cannot be written, or is NULL
 * because it could not be made. Takes the caller's reference. */
void rl_json_print(json_t *taken, size_t flags, rl_str *out);

#ifdef __cplusplus
}
#endif
#endif
