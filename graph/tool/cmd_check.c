/* `relit check`: all that can be known without a pixel. Besides what opening a session checks, it opens every
 * frame's files, so that a hole in a sequence is found before the night's run. */
#include <time.h>

#include "graph/run/session.h"
#include "graph/tool/json_print.h"
#include "graph/tool/outdir.h"
#include "graph/tool/tool.h"
#include "graph/tool/trace.h"

typedef struct checker {
    rl_tool *tool;
    rl_session *session;
    json_t *errors;  /* of frames, for --json */
    rl_trace *trace; /* NULL without --trace */
    uint64_t begin;  /* ns, of the stage that runs */
} checker;

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* What has run since the stage before it, for --trace. */
static void stage_ended(checker *c, rl_lane lane, const char *name, const char *capture, long long frame)
{
    rl_run_span span = {.lane = lane, .category = "check", .name = name, .capture = capture, .frame = frame};
    span.start = c->begin;
    span.end = c->begin = now_ns();
    if (c->trace)
        rl_trace_add(c->trace, &span);
}

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

/* One object, of what is wrong too: {"pipeline", "ok", "captures", "errors"}. */
static void print_json(const checker *c, const rl_error *err, rl_str *out)
{
    json_t *captures = json_array();
    for (size_t i = 0; c->session && i < rl_session_captures(c->session); i++) {
        json_t *frames = json_array();
        for (size_t k = 0; k < rl_session_frames(c->session, i); k++)
            json_array_append_new(frames, json_integer(rl_session_frame(c->session, i, k)));
        json_array_append_new(captures, json_pack("{s:s, s:o}", "name",
                                                  rl_session_capture_name(c->session, i), "frames", frames));
    }
    if (err->code)
        json_array_append_new(c->errors, rl_report_error_json(err));
    rl_json_print(json_pack("{s:s, s:b, s:o, s:O}", "pipeline", c->tool->args.run.pipeline, "ok",
                            json_array_size(c->errors) == 0, "captures", captures, "errors", c->errors),
                  JSON_COMPACT, out);
}

static void report_bad(const checker *c, const rl_error *err)
{
    rl_report_error(c->tool->report, err);
    json_array_append_new(c->errors, rl_report_error_json(err));
}

/* Headers of every frame: files, parts, channels, sizes, cameras. Each bad frame is reported; returns how
 * many. */
static size_t check_headers(checker *c)
{
    const rl_tool *tool = c->tool;
    size_t bad = 0;
    for (size_t i = 0; i < c->session->n_sequences; i++) {
        rl_sequence *q = &c->session->sequences[i];
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
                    report_bad(c, &err);
                bad += !skip;
            } else {
                any_good = true;
            }
            rl_frame_release(&frame);
            stage_ended(c, RL_LANE_READ, "header", q->manifest->name, frame.number);
        }
        rl_frame_free(&frame);
    }
    return bad;
}

static int check(checker *c, rl_error *err)
{
    const rl_options *options = &c->tool->args.run;
    c->begin = now_ns();
    if (rl_session_open(options, &c->session, err))
        return RL_EXIT_WRONG;
    stage_ended(c, RL_LANE_RUN, "open", "", 0);
    if (rl_session_prepare(c->session, err))
        return RL_EXIT_WRONG;
    stage_ended(c, RL_LANE_RUN, "compile", "", 0);
    if (rl_outdir_check(c->tool->arena, options->out, err) || check_headers(c))
        return RL_EXIT_WRONG;
    return RL_EXIT_DONE;
}

int rl_cmd_check(rl_tool *tool, rl_error *err)
{
    checker c = {.tool = tool, .errors = json_array()};
    rl_str text = {0};
    rl_error unsaid = {0}; /* of saying what is wrong */
    int status = RL_EXIT_WRONG;

    if (!c.errors) {
        rl_fail_memory(err, 1);
        goto done;
    }
    if (tool->args.trace && rl_trace_new(&c.trace, err))
        goto done;
    status = check(&c, err);
    if (c.trace && rl_trace_write(c.trace, tool->args.trace, status ? &unsaid : err))
        status = RL_EXIT_WRONG;
    if (tool->args.json)
        print_json(&c, err, &text);
    else if (!status && !tool->args.quiet)
        print_text(tool, c.session, &text);
    if (rl_tool_print(tool, &text, status ? &unsaid : err))
        status = RL_EXIT_WRONG;
done:
    rl_str_free(&text);
    json_decref(c.errors);
    rl_trace_free(&c.trace);
    rl_session_close(&c.session);
    return status;
}
