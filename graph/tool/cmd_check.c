/* `relit check`: all that can be known without a pixel. Besides what opening a session checks, it opens every
 * frame's files, so that a hole in a sequence is found before the night's run. */

#include "graph/run/session.h"
#include "graph/tool/json_print.h"
#include "graph/tool/outdir.h"
#include "graph/tool/tool.h"

static void print_frames(const rl_session *s, size_t capture, rl_str *out)
{
    size_t n = rl_session_frames(s, capture);
    rl_str_printf(out, "  capture '%s': %zu %s", rl_session_capture_name(s, capture), n,
                  n == 1 ? "frame" : "frames");
    if (n == 1)
        rl_str_printf(out, " (%lld)", rl_session_frame(s, capture, 0));
    else if (n > 1)
        rl_str_printf(out, " (%lld to %lld)", rl_session_frame(s, capture, 0),
                      rl_session_frame(s, capture, n - 1));
    rl_str_add(out, "\n");
}

static void print_text(const rl_tool *tool, const rl_session *s, rl_str *out)
{
    rl_str_printf(out, "%s: OK\n", tool->args.run.pipeline);
    for (size_t i = 0; i < rl_session_captures(s); i++)
        print_frames(s, i, out);
    rl_str_add(out, "  the plan is made, the kernels compile\n");
}

static void print_json(const rl_tool *tool, const rl_session *s, rl_str *out)
{
    json_t *captures = json_array();
    for (size_t i = 0; i < rl_session_captures(s); i++) {
        json_t *frames = json_array();
        for (size_t k = 0; k < rl_session_frames(s, i); k++)
            json_array_append_new(frames, json_integer(rl_session_frame(s, i, k)));
        json_array_append_new(
            captures, json_pack("{s:s, s:o}", "name", rl_session_capture_name(s, i), "frames", frames));
    }
    rl_json_print(
        json_pack("{s:s, s:b, s:o}", "pipeline", tool->args.run.pipeline, "ok", 1, "captures", captures),
        JSON_COMPACT, out);
}

/* Headers of every frame: files, parts, channels, sizes, cameras. Each bad frame is reported; returns how
 * many. */
static size_t check_headers(const rl_tool *tool, rl_session *session)
{
    size_t bad = 0;
    for (size_t i = 0; i < session->n_sequences; i++) {
        rl_sequence *q = &session->sequences[i];
        rl_frame frame = {0};
        bool any_good = false;
        for (size_t k = 0; k < q->frames.n; k++) {
            rl_error err = {0};
            frame.number = q->frames.numbers[k];
            if (rl_reader_open(q->reader, frame.number, &frame, &err)) {
                rl_on_missing how = tool->args.run.on_missing;
                bool skip = rl_reader_missed(err.code) &&
                            (how == RL_MISSING_SKIP || (how == RL_MISSING_HOLD && any_good));
                if (skip)
                    rl_report(&tool->report->log, RL_WARNING, (rl_where){.file = err.file},
                              "frame %d would be %s: %s", frame.number,
                              how == RL_MISSING_SKIP ? "skipped" : "held", err.text);
                else
                    rl_report_error(tool->report, &err);
                bad += !skip;
            } else {
                any_good = true;
            }
            rl_frame_release(&frame);
        }
        rl_frame_free(&frame);
    }
    return bad;
}

int rl_cmd_check(rl_tool *tool, rl_error *err)
{
    rl_session *session = NULL;
    rl_str text = {0};
    int status = RL_EXIT_WRONG;

    if (rl_session_open(&tool->args.run, &session, err) || rl_session_prepare(session, err) ||
        rl_outdir_check(tool->arena, tool->args.run.out, err) || check_headers(tool, session))
        goto done;
    if (tool->args.json)
        print_json(tool, session, &text);
    else
        print_text(tool, session, &text);
    status = rl_tool_print(tool, &text, err);
done:
    rl_session_close(&session);
    return status;
}
