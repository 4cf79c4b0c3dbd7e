/* `relit run`: written on graph/relit.h, as any other user of the library would be. */
#include "graph/tool/outdir.h"
#include "graph/tool/signals.h"
#include "graph/tool/tool.h"

static void on_frame(void *ctx, const rl_frame_result *result)
{
    rl_report_frame(ctx, result);
}

static int on_stop(void *ctx)
{
    (void)ctx;
    return rl_signals_caught();
}

int rl_cmd_run(rl_tool *tool, rl_error *err)
{
    rl_session *session = NULL;
    rl_run_summary summary = {0};
    rl_run_hooks hooks = {on_frame, on_stop, tool->report};
    int status = RL_EXIT_WRONG;

    if (rl_session_open(&tool->args.run, &session, err) || rl_session_prepare(session, err) ||
        rl_outdir_make(tool->args.run.out, err))
        goto done;
    rl_signals_begin(fileno(tool->report->err));
    rl_report_run_begin(tool->report);
    rl_code code = rl_session_run(session, &hooks, &summary, err);
    int signal = rl_signals_caught();
    rl_signals_end();
    rl_report_run_end(tool->report, &summary, code == RL_E_CANCELLED);
    if (code == RL_E_CANCELLED) {
        *err = (rl_error){0}; /* what was asked for is no error */
        status = 128 + signal;
    } else if (code) {
        status = summary.frames || summary.lacking ? RL_EXIT_FRAME : RL_EXIT_WRONG;
    } else {
        status = summary.failed ? RL_EXIT_FRAME : RL_EXIT_DONE;
    }
done:
    rl_session_close(&session);
    return status;
}
