/* `relit plan`: the plan of each capture, as text, graphviz, drawn, or JSON. */
#include <string.h>

#include "graph/base/file.h"
#include "graph/tool/ab_open.h"
#include "graph/tool/plan_page.h"
#include "graph/tool/plan_variants.h"
#include "graph/tool/shard.h"
#include "graph/tool/svg.h"
#include "graph/tool/tool.h"

static rl_code print_capture(const rl_session *session, size_t capture, rl_plan_word word,
                             const rl_options *options, rl_str *out, rl_error *err)
{
    static const rl_plan_format formats[] = {RL_PLAN_TEXT, RL_PLAN_DOT, RL_PLAN_DOT, RL_PLAN_JSON,
                                             RL_PLAN_JSON};
    char *text = NULL;
    rl_code code = rl_session_plan(session, capture, formats[word], &text, err);
    if (!code && word == RL_WORD_SVG)
        code = rl_svg_from_dot(text, out, err);
    else if (!code && word == RL_WORD_JSON && options->shard[1])
        code = rl_shard_json(session, capture, options, text, out, err);
    else if (!code)
        rl_str_add(out, text);
    if (!code && word == RL_WORD_TEXT && options->shard[1])
        rl_shard_print(session, capture, options, out);
    if (!code && out->length && out->text[out->length - 1] != '\n')
        rl_str_add(out, "\n");
    rl_text_free(text);
    return code;
}

/* The page is made of what JSON says; `text` becomes the page. */
static rl_code make_page(const rl_tool *tool, rl_plan_word word, rl_str *text, rl_error *err)
{
    rl_str page = {0};
    if (word != RL_WORD_HTML)
        return RL_OK;
    rl_code code = text->failed ? rl_fail_memory(err, text->length) : RL_OK;
    if (!code)
        code =
            rl_plan_page(rl_path_name(tool->args.operand), rl_str_text(text), tool->args.trace, &page, err);
    rl_str_free(text);
    *text = page;
    return code;
}

/* Several pipelines, or several values: what their runs would share. */
static int plan_variants(rl_tool *tool, rl_plan_word word, rl_error *err)
{
    rl_arguments args = tool->args;
    rl_ab_plan plan;
    rl_experiment *experiment = NULL;
    rl_str text = {0};
    int status = RL_EXIT_WRONG;

    args.seeds = 1; /* `relit ab` adds runs with other seeds; these are not variants */
    if (rl_ab_plan_make(tool->arena, &args, &tool->report->log, &plan, err) ||
        rl_ab_open(&plan, &tool->args.run, &experiment, err) ||
        rl_plan_variants_print(&plan, experiment, word == RL_WORD_HTML ? RL_WORD_JSON : word, &text, err) ||
        make_page(tool, word, &text, err))
        goto done;
    status = rl_tool_print(tool, &text, err);
done:
    rl_str_free(&text);
    rl_experiment_close(&experiment);
    return status;
}

/* Text: one after the other. JSON: an object a line and capture. A drawing is one file: of the first. */
int rl_cmd_plan(rl_tool *tool, rl_error *err)
{
    rl_session *session = NULL;
    rl_str text = {0};
    rl_plan_word word = tool->args.json ? RL_WORD_JSON : (rl_plan_word)tool->args.format;
    int status = RL_EXIT_WRONG;

    if (tool->args.json && tool->args.format != RL_WORD_TEXT && tool->args.format != RL_WORD_JSON) {
        rl_fail_file(err, RL_E_USAGE, "relit plan", "--json and --format exclude each other");
        goto done;
    }
    if (tool->args.trace && word != RL_WORD_HTML) {
        rl_fail_file(err, RL_E_USAGE, "relit plan", "--trace is for --format html, which shows its times");
        goto done;
    }
    if (tool->args.n_operands > 1 || tool->args.n_vary)
        return plan_variants(tool, word, err);
    if (rl_session_open(&tool->args.run, &session, err))
        goto done;
    size_t n = rl_session_captures(session);
    bool drawing = word == RL_WORD_SVG || word == RL_WORD_DOT;
    for (size_t i = 0; i < (drawing && n ? 1 : n); i++) {
        if (word == RL_WORD_TEXT && n > 1)
            rl_str_printf(&text, "%scapture '%s'\n", i ? "\n" : "", rl_session_capture_name(session, i));
        if (print_capture(session, i, word, &tool->args.run, &text, err))
            goto done;
    }
    if (drawing && n > 1)
        rl_report(&tool->report->log, RL_NOTE, RL_NOWHERE,
                  "the drawing is of the first capture, '%s'; --capture chooses another",
                  rl_session_capture_name(session, 0));
    if (make_page(tool, word, &text, err))
        goto done;
    status = rl_tool_print(tool, &text, err);
done:
    rl_str_free(&text);
    rl_session_close(&session);
    return status;
}
