/* `relit ab`: variants of a pipeline in one run, compared frame by frame. */
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/image_file.h"
#include "graph/run/image_text.h"
#include "graph/run/session.h"
#include "graph/tool/ab_open.h"
#include "graph/tool/ab_run.h"
#include "graph/tool/outdir.h"
#include "graph/tool/signals.h"

static const char place[] = "relit ab";

/* ---- before the first frame ---------------------------------------------------------------------------- */

static rl_code read_thresholds(rl_ab_run *r, rl_error *err)
{
    const rl_arguments *a = &r->tool->args;
    rl_code code = RL_OK;
    r->thresholds = rl_arena_array(r->tool->arena, a->n_fail_over, sizeof *r->thresholds);
    if (!r->thresholds)
        return rl_fail_memory(err, a->n_fail_over * sizeof *r->thresholds);
    for (size_t i = 0; i < a->n_fail_over && !code; i++)
        code = rl_threshold_parse(r->tool->arena, place, a->fail_over[i], true, &r->thresholds[i], err);
    r->n_thresholds = a->n_fail_over;
    for (size_t i = 0; i < a->n_fail_over && !code; i++) /* then every frame's energy is needed */
        r->tool->args.run.energy |= r->thresholds[i].metric == RL_THRESHOLD_ENERGY;
    return code;
}

static rl_code make_plan(rl_ab_run *r, rl_error *err)
{
    const rl_arguments *a = &r->tool->args;
    rl_code code = rl_ab_plan_make(r->tool->arena, a, &r->tool->report->log, &r->plan, err);
    if (code || r->plan.n_pairs)
        return code;
    return rl_fail_file(err, RL_E_USAGE, place,
                        "one variant alone has nothing to be compared with: give --vary PATH=V1,V2, several "
                        "pipelines, or --against a reference");
}

/* What would stop the sheet after the last frame stops it before the first. */
static rl_code open_sheet(rl_ab_run *r, rl_error *err)
{
    const rl_tool *tool = r->tool;
    const rl_session *first = rl_experiment_session(r->experiment, 0);
    const rl_text_style style = {.height = 16};
    size_t n = rl_session_frames(first, 0);
    long long *numbers = rl_arena_array(tool->arena, n, sizeof *numbers);
    int width;
    if (!tool->args.sheet || !n)
        return RL_OK;
    r->sheet_path = *tool->args.sheet ? tool->args.sheet : rl_path_join(tool->arena, r->out, "sheet.png");
    if (!numbers || !r->sheet_path)
        return rl_fail_memory(err, n * sizeof *numbers);
    for (size_t i = 0; i < n; i++)
        numbers[i] = rl_session_frame(first, 0, i);
    size_t index = rl_ab_sheet_choose(tool->args.report_frames, numbers, n);
    char *title =
        rl_arena_printf(tool->arena, "%s frame %lld, %s, %s", rl_session_capture_name(first, 0),
                        numbers[index], rl_experiment_image_name(r->experiment, 0, RL_COMPARED_LINEAR),
                        rl_experiment_image_name(r->experiment, 0, RL_COMPARED_DISPLAY));
    rl_code code =
        title ? rl_image_file_check(r->sheet_path, (rl_where){.file = place}, err) : rl_fail_memory(err, 64);
    if (!code)
        code = rl_image_text_width(title, &style, &width, err);
    return code ? code : rl_ab_sheet_new(&r->plan, index, title, r->pool, &r->sheet, err);
}

/* As for --frames: a number that no capture has is a slip of the pen. */
static rl_code check_report_frames(const rl_ab_run *r, rl_error *err)
{
    const rl_session *first = rl_experiment_session(r->experiment, 0);
    const rl_frames *asked = rl_ab_page_asked(r->page);
    for (size_t i = 0; i < asked->n; i++) {
        bool found = false;
        for (size_t c = 0; c < rl_session_captures(first) && !found; c++)
            found = rl_frames_find(&first->sequences[c].frames, asked->numbers[i]) >= 0;
        if (!found)
            return rl_fail_file(err, RL_E_USAGE, "--report-frames",
                                "frame %d is not among the frames of the run", asked->numbers[i]);
    }
    return RL_OK;
}

static rl_code open_page(rl_ab_run *r, rl_error *err)
{
    rl_tool *tool = r->tool;
    const rl_ab_page_options options = {
        .folder = r->out, .frames = tool->args.report_frames, .pool = r->pool, .log = &tool->report->log};
    rl_code code = rl_ab_page_source_make(tool->arena, &r->plan, r->experiment, &r->source, err);
    if (!code)
        code = rl_ab_page_new(&r->plan, &r->source, &options, &r->page, err);
    return code ? code : check_report_frames(r, err);
}

