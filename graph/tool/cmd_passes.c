/* `relit passes`: the passes of this build, printed from their tables. */
#include <string.h>

#include "graph/model/graph.h"
#include "graph/model/params.h"
#include "graph/tool/json_print.h"
#include "graph/tool/markdown.h"
#include "graph/tool/tool.h"

static const char *const role_names[] = {"in", "out", "history", "scratch", "sums"};
static const char *const type_names[] = {"number", "integer", "true|false", "word",
                                         "rgb",    "list",    "materials"};

/* `pass: kernel` has no table: its ports and parameters are the user's. A test runs the example. */
static const char kernel_name[] = "kernel";
static const char kernel_help[] = "a program of your own: ports and parameters declared in the pipeline";
static const char kernel_keys[] =
    "\nkeys\n"
    "  file    the .cl file, relative to the pipeline\n"
    "  entry   the kernel function in it\n"
    "  items   what a work-item computes: pixel (default), vector or phase\n"
    "  ports   name: {role: read|write|history|scratch,\n"
    "                 type: rgb|normal|vec2|scalar|id,\n"
    "                 optional: true, of: PORT, layout: linear|phase4, help: TEXT}\n"
    "  params  name: {type: float|int|bool|rgb|enum, value: DEFAULT,\n"
    "                 range: [MIN, MAX], unit: TEXT, words: [A, B], help: TEXT}\n"
    "\n"
    "The function's arguments are a buffer a port, in the order of the ports, then\n"
    "params_t (when there are parameters), frame_t and material_t, all constant.\n"
    "\n"
    "example, in the pipeline:\n"
    "  dim:\n"
    "    pass: kernel\n"
    "    file: dim.cl\n"
    "    entry: dim\n"
    "    ports: {color: {role: read, type: rgb}, out: {role: write, type: rgb}}\n"
    "    params: {amount: {type: float, value: 0.5, range: [0, 1], unit: ratio}}\n"
    "    in: {color: sss.color}\n"
    "    amount: 0.25\n"
    "example, in dim.cl:\n"
    "  kernel void dim(global const float *color, global float *out,\n"
    "                  constant params_t *p, constant frame_t *f,\n"
    "                  constant material_t *materials)\n"
    "  {\n"
    "      int at = rl_index(f, get_global_id(0), get_global_id(1));\n"
    "      for (int i = 0; i < 3; i++)\n"
    "          out[at + i * f->plane] = color[at + i * f->plane] * (1 - p->amount);\n"
    "  }\n";

/* ---- text ------------------------------------------------------------------------------------------------
 */

static void print_list(rl_str *out)
{
    size_t width = 0;
    for (size_t i = 0; i < rl_pass_count(); i++)
        width = strlen(rl_pass_at(i)->name) > width ? strlen(rl_pass_at(i)->name) : width;
    for (size_t i = 0; i < rl_pass_count(); i++)
        rl_str_printf(out, "%-*s  %s\n", (int)width, rl_pass_at(i)->name, rl_pass_at(i)->help);
    rl_str_printf(out, "%-*s  %s\n", (int)width, kernel_name, kernel_help);
    rl_str_add(out, "\n`relit passes NAME` prints a pass's ports and parameters.\n");
}

static size_t widest(const char *title, rl_params rows)
{
    size_t width = strlen(title);
    for (size_t i = 0; i < rows.n; i++)
        width = strlen(rows.rows[i].name) > width ? strlen(rows.rows[i].name) : width;
    return width;
}

static void print_ports(const rl_pass *pass, rl_str *out)
{
    size_t width = 0;
    for (size_t i = 0; i < pass->ports.n; i++)
        width = strlen(pass->ports.rows[i].name) > width ? strlen(pass->ports.rows[i].name) : width;
    rl_str_add(out, "\nports\n");
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *p = &pass->ports.rows[i];
        if (p->role == RL_SCRATCH)
            continue;
        rl_str_printf(out, "  %-7s  %-*s  %-6s  %s", role_names[p->role], (int)width, p->name,
                      rl_format_name(p->format), p->help);
        if (p->optional)
            rl_str_add(out, " (optional)");
        if (p->role == RL_HISTORY)
            rl_str_printf(out, " (of '%s', one frame before)", p->of);
        rl_str_add(out, "\n");
    }
}

