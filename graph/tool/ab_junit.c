#include "graph/tool/ab_junit.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "graph/tool/ab_fail.h"

enum { MOST_FRAMES = 100 }; /* that a failure lists */

/* ---- XML ----------------------------------------------------------------------------------------------- */

/* Escaped for text and attributes. What XML cannot hold (control characters, bytes that are not UTF-8)
 * becomes
 * '?'. */
static void add_text(rl_str *out, const char *text)
{
    json_t *valid = json_string(text); /* NULL: not UTF-8 */
    for (const char *c = text; *c; c++) {
        unsigned char u = (unsigned char)*c;
        if (u == '&')
            rl_str_add(out, "&amp;");
        else if (u == '<')
            rl_str_add(out, "&lt;");
        else if (u == '>')
            rl_str_add(out, "&gt;");
        else if (u == '"')
            rl_str_add(out, "&quot;");
        else if (u == '\t' || u == '\n' || u == '\r')
            rl_str_printf(out, "&#%d;", u);
        else if (u < 0x20 || u == 0x7f || (u >= 0x80 && !valid))
            rl_str_add(out, "?");
        else
            rl_str_addn(out, c, 1);
    }
    json_decref(valid);
}

static void add_attribute(rl_str *out, const char *name, const char *value)
{
    rl_str_printf(out, " %s=\"", name);
    add_text(out, value);
    rl_str_add(out, "\"");
}

/* Seconds with three digits, by whole milliseconds: no locale writes a comma. */
static void add_seconds(rl_str *out, double seconds)
{
    long long ms = seconds > 0 ? (long long)(seconds * 1e3 + 0.5) : 0;
    rl_str_printf(out, " time=\"%lld.%03lld\"", ms / 1000, ms % 1000);
}

/* ---- testcases ----------------------------------------------------------------------------------------- */

/* A suite while it is written: first counted, then printed. */
typedef struct suite {
    const rl_ab_report *r;
    size_t capture;
    size_t tests, failures, errors;
    double seconds; /* of a testcase */
    rl_str *out;    /* NULL: count only */
    bool failed;    /* memory ran out */
} suite;

static void release(suite *s, rl_str *text)
{
    s->failed = s->failed || text->failed;
    rl_str_free(text);
}

static void open_case(suite *s, const char *class, const char *name)
{
    s->tests++;
    if (!s->out)
        return;
    rl_str_add(s->out, "    <testcase");
    add_attribute(s->out, "classname", class);
    add_attribute(s->out, "name", name);
    add_seconds(s->out, s->seconds);
    rl_str_add(s->out, ">");
}

static void close_case(suite *s)
{
    if (s->out)
        rl_str_add(s->out, "</testcase>\n");
}

static bool belongs(const rl_ab_offender *o, const suite *s, int pair, int material)
{
    return o->capture == s->capture && o->pair == pair && o->material == material;
}

/* The frames of a pair and material that are over a limit, if any. */
static void add_failure(suite *s, const rl_ab_verdict *v, int pair, int material)
{
    size_t n = 0;
    char name[32];
    rl_str text = {0};
    for (size_t i = 0; i < v->n_over; i++) {
        if (!belongs(&v->over[i], s, pair, material))
            continue;
        if (n++ < MOST_FRAMES && s->out) {
            rl_ab_fail_offender(s->r, &v->over[i], &text);
            rl_str_add(&text, "\n");
        }
    }
    s->failures += n > 0;
    if (n && s->out) {
        rl_str message = {0};
        bool under = v->threshold.metric >= 0 && rl_metric_rises((rl_metric)v->threshold.metric);
        rl_str_printf(&message, "%s %s %g in %zu frame%s", rl_threshold_name(&v->threshold, name),
                      under ? "under" : "over", v->threshold.limit, n, n == 1 ? "" : "s");
        rl_str_add(s->out, "<failure type=\"threshold\"");
        add_attribute(s->out, "message", rl_str_text(&message));
        rl_str_add(s->out, ">");
        if (n > MOST_FRAMES)
            rl_str_printf(&text, "and %zu more\n", n - MOST_FRAMES);
        add_text(s->out, rl_str_text(&text));
        rl_str_add(s->out, "</failure>");
        release(s, &message);
    }
    release(s, &text);
}

/* Did a frame of the capture show the material? All of them together are there when any is. */
static bool was_seen(const suite *s, size_t pair, int material)
{
    const rl_ab_results *results = s->r->results;
    for (size_t i = 0; i < results->n_values; i++) {
        const rl_ab_value *v = &results->values[i];
        if (v->capture == s->capture && v->pair == pair && v->material == material)
            return true;
    }
    return false;
}

/* "monkey.pre_post against post" */
static void add_class(const suite *s, size_t pair, rl_str *out)
{
    rl_str_printf(out, "%s.%s against %s", rl_ab_capture_name(s->r, s->capture), rl_ab_test_name(s->r, pair),
                  rl_ab_reference_name(s->r, pair));
}

static void threshold_cases(suite *s, size_t pair, const rl_ab_verdict *v)
{
    rl_str class = {0};
    char what[32];
    size_t n;
    rl_experiment_materials(s->r->experiment, s->capture, &n);
    add_class(s, pair, &class);
    for (int m = RL_AB_WHOLE; m < (int)n; m++) {
        const char *material = rl_ab_material_name(s->r, s->capture, m);
        if (m == 0 || !was_seen(s, pair, m))
            continue;
        rl_str name = {0};
        rl_str_printf(&name, "%s of %s", rl_threshold_name(&v->threshold, what),
                      material ? material : "all materials");
        open_case(s, rl_str_text(&class), rl_str_text(&name));
        add_failure(s, v, (int)pair, m);
        close_case(s);
        release(s, &name);
    }
    release(s, &class);
}