static rl_code open_all(rl_ab_run *r, rl_error *err)
{
    rl_tool *tool = r->tool;
    long cpus = sysconf(_SC_NPROCESSORS_ONLN);
    int threads = tool->args.run.threads ? tool->args.run.threads : cpus > 0 ? (int)cpus : 1;
    rl_code code = read_thresholds(r, err);
    if (!code)
        code = make_plan(r, err);
    if (!code && tool->args.trace)
        code = rl_trace_new(&r->trace, err);
    if (!code)
        code = rl_ab_open(&r->plan, &tool->args.run, &r->experiment, err);
    if (!code)
        code = rl_pool_new(threads, &r->pool, err);
    if (!code)
        code = rl_ab_measure_new(&r->plan, r->experiment, r->pool, &tool->report->log, &r->measure, err);
    if (!code)
        code = rl_outdir_make(r->out, err);
    if (!code)
        code = open_sheet(r, err);
    if (!code)
        code = open_page(r, err);
    if (!code)
        rl_ab_clean(r);
    return code;
}

static void close_all(rl_ab_run *r)
{
    rl_ab_page_free(&r->page);
    rl_ab_page_source_close(&r->source);
    rl_ab_sheet_free(&r->sheet);
    rl_ab_measure_free(&r->measure);
    rl_experiment_close(&r->experiment);
    rl_pool_free(&r->pool);
    rl_trace_free(&r->trace);
    rl_energy_ledger_free(&r->energy);
    for (size_t i = 0; i < r->n_ledgers; i++)
        rl_experiment_close(&r->ledgers[i]);
    rl_free(r->failures);
}

/* ---- the run ------------------------------------------------------------------------------------------- */

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* How the parts of the command ended. */
typedef struct ending {
    rl_code run, ledger, finish;
    rl_run_summary summary;
    size_t over;
    int signal;
} ending;

/* The exit status when all is written: what is missing comes before what cannot be compared, that before what
 * failed, that before what differs. */
static int status_of(const rl_ab_run *r, const ending *e, rl_error *err)
{
    if (e->run == RL_E_CANCELLED || e->ledger == RL_E_CANCELLED) {
        *err = (rl_error){0};
        return 128 + e->signal;
    }
    if (e->run)
        return e->summary.frames ? RL_EXIT_FRAME : RL_EXIT_WRONG;
    if (r->incomparable)
        return RL_EXIT_WRONG;
    if (e->finish || e->summary.failed)
        return RL_EXIT_FRAME;
    return e->over ? RL_EXIT_OVER : RL_EXIT_DONE;
}

/* The report without a ledger is still one. */
static rl_code add_ledger(rl_ab_run *r)
{
    rl_error err = {0};
    rl_code code = rl_ab_ledger(r, &err);
    if (code)
        rl_report(&r->tool->report->log, RL_WARNING, (rl_where){err.file, err.line, err.column},
                  "the report's ledger of energy is not whole: %s", err.text);
    return code;
}

/* All frames, then the report of those that were compared, also when a signal ended the run. */
static int run_all(rl_ab_run *r, rl_error *err)
{
    rl_reporter *report = r->tool->report;
    rl_experiment_hooks hooks;
    rl_error unwritten = {0};
    ending e = {0};
    double begin = now_s();

    rl_ab_run_hooks(r, &hooks);
    rl_signals_begin(fileno(report->err));
    rl_report_run_begin(report);
    e.run = rl_experiment_run(r->experiment, &hooks, &e.summary, err);
    if (!e.run && r->frames && !r->tool->args.run.energy)
        e.ledger = add_ledger(r);
    e.signal = rl_signals_caught(); /* one that comes from here on finds all done but the writing */
    if (!e.run || e.summary.frames || e.run == RL_E_CANCELLED) /* not: kernels that do not compile */
        rl_report_run_end(report, &e.summary, e.run == RL_E_CANCELLED);
    if (!e.run || r->frames)
        e.finish = rl_ab_finish(r, now_s() - begin, &e.over, &unwritten);
    if (!e.finish && r->trace)
        e.finish = rl_trace_write(r->trace, r->tool->args.trace, &unwritten);
    rl_signals_end();
    if (e.finish)
        rl_report_error(report, &unwritten);
    return status_of(r, &e, err);
}

int rl_cmd_ab(rl_tool *tool, rl_error *err)
{
    rl_ab_run run = {.tool = tool};
    if (!tool->args.run.out)
        tool->args.run.out = "out/ab";
    tool->report->resumes = false;
    run.out = tool->args.run.out;
    int status = open_all(&run, err) ? RL_EXIT_WRONG : run_all(&run, err);
    close_all(&run);
    return status;
}
