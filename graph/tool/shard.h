/* What `relit plan --shard I/N` says. */
#ifndef RL_TOOL_SHARD_H
#define RL_TOOL_SHARD_H

#include "graph/base/text.h"
#include "graph/relit.h"

/* Lines about one capture. */
void rl_shard_print(const rl_session *session, size_t capture, const rl_options *options, rl_str *out);
/* The same as a member `"shard": {…}` put into `text`, a JSON object. */
rl_code rl_shard_json(const rl_session *session, size_t capture, const rl_options *options, const char *text,
                      rl_str *out, rl_error *err);

#endif
