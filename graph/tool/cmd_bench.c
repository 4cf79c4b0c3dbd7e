/* `relit bench`: what a run spends its time on. Frames of the capture over and over, through the same stages,
 * overlapping as in a run; pictures go to a temporary folder. */
#include <dirent.h>
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/data_files.h"
#include "graph/run/session.h"
#include "graph/tool/enlarge.h"
#include "graph/tool/json_print.h"
#include "graph/tool/signals.h"
#include "graph/tool/tool.h"

enum { MOST_ROWS = 256, ENLARGED = 4, LEAST_FRAMES = 24 };

/* What has one lane, category and name. */
typedef struct row {
    rl_lane lane;
    char category[32], name[96];
    double ns;
} row;

typedef struct bench {
    pthread_mutex_t mutex;
    row rows[MOST_ROWS];
    size_t n;
    size_t frames, failed;
    rl_error first; /* of a frame that failed */
    double wall_s;
    size_t peak;
    int width, height;
    char *folder;
} bench;

static void on_span(void *ctx, const rl_run_span *s)
{
    bench *b = ctx;
    pthread_mutex_lock(&b->mutex);
    size_t i = 0;
    while (i < b->n && (b->rows[i].lane != s->lane || strcmp(b->rows[i].category, s->category) ||
                        strncmp(b->rows[i].name, s->name, sizeof b->rows[i].name - 1)))
        i++;
    if (i == b->n && b->n < MOST_ROWS) {
        row *r = &b->rows[b->n++];
        *r = (row){.lane = s->lane};
        snprintf(r->category, sizeof r->category, "%s", s->category);
        snprintf(r->name, sizeof r->name, "%s", s->name);
    }
    if (i < b->n)
        b->rows[i].ns += (double)(s->end - s->start);
    pthread_mutex_unlock(&b->mutex);
}

static void on_frame(void *ctx, const rl_frame_result *f)
{
    bench *b = ctx;
    b->frames++;
    if (f->error->code && !b->failed++)
        b->first = *f->error;
}

static int on_stop(void *ctx)
{
    (void)ctx;
    return rl_signals_caught();
}

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- running ---------------------------------------------------------------------------------------------
 */

static void remove_folder(const char *path)
{
    DIR *dir = opendir(path);
    rl_arena arena = {0};
    for (struct dirent *d = dir ? readdir(dir) : NULL; d; d = readdir(dir)) {
        const char *inside = rl_path_join(&arena, path, d->d_name);
        if (!inside || !strcmp(d->d_name, ".") || !strcmp(d->d_name, ".."))
            continue;
        if (d->d_type == DT_DIR)
            remove_folder(inside);
        else
            unlink(inside);
    }
    if (dir)
        closedir(dir);
    rmdir(path);
    rl_arena_free(&arena);
}

static rl_code make_folder(rl_arena *arena, bench *b, rl_error *err)
{
    const char *base = getenv("TMPDIR");
    char *path = rl_path_join(arena, base && *base ? base : "/tmp", "relit-bench-XXXXXX");
    if (!path)
        return rl_fail_memory(err, 1);
    if (!mkdtemp(path))
        return rl_fail_file(err, RL_E_IO, path, "the folder cannot be made: %s", strerror(errno));
    b->folder = path;
    return RL_OK;
}

/* With --size: opens the capture once to enlarge it, then again at the other size. */
static rl_code open_session(rl_tool *tool, bench *b, rl_session **session, rl_error *err)
{
    rl_options *o = &tool->args.run;
    rl_code code = rl_session_open(o, session, err);
    const int *size = tool->args.size;
    if (code || !size[0])
        return code;
    const char *path = NULL, **captures = rl_arena_array(tool->arena, 1, sizeof *captures);
    code = captures ? rl_enlarge_capture(tool->arena, (*session)->sequences[0].manifest, b->folder, size[0],
                                         size[1], ENLARGED, (*session)->pool, &path, err)
                    : rl_fail_memory(err, 1);
    rl_session_close(session);
    if (code)
        return code;
    captures[0] = path;
    o->captures = captures;
    o->n_captures = 1;
    o->frames = NULL;
    return rl_session_open(o, session, err);
}

/* Once to fill caches, then often enough to be worth a mean. */
static rl_code run_often(rl_session *session, bench *b, rl_error *err)
{
    rl_run_hooks hooks = {.frame = on_frame, .stop = on_stop, .ctx = b, .span = on_span};
    rl_run_summary summary;
    rl_code code = rl_session_run(session, &hooks, &summary, err);
    b->n = b->frames = 0;
    rl_alloc_reset_peak();
    double start = now_s();
    while (!code && !b->failed && b->frames < LEAST_FRAMES)
        code = rl_session_run(session, &hooks, &summary, err);
    b->wall_s = now_s() - start;
    b->peak = summary.peak_bytes;
    if (!code && b->failed) {
        code = b->first.code;
        *err = b->first;
    }
    b->width = session->sequences[0].geometry.width;
    b->height = session->sequences[0].geometry.height;
    return code;
}

