#include "graph/tool/report.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#include "graph/base/alloc.h"

static uint64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* ---- lines ----------------------------------------------------------------------------------------------
 */

#define RED        "\033[1;31m"
#define YELLOW     "\033[1;33m"
#define CYAN       "\033[36m"
#define PLAIN      "\033[0m"
#define CLEAR_LINE "\r\033[K"

static void hide_bar(rl_reporter *r)
{
    if (r->bar)
        fputs(CLEAR_LINE, r->err);
    r->bar = false;
}

static void print_line(rl_reporter *r, rl_where where, const char *color, const char *word, const char *text)
{
    hide_bar(r);
    if (where.file && *where.file && where.line > 0)
        fprintf(r->err, "%s:%d:%d: ", where.file, where.line, where.column);
    else if (where.file && *where.file)
        fprintf(r->err, "%s: ", where.file);
    fprintf(r->err, "%s%s:%s %s\n", r->color ? color : "", word, r->color ? PLAIN : "", text);
    fflush(r->err);
}

/* Two thousand frames may give the same warning: it is printed once. */
static bool seen_before(rl_reporter *r, rl_where where, const char *text)
{
    uint64_t hash = XXH3_64bits(text, strlen(text));
    if (where.file)
        hash = XXH3_64bits_withSeed(where.file, strlen(where.file), hash + (uint64_t)where.line);
    for (size_t i = 0; i < r->n_seen; i++)
        if (r->seen[i] == hash)
            return true;
    if (r->n_seen < RL_REPORT_SEEN)
        r->seen[r->n_seen++] = hash;
    return false;
}

static void sink(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    rl_reporter *r = ctx;
    if ((severity == RL_NOTE && r->quiet) || (severity == RL_VERBOSE && !r->verbose))
        return;
    pthread_mutex_lock(&r->lock);
    if (!seen_before(r, where, text))
        print_line(r, where, severity == RL_WARNING ? YELLOW : CYAN,
                   severity == RL_WARNING ? "warning" : "note", text);
    pthread_mutex_unlock(&r->lock);
}

void rl_reporter_begin(rl_reporter *r, FILE *out, FILE *err)
{
    *r = (rl_reporter){.out = out, .err = err, .resumes = true, .log = {sink, r}};
    const char *term = getenv("TERM"), *no_color = getenv("NO_COLOR");
    int fd = fileno(err);
    r->terminal = fd >= 0 && isatty(fd) && term && strcmp(term, "dumb");
    r->color = r->terminal && !(no_color && *no_color);
    pthread_mutex_init(&r->lock, NULL);
}

void rl_reporter_end(rl_reporter *r)
{
    rl_str_free(&r->failed);
    pthread_mutex_destroy(&r->lock);
}

static void error_line(rl_reporter *r, const rl_error *err)
{
    print_line(r, (rl_where){err->file, err->line, err->column}, RED, "error", err->text);
}

void rl_report_error(rl_reporter *r, const rl_error *err)
{
    pthread_mutex_lock(&r->lock);
    error_line(r, err);
    pthread_mutex_unlock(&r->lock);
}

rl_code rl_report_result(rl_reporter *r, const char *text, rl_error *err)
{
    pthread_mutex_lock(&r->lock);
    hide_bar(r);
    bool good = fputs(text, r->out) >= 0 && fflush(r->out) == 0;
    pthread_mutex_unlock(&r->lock);
    return good ? RL_OK : rl_fail(err, RL_E_IO, RL_NOWHERE, "standard output cannot be written");
}

/* ---- progress -------------------------------------------------------------------------------------------
 */

void rl_report_run_begin(rl_reporter *r)
{
    r->begin = now_ns();
    r->n_files = 0;
    r->done = r->total = 0;
    memset(r->staged, 0, sizeof r->staged);
    rl_str_free(&r->failed);
}

/* JSON is UTF-8 and file names need not be: bytes that are no text become '?'. */
static json_t *json_text(const char *text)
{
    json_t *value = json_string(text);
    char *copy = value ? NULL : rl_strdup(text);
    for (char *c = copy; c && *c; c++)
        if ((unsigned char)*c >= 0x80)
            *c = '?';
    if (copy)
        value = json_string(copy);
    rl_free(copy);
    return value;
}

json_t *rl_report_error_json(const rl_error *err)
{
    return json_pack("{s:s, s:o, s:i, s:i, s:o}", "code", rl_code_name(err->code), "file",
                     json_text(err->file), "line", err->line, "column", err->column, "text",
                     json_text(err->text));
}

static void frame_json(rl_reporter *r, const rl_frame_result *f)
{
    json_t *files = json_array(), *error = json_null();
    for (size_t i = 0; i < f->n_files; i++)
        json_array_append_new(files, json_text(f->files[i]));
    if (f->error && f->error->code)
        error = rl_report_error_json(f->error);
    json_t *object =
        json_pack("{s:o, s:I, s:b, s:o, s:o}", "capture", json_text(f->capture), "frame",
                  (json_int_t)f->frame, "ok", !(f->error && f->error->code), "files", files, "error", error);
    if (f->load_s >= 0) /* one pipeline's frame */
        json_object_update_new(object,
                               json_pack("{s:I, s:I, s:f, s:f, s:f}", "nonfinite", (json_int_t)f->nonfinite,
                                         "clamped", (json_int_t)f->clamped, "load_s", f->load_s, "run_s",
                                         f->run_s, "write_s", f->write_s));
    json_object_update_new(
        object, json_pack("{s:I, s:I}", "done", (json_int_t)f->done, "total", (json_int_t)f->total));
    char *text = object ? json_dumps(object, JSON_COMPACT | JSON_REAL_PRECISION(6)) : NULL;
    if (text)
        fprintf(r->out, "%s\n", text);
    fflush(r->out);
    free(text);
    json_decref(object);
}

