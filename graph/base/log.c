#include "graph/base/log.h"

#include <stdio.h>

void rl_report(const rl_log *log, rl_severity severity, rl_where where, const char *fmt, ...)
{
    if (!log || !log->sink)
        return;
    char text[1536];
    va_list args;
    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    rl_one_line(text);
    log->sink(log->ctx, severity, where, text);
}