/* In which other terms the value of a row may be given. */
static void print_forms(const rl_param *row, int indent, rl_str *out)
{
    for (size_t i = 0; i < row->forms.n; i++) {
        const rl_form *form = &row->forms.rows[i];
        rl_str_printf(out, "%*s%s: %s needs %s%s%s: %s; %s\n", indent, "", row->form_row, form->word,
                      form->from[0], form->from[1] ? ", " : "", form->from[1] ? form->from[1] : "",
                      form->formula, form->source);
    }
}

/* `indent` columns from the left; the keys of a list below it. */
static void print_each(rl_params rows, int indent, rl_str *out)
{
    int width = (int)widest("", rows);
    for (size_t i = 0; i < rows.n; i++) {
        const rl_param *row = &rows.rows[i];
        rl_str_printf(out, "%*s%-*s  %s%s\n%*s    ", indent, "", width, row->name, row->help,
                      row->required ? " (required)" : "", indent + width, "");
        rl_param_describe(row, out);
        if (row->source)
            rl_str_printf(out, "; %s", row->source);
        rl_str_add(out, "\n");
        print_forms(row, indent + width + 4, out);
        if (row->list.n)
            print_each(row->list, indent + width + 6, out);
    }
}

static void print_rows(const char *title, rl_params rows, rl_str *out)
{
    if (!rows.n)
        return;
    rl_str_printf(out, "\n%s\n", title);
    print_each(rows, 2, out);
}

static void print_pass(const rl_pass *pass, rl_str *out)
{
    rl_str_printf(out, "%s: %s\n", pass->name, pass->help);
    if (pass->source)
        rl_str_printf(out, "source: %s\n", pass->source);
    print_ports(pass, out);
    print_rows("parameters (graph.NODE.…)", pass->params, out);
    print_rows("profile keys (profiles.NAME.…)", pass->profile_keys, out);
    print_rows("material keys (materials.NAME.…)", pass->material_keys, out);
    print_rows("shading keys (shading.…, or in a material)", pass->shading_keys, out);
}

/* ---- JSON ------------------------------------------------------------------------------------------------
 */

static json_t *default_json(const rl_param *row)
{
    rl_str text = {0};
    union {
        float f[3];
        int32_t i, set[RL_SET_WORDS];
    } value = {.set = {0}};
    _Static_assert(sizeof value >= RL_PARAM_BYTES(RL_RGBF) && sizeof value >= RL_PARAM_BYTES(RL_MATERIALS),
                   "room for the largest value of a row");
    if (row->type == RL_ROWS) /* none of its own */
        return json_string("[]");
    rl_param_default(row, &value);
    rl_param_print(row, &value, &text);
    json_t *json = json_string(rl_str_text(&text));
    rl_str_free(&text);
    return json;
}

static json_t *forms_json(const rl_param *row)
{
    json_t *list = json_array();
    for (size_t i = 0; i < row->forms.n; i++) {
        const rl_form *form = &row->forms.rows[i];
        json_array_append_new(list, json_pack("{s:s, s:[s, s*], s:s, s:s}", row->form_row, form->word, "from",
                                              form->from[0], form->from[1], "formula", form->formula,
                                              "source", form->source));
    }
    return list;
}

static json_t *rows_json(rl_params rows)
{
    json_t *list = json_array();
    for (size_t i = 0; i < rows.n; i++) {
        const rl_param *row = &rows.rows[i];
        json_t *object =
            json_pack("{s:s, s:s, s:s, s:s, s:o, s:b, s:s*}", "name", row->name, "type",
                      type_names[row->type], "unit", row->unit ? row->unit : "", "help", row->help, "default",
                      default_json(row), "required", (int)row->required, "source", row->source);
        if (object && row->words)
            json_object_set_new(object, "words", json_string(row->words));
        if (object && row->type != RL_ENUM && row->type != RL_BOOL)
            json_object_set_new(object, "range", json_pack("[f, f]", row->min, row->max));
        if (object && row->forms.n)
            json_object_set_new(object, "forms", forms_json(row));
        if (object && row->list.n)
            json_object_set_new(object, "keys", rows_json(row->list));
        json_array_append_new(list, object);
    }
    return list;
}

