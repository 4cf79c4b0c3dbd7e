#include "graph/tool/markdown.h"

#include <stdbool.h>
#include <string.h>

#include "graph/model/graph.h"
#include "graph/model/params.h"

static const char *const role_names[] = {"in", "out", "history", "scratch", "sums"};

/* Text as a table's cell holds it: a bar would end the cell, and <, > and * mean something to Markdown. */
static void add_cell(rl_str *out, const char *text)
{
    for (; *text; text++) {
        if (strchr("|<>*", *text))
            rl_str_add(out, "\\");
        rl_str_printf(out, "%c", *text);
    }
}

static void add_port_names(const rl_pass *pass, rl_role role, rl_str *out)
{
    bool first = true;
    for (int optional = 0; optional < 2; optional++) {
        bool open = false;
        for (size_t i = 0; i < pass->ports.n; i++) {
            const rl_port *p = &pass->ports.rows[i];
            if (p->role != role || p->optional != (optional == 1))
                continue;
            rl_str_printf(out, "%s%s%s", first ? "" : " ", optional && !open ? "\\[" : "", p->name);
            open = optional == 1;
            first = false;
        }
        if (open)
            rl_str_add(out, "\\]");
    }
}

void rl_markdown_list(rl_str *out)
{
    rl_str_add(out, "| pass | what | in \\[optional\\] | out | source |\n| --- | --- | --- | --- | --- |\n");
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *pass = rl_pass_at(i);
        rl_str_printf(out, "| [`%s`](#%s) | ", pass->name, pass->name);
        add_cell(out, pass->help);
        rl_str_add(out, " | ");
        add_port_names(pass, RL_READ, out);
        rl_str_add(out, " | ");
        add_port_names(pass, RL_WRITE, out);
        rl_str_add(out, " | ");
        add_cell(out, pass->source ? pass->source : "");
        rl_str_add(out, " |\n");
    }
}

static void add_ports(const rl_pass *pass, rl_str *out)
{
    rl_str_add(out, "| port | | type | what |\n| --- | --- | --- | --- |\n");
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *p = &pass->ports.rows[i];
        if (p->role == RL_SCRATCH)
            continue;
        rl_str_printf(out, "| `%s` | %s%s | %s | ", p->name, role_names[p->role],
                      p->optional ? ", optional" : "", rl_format_name(p->format));
        add_cell(out, p->help);
        if (p->role == RL_HISTORY)
            rl_str_printf(out, ": `%s`, one frame before", p->of);
        rl_str_add(out, " |\n");
    }
}

/* In which other terms the value of a row may be given. */
static void add_forms(const rl_param *row, rl_str *out)
{
    for (size_t i = 0; i < row->forms.n; i++) {
        const rl_form *form = &row->forms.rows[i];
        rl_str_printf(out, "| … `%s: %s` | ", row->form_row, form->word);
        add_cell(out, form->formula);
        rl_str_printf(out, " | needs `%s`%s%s%s | ", form->from[0], form->from[1] ? ", `" : "",
                      form->from[1] ? form->from[1] : "", form->from[1] ? "`" : "");
        add_cell(out, form->source);
        rl_str_add(out, " |\n");
    }
}

/* `list`: the row of the list that these are the keys of, or NULL. */
static void add_rows(rl_params rows, const rl_param *list, rl_str *out)
{
    for (size_t i = 0; i < rows.n; i++) {
        const rl_param *row = &rows.rows[i];
        rl_str values = {0};
        rl_param_describe(row, &values);
        rl_str_printf(out, "| `%s%s%s` | ", list ? list->name : "", list ? "[]." : "", row->name);
        add_cell(out, row->help);
        rl_str_add(out, " | ");
        add_cell(out, rl_str_text(&values));
        rl_str_add(out, " | ");
        add_cell(out, row->source ? row->source : "");
        rl_str_add(out, " |\n");
        out->failed = out->failed || values.failed;
        rl_str_free(&values);
        add_forms(row, out);
        add_rows(row->list, row, out);
    }
}

static void add_table(const char *title, const char *where, rl_params rows, rl_str *out)
{
    if (!rows.n)
        return;
    rl_str_printf(out, "\n| %s, `%s` | what | values | source |\n| --- | --- | --- | --- |\n", title, where);
    add_rows(rows, NULL, out);
}

void rl_markdown_pass(const rl_pass *pass, rl_str *out)
{
    add_ports(pass, out);
    add_table("parameter", "graph.NODE.…", pass->params, out);
    add_table("profile key", "profiles.NAME.…", pass->profile_keys, out);
    add_table("material key", "materials.NAME.…", pass->material_keys, out);
    add_table("shading key", "shading.…", pass->shading_keys, out);
}