static void pair_case(suite *s, size_t pair)
{
    rl_str class = {0};
    add_class(s, pair, &class);
    open_case(s, rl_str_text(&class), "compared");
    close_case(s);
    release(s, &class);
}

/* Energy is of variants, not of pairs: one testcase for all of a capture. */
static void energy_case(suite *s, const rl_ab_verdict *v)
{
    size_t n = 0;
    open_case(s, rl_ab_capture_name(s->r, s->capture), "energy");
    for (size_t i = 0; i < v->n_over; i++)
        n += v->over[i].capture == s->capture;
    s->failures += n > 0;
    if (n && s->out) {
        rl_str text = {0};
        for (size_t i = 0, k = 0; i < v->n_over; i++) {
            if (v->over[i].capture != s->capture || k++ >= MOST_FRAMES)
                continue;
            rl_ab_fail_offender(s->r, &v->over[i], &text);
            rl_str_add(&text, "\n");
        }
        if (n > MOST_FRAMES)
            rl_str_printf(&text, "and %zu more\n", n - MOST_FRAMES);
        rl_str_printf(s->out, "<failure type=\"threshold\" message=\"energy over %g in %zu place%s\">",
                      v->threshold.limit, n, n == 1 ? "" : "s");
        add_text(s->out, rl_str_text(&text));
        rl_str_add(s->out, "</failure>");
        release(s, &text);
    }
    close_case(s);
}

static void failed_frames(suite *s)
{
    char name[48];
    for (size_t i = 0; i < s->r->n_failures; i++) {
        const rl_ab_failure *f = &s->r->failures[i];
        if (f->capture != s->capture)
            continue;
        snprintf(name, sizeof name, "frame %lld", f->frame);
        open_case(s, rl_ab_capture_name(s->r, s->capture), name);
        s->errors++;
        if (s->out) {
            rl_str_add(s->out, "<error type=\"frame\"");
            add_attribute(s->out, "message", f->text);
            rl_str_add(s->out, "/>");
        }
        close_case(s);
    }
}

static void all_cases(suite *s)
{
    s->tests = s->failures = s->errors = 0;
    for (size_t p = 0; p < s->r->plan->n_pairs; p++) {
        size_t thresholds = 0;
        for (size_t i = 0; i < s->r->n_verdicts; i++) {
            const rl_ab_verdict *v = &s->r->verdicts[i];
            if (v->threshold.metric == RL_THRESHOLD_ENERGY)
                continue;
            threshold_cases(s, p, v);
            thresholds++;
        }
        if (!thresholds)
            pair_case(s, p);
    }
    for (size_t i = 0; i < s->r->n_verdicts; i++)
        if (s->r->verdicts[i].threshold.metric == RL_THRESHOLD_ENERGY)
            energy_case(s, &s->r->verdicts[i]);
    failed_frames(s);
}

/* ---- the document -------------------------------------------------------------------------------------- */

static void add_suite(const rl_ab_report *r, size_t capture, size_t frames, rl_str *out)
{
    const rl_session *session = rl_experiment_session(r->experiment, 0);
    suite s = {.r = r, .capture = capture};
    char stamp[32] = "1970-01-01T00:00:00";
    time_t started = (time_t)r->started;
    struct tm utc;
    double seconds =
        frames ? r->seconds * (double)rl_session_frames(session, capture) / (double)frames : r->seconds;
    all_cases(&s);
    s.seconds = s.tests ? seconds / (double)s.tests : 0;
    if (gmtime_r(&started, &utc))
        strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    rl_str_add(out, "  <testsuite");
    add_attribute(out, "name", rl_ab_capture_name(r, capture));
    rl_str_printf(out,
                  " package=\"relit.ab\" id=\"%zu\" timestamp=\"%s\" hostname=\"localhost\" tests=\"%zu\" "
                  "failures=\"%zu\" errors=\"%zu\"",
                  capture, stamp, s.tests, s.failures, s.errors);
    add_seconds(out, seconds);
    rl_str_add(out, ">\n    <properties>");
    if (r->command) {
        rl_str_add(out, "<property name=\"command\"");
        add_attribute(out, "value", r->command);
        rl_str_add(out, "/>");
    }
    rl_str_add(out, "</properties>\n");
    s.out = out;
    all_cases(&s);
    out->failed = out->failed || s.failed;
    rl_str_add(out, "    <system-out>");
    add_text(out, r->summary ? r->summary : "");
    rl_str_add(out, "</system-out>\n    <system-err></system-err>\n  </testsuite>\n");
}

rl_code rl_ab_junit(const rl_ab_report *r, rl_str *out, rl_error *err)
{
    const rl_session *session = rl_experiment_session(r->experiment, 0);
    size_t captures = rl_session_captures(session), frames = 0;
    for (size_t c = 0; c < captures; c++)
        frames += rl_session_frames(session, c);
    rl_str_add(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    for (size_t c = 0; c < captures; c++)
        add_suite(r, c, frames, out);
    rl_str_add(out, "</testsuites>\n");
    return out->failed ? rl_fail_memory(err, out->room) : RL_OK;
}
