/* Profiles, shading and materials, from their maps to the table. */
#include "graph/model/materials_forms.h"
#include "graph/model/materials_ids.h"
#include "graph/model/params_list.h"

#include <string.h>

typedef struct reader {
    rl_arena *arena;
    const rl_value *profiles, *shading, *materials;
    const rl_pass *const *used;
    size_t n_used;
    const rl_log *log;
    rl_materials *m;
    char *data; /* m->data, while it is made */
    rl_id_list ids;
    rl_error *err;
} reader;

/* ---- rows
 * ---------------------------------------------------------------------------------------------------- */

static const rl_material_row *find_row(const reader *r, const char *group, const char *key)
{
    for (size_t i = 0; i < r->m->n_rows; i++)
        if (!strcmp(r->m->rows[i].group, group) && !strcmp(r->m->rows[i].param->name, key))
            return &r->m->rows[i];
    return NULL;
}

/* Adds the keys of a group to names[]; returns how many names there are now. */
static size_t list_group(const reader *r, const char *group, const char **names, size_t n)
{
    for (size_t i = 0; i < r->m->n_rows; i++)
        if (!strcmp(r->m->rows[i].group, group))
            names[n++] = r->m->rows[i].param->name;
    return n;
}

/* `section` is "profile", "shading" or "material"; a key of another section is told where it belongs. */
static rl_code unknown_key(reader *r, const rl_entry *entry, const char *section, const char *name)
{
    const char **known = rl_arena_array(r->arena, r->m->n_rows + 2, sizeof *known);
    if (!known)
        return rl_fail_memory(r->err, 0);
    bool material = !strcmp(section, "material");
    size_t n = 0;
    if (material) {
        known[n++] = "profile";
        known[n++] = "stencil";
        n = list_group(r, "material", known, n);
        for (size_t i = 0; i < r->m->n_rows; i++) /* shading keys that have no material key of their name */
            if (!strcmp(r->m->rows[i].group, "shading") &&
                !find_row(r, "material", r->m->rows[i].param->name))
                known[n++] = r->m->rows[i].param->name;
    } else {
        n = list_group(r, section, known, n);
    }
    const char *other = find_row(r, "profile", entry->key)    ? "; it is a key of profiles"
                        : find_row(r, "material", entry->key) ? "; it is a key of materials"
                        : find_row(r, "shading", entry->key)  ? "; it is a key of shading"
                                                              : "";
    char *text =
        name ? rl_arena_printf(r->arena, "%s '%s' has no key '%s'%s", section, name, entry->key, other)
             : rl_arena_printf(r->arena, "%s has no key '%s'%s", section, entry->key, other);
    return rl_fail_suggest(r->err, entry->where, text, entry->key, known, n);
}

static rl_code need_map(reader *r, const rl_value *v, const char *name)
{
    return v && v->kind != RL_MAP ? rl_value_wrong(v, name, "a map", r->err) : RL_OK;
}

static char *entry_at(const reader *r, size_t material)
{
    return r->data + material * r->m->entry_bytes;
}

static bool reads(const rl_pass *pass, const char *key)
{
    for (size_t i = 0; i < pass->profile_keys.n; i++)
        if (!strcmp(pass->profile_keys.rows[i].name, key))
            return true;
    return false;
}

static bool any_reads(const reader *r, const char *key)
{
    for (size_t i = 0; i < r->n_used; i++)
        if (reads(r->used[i], key))
            return true;
    return false;
}

static rl_code read_value(const reader *r, const rl_param *row, const rl_value *v, char *out)
{
    if (row->type == RL_ROWS && !any_reads(r, row->name))
        return rl_list_read(row, v, out, r->err);
    return rl_param_read(row, v, out, r->err);
}

/* Reads a whole map of one group into an entry. */
static rl_code read_group(reader *r, const rl_value *map, const char *section, const char *name, char *entry)
{
    rl_code code = need_map(r, map, name ? name : section);
    for (size_t i = 0; !code && map && i < map->n; i++) {
        const rl_material_row *row = find_row(r, section, map->entries[i].key);
        code = row ? read_value(r, row->param, map->entries[i].value, entry + row->offset)
                   : unknown_key(r, &map->entries[i], section, name);
    }
    return code;
}

/* ---- profiles
 * ------------------------------------------------------------------------------------------------ */

static void note_unread(const reader *r, const rl_value *profile, const char *name)
{
    for (size_t i = 0; i < profile->n; i++)
        if (!any_reads(r, profile->entries[i].key))
            rl_report(r->log, RL_VERBOSE, profile->entries[i].where,
                      "profile '%s': no pass of the graph reads '%s'", name, profile->entries[i].key);
}

