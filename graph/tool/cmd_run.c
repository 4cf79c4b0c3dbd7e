/* `relit run`: written on graph/relit.h, as any other user of the library would be. */
#include "graph/tool/outdir.h"
#include "graph/tool/signals.h"
#include "graph/tool/tool.h"
#include "graph/tool/trace.h"

/* What the hooks report to. */
typedef struct run_sinks {
    rl_reporter *report;
    rl_trace *trace; /* NULL without --trace */
} run_sinks;

static void on_frame(void *ctx, const rl_frame_result *result)
{
    rl_report_frame(((run_sinks *)ctx)->report, result);
}

static void on_stage(void *ctx, rl_lane lane, long long frame)
{
    rl_report_stage(((run_sinks *)ctx)->report, lane, frame);
}

static void on_span(void *ctx, const rl_run_span *span)
{
    rl_trace_add(((run_sinks *)ctx)->trace, span);
}

static int on_stop(void *ctx)
{
    (void)ctx;
    return rl_signals_caught();
}

/* The exit status of a run; what was asked for is no error. */
static int status_of(rl_code code, const rl_run_summary *summary, int signal, rl_error *err)
{
    if (code == RL_E_CANCELLED) {
        *err = (rl_error){0};
        return 128 + signal;
    }
    if (code)
        return summary->frames || summary->lacking || summary->stuck ? RL_EXIT_FRAME : RL_EXIT_WRONG;
    return summary->failed ? RL_EXIT_FRAME : RL_EXIT_DONE;
}

int rl_cmd_run(rl_tool *tool, rl_error *err)
{
    rl_session *session = NULL;
    rl_run_summary summary = {0};
    run_sinks sinks = {tool->report, NULL};
    rl_run_hooks hooks = {.frame = on_frame, .stage = on_stage, .stop = on_stop, .ctx = &sinks};
    int status = RL_EXIT_WRONG;

    if (tool->args.trace && rl_trace_new(&sinks.trace, err))
        goto done;
    hooks.span = sinks.trace ? on_span : NULL;
    if (rl_session_open(&tool->args.run, &session, err) || rl_session_prepare(session, err) ||
        rl_outdir_make(tool->args.run.out, err))
        goto done;
    rl_signals_begin(fileno(tool->report->err));
    rl_report_run_begin(tool->report);
    rl_code code = rl_session_run(session, &hooks, &summary, err);
    int signal = rl_signals_caught();
    rl_report_run_end(tool->report, &summary, code == RL_E_CANCELLED);
    status = status_of(code, &summary, signal, err);
    if (sinks.trace && rl_trace_write(sinks.trace, tool->args.trace, err) && status == RL_EXIT_DONE)
        status = RL_EXIT_FRAME;
    rl_signals_end();
done:
    rl_session_close(&session);
    rl_trace_free(&sinks.trace);
    return status;
}
