/* Profile rows whose value is given in other terms. */
#include "graph/model/materials_forms.h"

#include <string.h>

enum { MOST_FROM = sizeof((rl_form){0}.from) / sizeof(char *) };

static const rl_material_row *find_row(const rl_materials *m, const char *name)
{
    for (size_t i = 0; i < m->n_rows; i++)
        if (!strcmp(m->rows[i].group, "profile") && !strcmp(m->rows[i].param->name, name))
            return &m->rows[i];
    return NULL;
}

static bool uses(const rl_form *form, const char *name)
{
    for (int i = 0; i < MOST_FROM && form->from[i]; i++)
        if (!strcmp(form->from[i], name))
            return true;
    return false;
}

/* The form that the entry chooses, or NULL. */
static const rl_form *chosen(const rl_materials *m, const rl_param *row, const char *entry)
{
    const rl_material_row *by = find_row(m, row->form_row);
    for (size_t i = 0; by && i < row->forms.n; i++)
        if (rl_param_is(by->param, entry + by->offset, row->forms.rows[i].word))
            return &row->forms.rows[i];
    return NULL;
}

/* Numbers that another choice would read: they would be without effect, which nobody means. */
static rl_code check_others(const rl_param *row, const rl_form *form, const rl_value *profile,
                            const char *name, rl_error *err)
{
    for (size_t i = 0; i < row->forms.n; i++) {
        const rl_form *other = &row->forms.rows[i];
        for (int k = 0; k < MOST_FROM && other->from[k]; k++) {
            const rl_value *given = rl_value_get(profile, other->from[k]);
            if (given && !uses(form, other->from[k]))
                return rl_fail(err, RL_E_CONFIG, given->where,
                               "profile '%s': '%s: %s' has no use for '%s', which goes with '%s: %s' (or "
                               "null removes it)",
                               name, row->form_row, form->word, other->from[k], row->form_row, other->word);
        }
    }
    return RL_OK;
}

static rl_code check_given(const rl_materials *m, const rl_param *row, const rl_form *form,
                           const rl_value *profile, const char *name, rl_error *err)
{
    const rl_value *word = rl_value_get(profile, row->form_row);
    for (int k = 0; k < MOST_FROM && form->from[k]; k++)
        if (!rl_value_get(profile, form->from[k]))
            return rl_fail(err, RL_E_CONFIG, word ? word->where : profile->where,
                           "profile '%s': '%s: %s' needs '%s' (%s)", name, row->form_row, form->word,
                           form->from[k], find_row(m, form->from[k])->param->help);
    return RL_OK;
}

static float channel(const rl_material_row *row, const char *entry, size_t c)
{
    float v;
    memcpy(&v, entry + row->offset + (row->param->type == RL_RGBF ? c * sizeof v : 0), sizeof v);
    return v;
}

static rl_code derive(const rl_materials *m, const rl_material_row *row, const rl_form *form,
                      const rl_value *profile, const char *name, char *entry, rl_error *err)
{
    for (size_t c = 0; c < (row->param->type == RL_RGBF ? 3 : 1); c++) {
        double from[MOST_FROM] = {0};
        for (int k = 0; k < MOST_FROM && form->from[k]; k++)
            from[k] = (double)channel(find_row(m, form->from[k]), entry, c);
        double value = form->derive(from);
        if (!(value >= row->param->min && value <= row->param->max))
            return rl_fail(err, RL_E_CONFIG, rl_value_get(profile, form->from[0])->where,
                           "profile '%s': '%s' that follows from '%s: %s' is %g %s; expected %g … %g", name,
                           row->param->name, row->param->form_row, form->word, value, row->param->unit,
                           row->param->min, row->param->max);
        float narrow = (float)value;
        memcpy(entry + row->offset + c * sizeof narrow, &narrow, sizeof narrow);
    }
    return RL_OK;
}

rl_code rl_forms_apply(const rl_materials *m, const rl_value *profile, const char *name, char *entry,
                       rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < m->n_rows && !code; i++) {
        const rl_material_row *row = &m->rows[i];
        const rl_form *form = row->param->forms.n ? chosen(m, row->param, entry) : NULL;
        if (!form)
            continue;
        code = check_others(row->param, form, profile, name, err);
        if (!code && form->derive)
            code = check_given(m, row->param, form, profile, name, err);
        if (!code && form->derive)
            code = derive(m, row, form, profile, name, entry, err);
    }
    return code;
}

bool rl_forms_derived(const rl_materials *m, const rl_param *row, const char *entry)
{
    const rl_material_row *at = row->forms.n ? find_row(m, row->name) : NULL;
    return at && channel(at, entry, 0) >= 0;
}