/* Whether the profile in `entry` has what makes the row required: "KEY=a|b". */
static bool asks_for(const reader *r, const char *required_with, const char *entry)
{
    const char *words = required_with ? strchr(required_with, '=') : NULL;
    for (size_t i = 0; words && i < r->m->n_rows; i++) {
        const rl_material_row *row = &r->m->rows[i];
        size_t n = (size_t)(words - required_with);
        if (!strcmp(row->group, "profile") && !strncmp(row->param->name, required_with, n) &&
            !row->param->name[n])
            return rl_param_is(row->param, entry + row->offset, words + 1);
    }
    return false;
}

/* What the graph's passes cannot do without. */
static rl_code check_required(reader *r, const rl_value *profile, const char *name, const char *entry,
                              rl_where where)
{
    for (size_t i = 0; i < r->n_used; i++) {
        for (size_t k = 0; k < r->used[i]->profile_keys.n; k++) {
            const rl_param *row = &r->used[i]->profile_keys.rows[k];
            bool asked = asks_for(r, row->required_with, entry);
            if ((row->required || asked) && !rl_value_get(profile, row->name) &&
                !rl_forms_derived(r->m, row, entry))
                return rl_fail(r->err, RL_E_CONFIG, where, "profile '%s' needs '%s' for pass %s%s%s%s: %s",
                               name, row->name, r->used[i]->name, asked ? " (" : "",
                               asked ? row->required_with : "", asked ? ")" : "", row->help);
        }
    }
    return RL_OK;
}

/* Profiles that no material uses are checked as well: a slip in one should not wait for its first use. */
static rl_code check_profiles(reader *r)
{
    rl_code code = need_map(r, r->profiles, "profiles");
    char *scratch = rl_arena_alloc(r->arena, r->m->entry_bytes);
    if (!scratch)
        return rl_fail_memory(r->err, r->m->entry_bytes);
    for (size_t i = 0; !code && r->profiles && i < r->profiles->n; i++) {
        const rl_entry *profile = &r->profiles->entries[i];
        for (size_t k = 0; k < r->m->n_rows; k++)
            rl_param_default(r->m->rows[k].param, scratch + r->m->rows[k].offset);
        code = read_group(r, profile->value, "profile", profile->key, scratch);
        if (!code)
            code = rl_forms_apply(r->m, profile->value, profile->key, scratch, r->err);
    }
    return code;
}

static rl_code unknown_profile(reader *r, const rl_value *v)
{
    size_t n = r->profiles ? r->profiles->n : 0;
    const char **known = rl_arena_array(r->arena, n, sizeof *known);
    if (!known)
        return rl_fail_memory(r->err, n * sizeof *known);
    for (size_t i = 0; i < n; i++)
        known[i] = r->profiles->entries[i].key;
    return rl_fail_suggest(r->err, v->where, rl_arena_printf(r->arena, "there is no profile '%s'", v->text),
                           v->text, known, n);
}

static rl_code read_profile(reader *r, unsigned dense, const rl_value *v)
{
    const rl_value *profile = v;
    const char *name = r->m->names[dense];
    rl_where where = v->where;
    if (v->kind == RL_TEXT) {
        profile = NULL;
        for (size_t i = 0; !profile && r->profiles && i < r->profiles->n; i++) {
            if (!strcmp(r->profiles->entries[i].key, v->text)) {
                profile = r->profiles->entries[i].value;
                where = r->profiles->entries[i].where;
            }
        }
        name = v->text;
        if (!profile)
            return unknown_profile(r, v);
    } else if (v->kind != RL_MAP) {
        return rl_value_wrong(v, "profile", "the name of a profile, or a profile's map", r->err);
    }
    rl_code code = read_group(r, profile, "profile", name, entry_at(r, dense));
    if (!code)
        code = rl_forms_apply(r->m, profile, name, entry_at(r, dense), r->err);
    if (!code)
        code = check_required(r, profile, name, entry_at(r, dense), where);
    if (code)
        return code;
    note_unread(r, profile, name);
    r->m->profiles[dense] = name;
    int32_t yes = 1;
    memcpy(entry_at(r, dense), &yes, sizeof yes);
    return RL_OK;
}

/* ---- materials
 * ----------------------------------------------------------------------------------------------- */

