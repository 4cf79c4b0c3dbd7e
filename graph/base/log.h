/* What happens on the way and is not an error: warnings, notes, progress. Stages report to an rl_log that
 * they are handed; only the tool layer decides what is printed. */
#ifndef RL_BASE_LOG_H
#define RL_BASE_LOG_H

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rl_severity { RL_NOTE, RL_WARNING, RL_VERBOSE } rl_severity;

typedef struct rl_log {
    /* `text` is one line without newline or severity. May be called from any thread; the sink serializes. */
    void (*sink)(void *ctx, rl_severity severity, rl_where where, const char *text);
    void *ctx;
} rl_log;

/* `log` may be NULL: nothing happens. */
void rl_report(const rl_log *log, rl_severity severity, rl_where where, const char *fmt, ...) RL_PRINTF(4, 5);

#ifdef __cplusplus
}
#endif
#endif
