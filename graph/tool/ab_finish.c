/* What `relit ab` leaves behind when all frames are done, and what it prints. */
#include <stdlib.h>

#include <jansson.h>

#include "graph/base/file.h"
#include "graph/run/leftovers.h"
#include "graph/tool/ab_json.h"
#include "graph/tool/ab_junit.h"
#include "graph/tool/ab_run.h"
#include "graph/tool/ab_table.h"
#include "graph/tool/ab_words.h"
#include "graph/tool/plan_variants.h"

/* Names in --out. */
static const char metrics_name[] = "metrics.json", junit_name[] = "junit.xml", page_name[] = "report.html";

/* What is at the end, all in the tool's arena but the results. */
typedef struct finish {
    rl_ab_run *run;
    rl_ab_results results;
    rl_ab_report report;
    rl_ab_verdict *verdicts;
    rl_str metrics;   /* the text of metrics.json */
    bool page, sheet; /* were written */
    rl_error *err;
} finish;

static rl_code check_thresholds(finish *f)
{
    const rl_ab_run *r = f->run;
    if (!r->frames || !r->n_thresholds)
        return RL_OK;
    rl_code code =
        rl_ab_fail_check(r->tool->arena, &f->report, r->thresholds, r->n_thresholds, &f->verdicts, f->err);
    f->report.verdicts = f->verdicts;
    f->report.n_verdicts = code ? 0 : r->n_thresholds;
    return code;
}

static rl_code write_text(const finish *f, const char *name, const rl_str *text)
{
    const char *path = rl_path_join(f->run->tool->arena, f->run->out, name);
    return path ? rl_file_write(path, rl_str_text(text), text->length, f->err) : rl_fail_memory(f->err, 64);
}

static rl_code make_summary(finish *f)
{
    rl_str text = {0};
    rl_code code = rl_ab_words(&f->report, &text, f->err);
    if (!code && !(f->report.summary = rl_arena_strdup(f->run->tool->arena, rl_str_text(&text))))
        code = rl_fail_memory(f->err, text.length);
    rl_str_free(&text);
    return code;
}

static rl_code write_junit(const finish *f)
{
    rl_str text = {0};
    rl_code code = rl_ab_junit(&f->report, &text, f->err);
    if (!code)
        code = write_text(f, junit_name, &text);
    rl_str_free(&text);
    return code;
}

static rl_code write_metrics(finish *f)
{
    rl_code code = rl_ab_json(&f->report, &f->metrics, f->err);
    return code ? code : write_text(f, metrics_name, &f->metrics);
}

static rl_code write_page(const finish *f)
{
    const char *path = rl_path_join(f->run->tool->arena, f->run->out, page_name);
    return path ? rl_ab_page_write(f->run->page, path, rl_str_text(&f->metrics), NULL, f->err)
                : rl_fail_memory(f->err, 64);
}

/* ---- stdout -------------------------------------------------------------------------------------------- */

static rl_code print_text(const finish *f)
{
    const rl_ab_run *r = f->run;
    rl_experiment_cost cost;
    rl_str out = {0};
    rl_experiment_cost_of(r->experiment, &cost);
    if (f->report.summary)
        rl_str_printf(&out, "%s\n", f->report.summary);
    if (r->frames) {
        rl_str_add(&out, "\n");
        rl_ab_table(&f->report, &out);
        rl_str_add(&out, "\n");
    }
    rl_ab_fail_print(&f->report, &out);
    rl_cost_sentence(&cost, r->plan.n_variants, &out);
    if (r->plan.n_variants > r->plan.n_listed)
        rl_str_printf(&out, ", %zu of them for chance alone", r->plan.n_variants - r->plan.n_listed);
    rl_str_add(&out, "\n");
    if (f->page)
        rl_str_printf(&out, "%s/%s\n", r->out, page_name);
    if (f->sheet)
        rl_str_printf(&out, "%s\n", r->sheet_path);
    rl_code code = out.failed ? rl_fail_memory(f->err, out.length)
                              : rl_report_result(r->tool->report, rl_str_text(&out), f->err);
    rl_str_free(&out);
    return code;
}

/* The last line of --json: where everything is. */
static rl_code print_json(const finish *f)
{
    const rl_ab_run *r = f->run;
    rl_str out = {0};
    rl_str_add(&out, "{\"summary\": ");
    rl_ab_json_text(&out, f->report.summary ? f->report.summary : "");
    rl_str_printf(&out, ", \"over\": %zu, \"out\": ", rl_ab_fail_count(&f->report));
    rl_ab_json_text(&out, r->out);
    rl_str_add(&out, ", \"sheet\": ");
    if (f->sheet)
        rl_ab_json_text(&out, r->sheet_path);
    else
        rl_str_add(&out, "null");
    rl_str_add(&out, "}\n");
    rl_code code = out.failed ? rl_fail_memory(f->err, out.length)
                              : rl_report_result(r->tool->report, rl_str_text(&out), f->err);
    rl_str_free(&out);
    return code;
}

void rl_ab_clean(rl_ab_run *r)
{
    const char *const names[] = {metrics_name, junit_name, page_name}, *paths[4];
    size_t n = 0;
    for (size_t i = 0; i < 3; i++) {
        paths[n] = rl_path_join(r->tool->arena, r->out, names[i]);
        n += paths[n] != NULL;
    }
    if (r->sheet_path)
        paths[n++] = r->sheet_path;
    rl_leftovers_remove(paths, n);
}

/* What cannot be written does not keep the rest from being; the first error is told. */
rl_code rl_ab_finish(rl_ab_run *r, double seconds, size_t *over, rl_error *err)
{
    finish f = {.run = r, .err = err};
    rl_code code = rl_ab_measure_results(r->measure, &f.results, err);
    f.report = (rl_ab_report){.command = r->tool->command,
                              .plan = &r->plan,
                              .experiment = r->experiment,
                              .results = &f.results,
                              .energy = &r->energy,
                              .failures = r->failures,
                              .n_failures = r->n_failures,
                              .frames = r->frames,
                              .seconds = seconds};
    if (code)
        return code;
    check_thresholds(&f);
    make_summary(&f);
    f.page = !write_metrics(&f) && !write_page(&f);
    write_junit(&f);
    f.sheet = r->sheet && !rl_ab_sheet_write(r->sheet, r->sheet_path, err);
    if (r->tool->report->json)
        print_json(&f);
    else
        print_text(&f);
    *over = rl_ab_fail_count(&f.report);
    rl_str_free(&f.metrics);
    return err->code;
}