static bool takes(const rl_param *row, rl_kind kind)
{
    switch (row->type) {
    case RL_F32:
        return kind == RL_NUMBER;
    case RL_RGBF:
        return kind == RL_NUMBER || kind == RL_LIST;
    case RL_I32:
        return kind == RL_NUMBER || (kind == RL_TEXT && row->words);
    case RL_BOOL:
        return kind == RL_TRUTH;
    case RL_ENUM:
        return kind == RL_TEXT;
    case RL_ROWS:
        return kind == RL_LIST;
    case RL_MATERIALS:
        return false;
    }
    return false;
}

static rl_code read_material_key(reader *r, unsigned dense, const rl_entry *entry)
{
    if (!strcmp(entry->key, "profile"))
        return read_profile(r, dense, entry->value);
    if (!strcmp(entry->key, "stencil"))
        return RL_OK; /* rl_ids_read */
    const rl_material_row *own = find_row(r, "material", entry->key),
                          *shading = find_row(r, "shading", entry->key);
    if (!own && !shading)
        return unknown_key(r, entry, "material", r->m->names[dense]);
    const rl_material_row *row = own;
    if (!own ||
        (shading && !takes(own->param, entry->value->kind) && takes(shading->param, entry->value->kind)))
        row = shading;
    return rl_param_read(row->param, entry->value, entry_at(r, dense) + row->offset, r->err);
}

static rl_code read_material(reader *r, unsigned dense, const rl_entry *entry)
{
    rl_code code = need_map(r, entry->value, entry->key);
    for (size_t i = 0; !code && i < entry->value->n; i++)
        code = read_material_key(r, dense, &entry->value->entries[i]);
    return code ? code : rl_ids_read(&r->ids, r->m, dense, entry, r->err);
}

static rl_code make_table(reader *r)
{
    rl_materials *m = r->m;
    m->count = 1 + (r->materials ? r->materials->n : 0);
    m->names = rl_arena_array(r->arena, m->count, sizeof *m->names);
    m->profiles = rl_arena_array(r->arena, m->count, sizeof *m->profiles);
    m->data = r->data = rl_arena_array(r->arena, m->count, m->entry_bytes);
    if (!m->names || !m->profiles || !r->data)
        return rl_fail_memory(r->err, m->count * m->entry_bytes);
    m->names[0] = "";
    for (size_t i = 1; i < m->count; i++)
        m->names[i] = r->materials->entries[i - 1].key;
    /* Every entry starts with the defaults and the pipeline's shading, the empty one as well. */
    for (size_t k = 0; k < m->n_rows; k++)
        rl_param_default(m->rows[k].param, r->data + m->rows[k].offset);
    rl_code code = read_group(r, r->shading, "shading", NULL, r->data);
    for (size_t i = 1; !code && i < m->count; i++)
        memcpy(entry_at(r, i), r->data, m->entry_bytes);
    return code;
}

rl_code rl_materials_resolve_from(const rl_registry *registry, rl_arena *arena, const rl_value *profiles,
                                  const rl_value *shading, const rl_value *materials,
                                  const rl_stencil_name *names, size_t n_names, const rl_pass *const *used,
                                  size_t n_used, const rl_log *log, const rl_materials **out, rl_error *err)
{
    rl_materials *m = rl_arena_alloc(arena, sizeof *m);
    if (!m)
        return rl_fail_memory(err, sizeof *m);
    reader r = {.arena = arena,
                .profiles = profiles,
                .shading = shading,
                .materials = materials,
                .used = used,
                .n_used = n_used,
                .log = log,
                .m = m,
                .ids = {.arena = arena, .log = log, .names = names, .n_names = n_names},
                .err = err};
    rl_code code = rl_material_rows(arena, registry, &m->rows, &m->n_rows, &m->entry_bytes, err);
    if (!code)
        code = need_map(&r, materials, "materials");
    if (!code)
        code = check_profiles(&r);
    if (!code)
        code = make_table(&r);
    for (unsigned i = 1; !code && i < m->count; i++)
        code = read_material(&r, i, &materials->entries[i - 1]);
    if (!code)
        code = rl_ids_finish(&r.ids, m, err);
    if (!code)
        *out = m;
    return code;
}

rl_code rl_materials_resolve(rl_arena *arena, const rl_value *profiles, const rl_value *shading,
                             const rl_value *materials, const rl_stencil_name *names, size_t n_names,
                             const rl_pass *const *used, size_t n_used, const rl_log *log,
                             const rl_materials **out, rl_error *err)
{
    return rl_materials_resolve_from(rl_registry_all(), arena, profiles, shading, materials, names, n_names,
                                     used, n_used, log, out, err);
}
