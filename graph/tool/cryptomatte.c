/* Cryptomatte 1.2.0 (Friedman and Jones): attributes cryptomatte/KEY/name, the layer, and
 * cryptomatte/KEY/manifest, an object of JSON: a name, and its hash as eight hexadecimal digits. */
#include "graph/tool/cryptomatte.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

/* Whether the channel is of the layer: "crypto_material" and "crypto_material00.R". */
static bool is_of(const char *channel, const char *layer)
{
    size_t n = strlen(layer);
    return n && !strncmp(channel, layer, n) && strspn(channel + n, "0123456789") == 2 &&
           channel[n + 2] == '.';
}

/* The text of the layer's manifest, or NULL. */
static const char *find_manifest(rl_arena *arena, const rl_exr *file, const char *channel)
{
    static const char head[] = "cryptomatte/", tail[] = "/name";
    for (int p = 0; p < rl_exr_parts(file); p++)
        for (size_t i = 0; i < rl_exr_part_at(file, p)->n_attrs; i++) {
            const char *name;
            rl_exr_value v;
            rl_exr_attr_at(file, p, i, &name, NULL, &v);
            size_t n = strlen(name);
            if (strncmp(name, head, strlen(head)) || n < strlen(tail) ||
                strcmp(name + n - strlen(tail), tail) || v.type != RL_EXR_T_STRING || !v.text ||
                !is_of(channel, v.text))
                continue;
            char *other = rl_arena_printf(arena, "%.*s/manifest", (int)(n - strlen(tail)), name);
            if (other && rl_exr_attr(file, p, other, &v) && v.type == RL_EXR_T_STRING)
                return v.text;
        }
    return NULL;
}

/* The name of an id in the manifest, or NULL. */
static const char *name_of(json_t *manifest, uint32_t id)
{
    const char *key;
    json_t *value;
    json_object_foreach(manifest, key, value)
    {
        const char *text = json_string_value(value);
        char *end;
        if (text && text[0] && strtoul(text, &end, 16) == id && !*end)
            return key;
    }
    return NULL;
}

rl_code rl_cryptomatte_names(rl_arena *arena, const rl_exr *file, const char *channel, const uint32_t *ids,
                             size_t n_ids, rl_stencil_label **out, size_t *n, rl_error *err)
{
    const char *text = find_manifest(arena, file, channel);
    json_t *manifest = text ? json_loads(text, 0, NULL) : NULL;
    rl_code code = RL_OK;
    *n = 0;
    *out = rl_arena_array(arena, n_ids + 1, sizeof **out);
    if (!*out)
        code = rl_fail_memory(err, n_ids * sizeof **out);
    for (size_t i = 0; !code && json_is_object(manifest) && i < n_ids; i++) {
        const char *name = name_of(manifest, ids[i]);
        if (!name)
            continue;
        (*out)[*n] = (rl_stencil_label){ids[i], rl_arena_strdup(arena, name)};
        if (!(*out)[(*n)++].name)
            code = rl_fail_memory(err, strlen(name));
    }
    json_decref(manifest);
    return code;
}
