/* `relit passes --markdown`: the tables of the passes as the pages in passes/ show them. */
#ifndef RL_TOOL_MARKDOWN_H
#define RL_TOOL_MARKDOWN_H

#include "graph/base/text.h"
#include "graph/model/pass.h"

/* A table with a row a registered pass: name, what it does, inputs, outputs, source. Appended to out. */
void rl_markdown_list(rl_str *out);

/* A pass's ports, parameters and keys, a table each, those without rows left out. Appended to out. */
void rl_markdown_pass(const rl_pass *pass, rl_str *out);

#endif
