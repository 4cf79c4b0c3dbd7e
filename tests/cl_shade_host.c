#include <string.h>

#include "graph/base/alloc.h"
#include "tests/cl_shade.h"
#include "tests/cl_shade_parts.h"

/* ---- images ----------------------------------------------------------------------------------------------
 */

static int floor_to(int x, int step)
{
    return x - ((x % step) + step) % step;
}

frame_t shade_frame(int w, int h, int x0, int y0)
{
    frame_t f;
    memset(&f, 0, sizeof f);
    f.origin[0] = floor_to(x0, 64);
    f.origin[1] = floor_to(y0, 4);
    f.valid[0] = x0 - f.origin[0];
    f.valid[1] = y0 - f.origin[1];
    f.valid[2] = f.valid[0] + w;
    f.valid[3] = f.valid[1] + h;
    f.columns = (f.valid[2] + 63) / 64 * 64;
    f.rows = (f.valid[3] + 3) / 4 * 4;
    f.stride = f.columns;
    f.plane = f.stride * f.rows;
    f.stride4 = f.columns / 4 + 2 * RL_MARGIN4;
    f.plane4 = 4 * f.rows * f.stride4;
    return f;
}

/* Room for either layout, and the guards. */
static size_t plane_room(const frame_t *f)
{
    return (size_t)(f->plane4 > f->plane ? f->plane4 : f->plane);
}

size_t shade_image_floats(const frame_t *f, int planes)
{
    return (size_t)planes * plane_room(f) + 2 * RL_GUARD;
}

shade_image shade_image_new(const frame_t *f, int planes)
{
    shade_image image = {planes, NULL};
    size_t bytes = shade_image_floats(f, planes) * sizeof(float);
    float *base = rl_aligned(bytes);
    if (base) {
        memset(base, 0, bytes);
        image.data = base + RL_GUARD;
    }
    return image;
}

void shade_image_free(shade_image *image)
{
    if (image->data)
        rl_free(image->data - RL_GUARD);
    image->data = NULL;
}

float *shade_at(const shade_image *image, const frame_t *f, int plane, int x, int y)
{
    return image->data + (ptrdiff_t)plane * f->plane + (ptrdiff_t)y * f->stride + x;
}

uint32_t shade_id(const shade_image *image, const frame_t *f, int x, int y)
{
    uint32_t id;
    memcpy(&id, shade_at(image, f, 0, x, y), sizeof id);
    return id;
}

void shade_set_id(const shade_image *image, const frame_t *f, int x, int y, uint32_t id)
{
    memcpy(shade_at(image, f, 0, x, y), &id, sizeof id);
}

/* ---- materials -------------------------------------------------------------------------------------------
 */

static const char *const groups[] = {"profile", "material", "shading"};

static const rl_params *group_rows(const rl_pass *pass, size_t group)
{
    const rl_params *const rows[] = {&pass->profile_keys, &pass->material_keys, &pass->shading_keys};
    return rows[group];
}

bool shade_each_row(const shade_materials *m, shade_visit *visit, void *ctx)
{
    const rl_param *seen[SHADE_WORDS];
    size_t word = 1;
    for (size_t g = 0; g < 3; g++) {
        size_t n_seen = 0;
        for (size_t p = 0; p < m->n_passes; p++) {
            const rl_params *rows = group_rows(m->passes[p], g);
            for (size_t r = 0; r < rows->n; r++) {
                bool again = false;
                for (size_t i = 0; i < n_seen; i++)
                    again |= strcmp(seen[i]->name, rows->rows[r].name) == 0;
                if (again)
                    continue;
                seen[n_seen++] = &rows->rows[r];
                if (visit(ctx, groups[g], &rows->rows[r], word))
                    return true;
                word += RL_PARAM_BYTES(rows->rows[r].type) / 4;
            }
        }
    }
    return false;
}

static uint32_t to_word(rl_type type, double value)
{
    uint32_t word;
    float real = (float)value;
    int32_t whole = (int32_t)value;
    if (type == RL_F32 || type == RL_RGBF)
        memcpy(&word, &real, 4);
    else
        memcpy(&word, &whole, 4);
    return word;
}

double shade_from_word(rl_type type, uint32_t word)
{
    float real;
    int32_t whole;
    memcpy(&real, &word, 4);
    memcpy(&whole, &word, 4);
    return type == RL_F32 || type == RL_RGBF ? (double)real : (double)whole;
}

static bool default_row(void *ctx, const char *group, const rl_param *row, size_t word)
{
    uint32_t *words = ctx;
    (void)group;
    for (size_t i = 0; i < RL_PARAM_BYTES(row->type) / 4; i++)
        words[word + i] = to_word(row->type, row->no_default ? -1 : row->def[i]);
    return false;
}

size_t shade_material_add(shade_materials *m, bool has_profile)
{
    if (m->n == 0)
        m->n = 1;
    shade_each_row(m, default_row, m->words[m->n]);
    m->words[m->n][0] = has_profile;
    return m->n++;
}

typedef struct row_search {
    const char *group, *key;
    rl_type type;
    size_t word;
} row_search;

static bool is_row(void *ctx, const char *group, const rl_param *row, size_t word)
{
    row_search *s = ctx;
    s->type = row->type;
    s->word = word;
    return strcmp(s->group, group) == 0 && strcmp(s->key, row->name) == 0;
}

bool shade_material_set(shade_materials *m, size_t entry, const char *group, const char *key, const double *v)
{
    row_search s = {.group = group, .key = key};
    if (!shade_each_row(m, is_row, &s))
        return false;
    for (size_t i = 0; i < RL_PARAM_BYTES(s.type) / 4; i++)
        m->words[entry][s.word + i] = to_word(s.type, v[i]);
    return true;
}

bool shade_material_get(const shade_materials *m, size_t entry, const char *group, const char *key, double *v)
{
    row_search s = {.group = group, .key = key};
    if (!shade_each_row(m, is_row, &s))
        return false;
    for (size_t i = 0; i < RL_PARAM_BYTES(s.type) / 4; i++)
        v[i] = shade_from_word(s.type, m->words[entry][s.word + i]);
    return true;
}

void shade_params_default(const rl_pass *pass, void *params)
{
    for (size_t r = 0; r < pass->params.n; r++) {
        const rl_param *row = &pass->params.rows[r];
        for (size_t i = 0; i < RL_PARAM_BYTES(row->type) / 4; i++) {
            uint32_t word = row->type == RL_MATERIALS ? 0 : to_word(row->type, row->def[i]);
            memcpy((char *)params + row->offset + 4 * i, &word, 4);
        }
    }
}

double shade_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}