static void frame_line(rl_reporter *r, const rl_frame_result *f)
{
    fprintf(r->err, "[%zu/%zu] %s frame %lld:", f->done, f->total, f->capture, f->frame);
    bool many = f->load_s < 0 && f->n_files > 4; /* of many variants, which --json lists */
    for (size_t i = 0; i < f->n_files && !many; i++)
        fprintf(r->err, " %s", f->files[i]);
    if (many)
        fprintf(r->err, " %zu files", f->n_files);
    fprintf(r->err, "%s\n", f->n_files ? "" : " nothing written");
    fflush(r->err);
}

/* "  reading 12, kernels 11, writing 10": they overlap. */
static void add_stages(const rl_reporter *r)
{
    static const char *const verbs[RL_LANES] = {"reading", "kernels", NULL, "writing"};
    const char *between = "  ";
    for (int i = 0; i < RL_LANES; i++)
        if (verbs[i] && r->staged[i]) {
            fprintf(r->err, "%s%s %lld", between, verbs[i], r->stages[i]);
            between = ", ";
        }
}

static void draw_bar(rl_reporter *r)
{
    enum { WIDTH = 30 };
    uint64_t now = now_ns();
    size_t done = r->done, total = r->total;
    if (r->bar && (done < total || !total) && now - r->bar_at < 50000000u)
        return; /* 20 times a second is enough */
    double seconds = (double)(now - r->begin) * 1e-9;
    double rate = seconds > 0 ? (double)done / seconds : 0;
    long left = rate > 0 ? (long)((double)(total - done) / rate + 0.5) : 0;
    int full = total ? (int)(done * WIDTH / total) : 0;
    char bar[WIDTH + 1];
    memset(bar, '.', WIDTH);
    memset(bar, '#', (size_t)full);
    bar[WIDTH] = 0;
    if (total)
        fprintf(r->err, CLEAR_LINE "[%s] %zu/%zu  %.*f frames/s  %ld:%02ld left", bar, done, total,
                rate < 10 ? 2 : 0, rate, left / 60, left % 60);
    else
        fputs(CLEAR_LINE "first frame:", r->err);
    add_stages(r);
    fflush(r->err);
    r->bar = true;
    r->bar_at = now;
}

void rl_report_stage(rl_reporter *r, rl_lane lane, long long frame)
{
    pthread_mutex_lock(&r->lock);
    r->stages[lane] = frame;
    r->staged[lane] = true;
    if (r->terminal && !r->quiet)
        draw_bar(r);
    pthread_mutex_unlock(&r->lock);
}

void rl_report_frame(rl_reporter *r, const rl_frame_result *f)
{
    bool failed = f->error && f->error->code;
    pthread_mutex_lock(&r->lock);
    r->n_files += f->n_files;
    r->done = f->done;
    r->total = f->total;
    if (failed) {
        rl_error with_place = *f->error;
        if (!with_place.file[0])
            snprintf(with_place.file, sizeof with_place.file, "%s frame %lld", f->capture, f->frame);
        error_line(r, &with_place);
        rl_str_printf(&r->failed, "  %s frame %lld: %s\n", f->capture, f->frame, f->error->text);
    }
    if (r->json)
        frame_json(r, f);
    if (r->terminal && !r->quiet)
        draw_bar(r);
    else if (!r->quiet && !r->json && !failed)
        frame_line(r, f);
    pthread_mutex_unlock(&r->lock);
}

void rl_report_run_end(rl_reporter *r, const rl_run_summary *s, bool stopped)
{
    double seconds = (double)(now_ns() - r->begin) * 1e-9;
    char bytes[32];
    pthread_mutex_lock(&r->lock);
    hide_bar(r);
    if (stopped)
        fprintf(r->err, "stopped: %zu frames were finished, the others were not begun%s\n", s->frames,
                r->resumes ? "; the same command with --resume goes on" : "");
    if (s->failed)
        fprintf(r->err, "%zu of %zu frames failed:\n%s", s->failed, s->frames, rl_str_text(&r->failed));
    if (!r->quiet)
        fprintf(r->err, "%zu %s, %zu %s in %.2f s (%.2f frames/s), peak memory %s\n", s->frames,
                s->frames == 1 ? "frame" : "frames", r->n_files, r->n_files == 1 ? "file" : "files", seconds,
                seconds > 0 ? (double)s->frames / seconds : 0, rl_format_bytes(s->peak_bytes, bytes));
    pthread_mutex_unlock(&r->lock);
    if (s->nonfinite)
        rl_report(&r->log, RL_WARNING, RL_NOWHERE,
                  "%" PRIu64 " samples of the capture were NaN or infinite; they became 0", s->nonfinite);
    if (s->clamped)
        rl_report(&r->log, RL_NOTE, RL_NOWHERE,
                  "%" PRIu64
                  " samples were outside of the range of their layer or of their file and were clamped",
                  s->clamped);
}
