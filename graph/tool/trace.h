/* --trace: what ran when, in the Trace Event Format of Chrome, which ui.perfetto.dev opens. */
#ifndef RL_TOOL_TRACE_H
#define RL_TOOL_TRACE_H

#include "graph/relit.h"

typedef struct rl_trace rl_trace;

rl_code rl_trace_new(rl_trace **out, rl_error *err);
void rl_trace_free(rl_trace **trace);
/* Any thread. What there is no memory for is left out, and counted in the file. */
void rl_trace_add(rl_trace *trace, const rl_run_span *span);
/* Whole or not there. Events are in the order of time, which counts from the earliest. */
rl_code rl_trace_write(rl_trace *trace, const char *path, rl_error *err);

#endif