/* ---- printing --------------------------------------------------------------------------------------------
 */

static int in_order(const void *a, const void *b)
{
    const row *x = a, *y = b;
    static const char *const first[] = {"read", "run", "write"}; /* a stage stands before its parts */
    if (x->lane != y->lane)
        return x->lane < y->lane ? -1 : 1;
    for (int i = 0; i < 3; i++)
        if (!strcmp(x->category, first[i]) != !strcmp(y->category, first[i]))
            return !strcmp(x->category, first[i]) ? -1 : 1;
    return x->ns > y->ns ? -1 : x->ns < y->ns;
}

static bool is_stage(const row *r)
{
    return !strcmp(r->category, "read") || !strcmp(r->category, "run") || !strcmp(r->category, "write");
}

/* Of all stages together: they overlap, so that this is work and not time. */
static double work_ns(const bench *b)
{
    double sum = 0;
    for (size_t i = 0; i < b->n; i++)
        sum += is_stage(&b->rows[i]) ? b->rows[i].ns : 0;
    return sum > 0 ? sum : 1;
}

static void print_table(const rl_tool *tool, const bench *b, const rl_session *s, rl_str *out)
{
    char bytes[32];
    rl_str_printf(out, "%s, %d x %d, %zu frames, %d %s, %s\n\n%-52s %10s %7s\n", tool->args.run.pipeline,
                  b->width, b->height, b->frames, s->threads, s->threads == 1 ? "thread" : "threads",
                  rl_device_about(s->device)->name, "stage", "ms a frame", "share");
    for (size_t i = 0; i < b->n; i++) {
        const row *r = &b->rows[i];
        char name[160];
        snprintf(name, sizeof name, is_stage(r) ? "%s%s" : "  %s %s", r->category,
                 is_stage(r) ? "" : r->name);
        rl_str_printf(out, "%-52s %10.3f %6.1f%%\n", name, 1e-6 * r->ns / (double)b->frames,
                      100 * r->ns / work_ns(b));
    }
    rl_str_printf(out, "\n%.2f frames/s (%.1f ms a frame: stages overlap), peak memory %s\n",
                  (double)b->frames / b->wall_s, 1e3 * b->wall_s / (double)b->frames,
                  rl_format_bytes(b->peak, bytes));
}

static void print_json(const rl_tool *tool, const bench *b, const rl_session *s, rl_str *out)
{
    json_t *stages = json_array();
    for (size_t i = 0; i < b->n; i++) {
        const row *r = &b->rows[i];
        json_array_append_new(stages,
                              json_pack("{s:s, s:s, s:b, s:f, s:f}", "category", r->category, "name", r->name,
                                        "stage", is_stage(r), "ms", 1e-6 * r->ns / (double)b->frames, "share",
                                        r->ns / work_ns(b)));
    }
    json_t *o =
        json_pack("{s:s, s:s, s:s, s:i, s:i, s:i, s:i, s:f, s:f, s:I, s:o}", "version", RL_VERSION,
                  "pipeline", tool->args.run.pipeline, "device", rl_device_about(s->device)->name, "threads",
                  s->threads, "width", b->width, "height", b->height, "frames", (int)b->frames,
                  "frames_per_s", (double)b->frames / b->wall_s, "ms_per_frame",
                  1e3 * b->wall_s / (double)b->frames, "peak_bytes", (json_int_t)b->peak, "stages", stages);
    rl_json_print(o, JSON_COMPACT | JSON_REAL_PRECISION(6), out);
}

int rl_cmd_bench(rl_tool *tool, rl_error *err)
{
    rl_session *session = NULL;
    rl_str text = {0};
    int status = RL_EXIT_WRONG;
    bench *b = rl_calloc(1, sizeof *b);
    if (!b) {
        rl_fail_memory(err, sizeof *b);
        return status;
    }
    pthread_mutex_init(&b->mutex, NULL);
    if (!tool->args.run.pipeline)
        tool->args.run.pipeline = rl_data_path(tool->arena, "skin.yaml");
    if (make_folder(tool->arena, b, err))
        goto done;
    tool->args.run.out = b->folder;
    if (open_session(tool, b, &session, err) || rl_session_prepare(session, err))
        goto done;
    rl_signals_begin(fileno(tool->report->err));
    rl_code code = run_often(session, b, err);
    int signal = rl_signals_caught();
    rl_signals_end();
    if (code == RL_E_CANCELLED) {
        *err = (rl_error){0};
        status = 128 + signal;
    }
    if (code)
        goto done;
    qsort(b->rows, b->n, sizeof *b->rows, in_order);
    (tool->args.json ? print_json : print_table)(tool, b, session, &text);
    status = rl_tool_print(tool, &text, err);
done:
    rl_session_close(&session);
    if (b->folder)
        remove_folder(b->folder);
    pthread_mutex_destroy(&b->mutex);
    rl_free(b);
    return status;
}
