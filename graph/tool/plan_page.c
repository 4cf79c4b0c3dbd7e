#include "graph/tool/plan_page.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/tool/page_source.h"

/* ---- the trace ----------------------------------------------------------------------------------------- */

/* Adds a span to the sums, {"kernel sss: sss_burley_filter": {"us": 1.5, "n": 2}}, and its frame to a set. */
static int add_span(json_t *sums, json_t *frames, const json_t *event)
{
    const char *category = json_string_value(json_object_get(event, "cat"));
    const char *name = json_string_value(json_object_get(event, "name"));
    const json_t *args = json_object_get(event, "args"), *frame = json_object_get(args, "frame");
    const char *capture = json_string_value(json_object_get(args, "capture"));
    double us = json_number_value(json_object_get(event, "dur"));
    char key[512], of[300];
    if (!category || !name || !json_is_integer(frame))
        return 0;
    snprintf(key, sizeof key, "%s %s", category, name);
    snprintf(of, sizeof of, "%" JSON_INTEGER_FORMAT " %s", json_integer_value(frame), capture ? capture : "");
    json_t *sum = json_object_get(sums, key);
    double total = us + json_number_value(json_object_get(sum, "us"));
    json_int_t n = 1 + json_integer_value(json_object_get(sum, "n"));
    return json_object_set_new(sums, key, json_pack("{s:f, s:I}", "us", total, "n", n)) |
           json_object_set_new(frames, of, json_true());
}

/* Sums become milliseconds a frame: a step that runs twice a frame counts twice. */
static rl_code print_sums(json_t *sums, size_t frames, rl_str *out)
{
    const char *key, *between = "";
    json_t *sum;
    rl_str_printf(out, "{\"frames\":%zu,\"spans\":{", frames);
    json_object_foreach(sums, key, sum)
    {
        char ms[32];
        rl_str_add(out, between);
        rl_page_json_text(out, key);
        rl_format_double(json_number_value(json_object_get(sum, "us")) / 1000 / (double)frames, ms);
        rl_str_printf(out, ":{\"ms\":%s}", ms);
        between = ",";
    }
    rl_str_add(out, "}}");
    return RL_OK;
}

static rl_code read_trace(const char *path, rl_str *out, rl_error *err)
{
    char *text = NULL;
    size_t size = 0, i;
    json_error_t bad;
    json_t *root = NULL, *event, *sums = json_object(), *frames = json_object();
    int failed = !sums || !frames;
    rl_code code = rl_file_read(path, &text, &size, err);
    if (!code)
        root = json_loadb(text, size, 0, &bad);
    json_t *events = json_object_get(root, "traceEvents");
    if (!code && !json_is_array(events))
        code = rl_fail_file(err, RL_E_FORMAT, path, "is no trace: `relit run --trace F.json` writes one");
    json_array_foreach(events, i, event) failed |= add_span(sums, frames, event);
    if (!code && failed)
        code = rl_fail_memory(err, size);
    if (!code && !json_object_size(frames))
        code = rl_fail_file(err, RL_E_FORMAT, path, "the trace holds no frame");
    if (!code)
        code = print_sums(sums, json_object_size(frames), out);
    json_decref(root);
    json_decref(sums);
    json_decref(frames);
    rl_free(text);
    return code;
}

/* ---- the page ------------------------------------------------------------------------------------------ */

typedef struct page {
    const char *title;
    rl_str plans, trace;
    rl_str *out;
} page;

static void put(void *ctx, const char *text, size_t n)
{
    rl_str_addn(((page *)ctx)->out, text, n);
}

static rl_code put_part(void *ctx, const char *name, size_t n, rl_error *err)
{
    static const char *const scripts[] = {"text.js", "graph.js", "plan.js", NULL};
    page *p = ctx;
    const rl_page_maker maker = {put, NULL, p};
    (void)err;
    if (!strncmp(name, "title", n))
        rl_page_html_text(p->out, p->title);
    else if (!strncmp(name, "style", n))
        rl_str_add(p->out, rl_page_source("page.css"));
    else if (!strncmp(name, "plans", n))
        rl_page_put_json(&maker, rl_str_text(&p->plans));
    else if (!strncmp(name, "trace", n))
        rl_str_add(p->out, rl_str_text(&p->trace));
    else if (!strncmp(name, "script", n))
        rl_page_put_scripts(&maker, scripts);
    return RL_OK;
}

/* Lines of objects as one array. */
static void join_lines(const char *lines, rl_str *out)
{
    const char *between = "";
    rl_str_add(out, "[");
    for (const char *at = lines; *at;) {
        size_t n = strcspn(at, "\n");
        if (n) {
            rl_str_add(out, between);
            rl_str_addn(out, at, n);
            between = ",\n";
        }
        at += n + (at[n] == '\n');
    }
    rl_str_add(out, "]");
}

rl_code rl_plan_page(const char *title, const char *plans, const char *trace, rl_str *out, rl_error *err)
{
    page p = {.title = title, .out = out};
    const rl_page_maker maker = {put, put_part, &p};
    join_lines(plans, &p.plans);
    rl_code code = RL_OK;
    if (trace)
        code = read_trace(trace, &p.trace, err);
    else
        rl_str_add(&p.trace, "null");
    if (!code)
        code = rl_page_expand("plan.html", &maker, err);
    if (!code && (p.plans.failed || p.trace.failed || out->failed))
        code = rl_fail_memory(err, out->length);
    rl_str_free(&p.plans);
    rl_str_free(&p.trace);
    return code;
}
