/* The material table: its rows, and reading it. How it is filled from YAML is in materials_read.c. */
#include "graph/model/materials.h"

#include <stdlib.h>
#include <string.h>

/* ---- rows
 * ---------------------------------------------------------------------------------------------------- */

enum { GROUPS = 3 };
static const char *const group_names[GROUPS] = {"profile", "material", "shading"};

static rl_params group_rows(const rl_pass *pass, int group)
{
    return group == 0 ? pass->profile_keys : group == 1 ? pass->material_keys : pass->shading_keys;
}

static bool has_row(const rl_material_row *rows, size_t n, const char *group, const char *name)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(rows[i].group, group) && !strcmp(rows[i].param->name, name))
            return true;
    return false;
}

rl_code rl_material_rows(rl_arena *arena, const rl_registry *registry, const rl_material_row **out, size_t *n,
                         size_t *entry_bytes, rl_error *err)
{
    size_t most = 0, used = 0, bytes = sizeof(int32_t);
    for (size_t i = 0; i < registry->n; i++)
        for (int g = 0; g < GROUPS; g++)
            most += group_rows(registry->passes[i], g).n;
    rl_material_row *rows = rl_arena_array(arena, most, sizeof *rows);
    if (!rows)
        return rl_fail_memory(err, most * sizeof *rows);
    for (size_t i = 0; i < registry->n; i++) {
        for (int g = 0; g < GROUPS; g++) {
            rl_params declared = group_rows(registry->passes[i], g);
            for (size_t k = 0; k < declared.n; k++) {
                const rl_param *row = &declared.rows[k];
                if (has_row(rows, used, group_names[g], row->name))
                    continue;
                rows[used++] = (rl_material_row){group_names[g], row, bytes};
                bytes += rl_param_bytes(row);
            }
        }
    }
    *out = rows;
    *n = used;
    *entry_bytes = bytes;
    return RL_OK;
}

void rl_materials_struct_text_from(const rl_registry *registry, rl_str *s)
{
    rl_arena arena = {0};
    const rl_material_row *rows;
    size_t n, bytes;
    s->failed |= rl_material_rows(&arena, registry, &rows, &n, &bytes, NULL) != RL_OK;
    rl_str_add(s, "typedef struct material_t { int has_profile;");
    for (size_t i = 0; !s->failed && i < n; i++) {
        char prefix[16];
        strcat(strcpy(prefix, rows[i].group), "_");
        rl_str_add(s, " ");
        rl_param_field(rows[i].param, prefix, s);
    }
    rl_str_add(s, " } material_t;\n");
    rl_arena_free(&arena);
}

void rl_materials_struct_text(rl_str *s)
{
    rl_materials_struct_text_from(rl_registry_all(), s);
}

/* ---- as passes read them
 * ------------------------------------------------------------------------------------- */

size_t rl_material_count(const struct rl_materials *m)
{
    return m->count;
}

bool rl_material_has_profile(const struct rl_materials *m, size_t material)
{
    return material < m->count && m->profiles[material];
}

static void load(const rl_param *row, const char *at, double out[3])
{
    int32_t word;
    memcpy(&word, at, sizeof word);
    out[0] = word;
    if (row->type != RL_F32 && row->type != RL_RGBF)
        return;
    for (size_t i = 0; i < RL_PARAM_BYTES(row->type) / sizeof(float); i++) {
        float v;
        memcpy(&v, at + i * sizeof v, sizeof v);
        out[i] = (double)v;
    }
}

/* `rest` is what follows the list's name: ".0.weight". */
static bool load_element(const rl_param *row, const char *at, const char *rest, double out[3])
{
    double n[3];
    load(row, at, n);
    char *end;
    unsigned long i = strtoul(rest + 1, &end, 10);
    if (end == rest + 1 || *end != '.' || (double)i >= n[0])
        return false;
    for (size_t k = 0; k < row->list.n; k++) {
        if (!strcmp(row->list.rows[k].name, end + 1)) {
            load(&row->list.rows[k], rl_param_element(row, at, i, k), out);
            return true;
        }
    }
    return false;
}

bool rl_material_get(const struct rl_materials *m, size_t material, const char *group, const char *key,
                     double out[3])
{
    const rl_material_row *row = NULL;
    size_t length = strcspn(key, ".");
    for (size_t i = 0; i < m->n_rows && !row; i++)
        if (!strcmp(m->rows[i].group, group) && !strncmp(m->rows[i].param->name, key, length) &&
            !m->rows[i].param->name[length])
            row = &m->rows[i];
    if (!row || material >= m->count)
        return false;
    const char *at = (const char *)m->data + material * m->entry_bytes + row->offset;
    if (key[length])
        return row->param->type == RL_ROWS && load_element(row->param, at, key + length, out);
    load(row->param, at, out);
    return true;
}