static json_t *pass_json(const rl_pass *pass)
{
    json_t *ports = json_array();
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *p = &pass->ports.rows[i];
        if (p->role != RL_SCRATCH)
            json_array_append_new(ports,
                                  json_pack("{s:s, s:s, s:s, s:b, s:s, s:s*}", "name", p->name, "role",
                                            role_names[p->role], "format", rl_format_name(p->format),
                                            "optional", (int)p->optional, "help", p->help, "of", p->of));
    }
    return json_pack("{s:s, s:s, s:s*, s:o, s:o, s:o, s:o, s:o}", "name", pass->name, "help", pass->help,
                     "source", pass->source, "ports", ports, "parameters", rows_json(pass->params),
                     "profile_keys", rows_json(pass->profile_keys), "material_keys",
                     rows_json(pass->material_keys), "shading_keys", rows_json(pass->shading_keys));
}

/* Without a table, and in the shape of those that have one. */
static json_t *kernel_json(void)
{
    return json_pack("{s:s, s:s, s:[], s:[], s:[], s:[], s:[], s:s}", "name", kernel_name, "help",
                     kernel_help, "ports", "parameters", "profile_keys", "material_keys", "shading_keys",
                     "keys", kernel_keys + strlen("\nkeys\n"));
}

static void print_json(const rl_pass *pass, bool kernel, rl_str *out)
{
    json_t *json = kernel ? kernel_json() : pass ? pass_json(pass) : json_array();
    for (size_t i = 0; !pass && !kernel && i < rl_pass_count(); i++)
        json_array_append_new(json, pass_json(rl_pass_at(i)));
    if (!pass && !kernel)
        json_array_append_new(json, kernel_json());
    rl_json_print(json, JSON_INDENT(1) | JSON_REAL_PRECISION(9), out);
}

static rl_code unknown(const rl_tool *tool, rl_error *err)
{
    size_t n = rl_pass_count();
    const char **known = rl_arena_array(tool->arena, n + 1, sizeof *known);
    if (!known)
        return rl_fail_memory(err, n * sizeof *known);
    for (size_t i = 0; i < n; i++)
        known[i] = rl_pass_at(i)->name;
    rl_str text = {0};
    known[n] = kernel_name;
    rl_suggest(&text, tool->args.operand, known, n + 1, "known");
    rl_fail_file(err, RL_E_USAGE, "relit passes", "there is no pass '%s'%s", tool->args.operand,
                 rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

static void print_kernel(bool markdown, rl_str *out)
{
    if (markdown)
        rl_str_printf(out, "```%s```\n", kernel_keys);
    else
        rl_str_printf(out, "%s: %s\n%s", kernel_name, kernel_help, kernel_keys);
}

int rl_cmd_passes(rl_tool *tool, rl_error *err)
{
    const char *name = tool->args.operand;
    const rl_pass *pass = name ? rl_pass_find(name) : NULL;
    bool kernel = name && !strcmp(name, kernel_name), markdown = tool->args.markdown;
    rl_str text = {0};
    if (name && !pass && !kernel) {
        unknown(tool, err);
        return RL_EXIT_WRONG;
    }
    if (tool->args.json && markdown) {
        rl_fail_file(err, RL_E_USAGE, "relit passes", "--json and --markdown exclude each other");
        return RL_EXIT_WRONG;
    }
    if (tool->args.json)
        print_json(pass, kernel, &text);
    else if (kernel)
        print_kernel(markdown, &text);
    else if (markdown && pass)
        rl_markdown_pass(pass, &text);
    else if (markdown)
        rl_markdown_list(&text);
    else if (pass)
        print_pass(pass, &text);
    else
        print_list(&text);
    return rl_tool_print(tool, &text, err);
}
