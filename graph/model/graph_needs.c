/* Ports that a material makes necessary. */
#include <string.h>

#include "graph/model/graph.h"

/* Index of `word` in "a|b|c", or -1. */
static int word_index(const char *words, const char *word)
{
    size_t length = strlen(word);
    for (int i = 0; words; i++) {
        if (!strncmp(words, word, length) && (words[length] == '|' || !words[length]))
            return i;
        words = strchr(words, '|');
        words = words ? words + 1 : NULL;
    }
    return -1;
}

/* "key: word" as the shading row and the value that it asks for; false when the pass has no such row. */
static bool find_need(rl_arena *arena, const rl_pass *pass, const char *need, const char **key, int *value)
{
    char *text = rl_arena_strdup(arena, need), *colon = text ? strstr(text, ": ") : NULL;
    if (!colon)
        return false;
    *colon = 0;
    *key = text;
    for (size_t i = 0; i < pass->shading_keys.n; i++) {
        const rl_param *row = &pass->shading_keys.rows[i];
        if (!strcmp(row->name, text)) {
            *value = word_index(row->words, colon + 2);
            return *value >= 0;
        }
    }
    return false;
}

/* Index of the first material that asks for it, 0 = none. */
static size_t who_needs(const rl_materials *m, const char *key, int value)
{
    for (size_t i = 1; i < m->count; i++) {
        double v[3] = {-1};
        if (rl_material_has_profile(m, i) && rl_material_get(m, i, "shading", key, v) && (int)v[0] == value)
            return i;
    }
    return 0;
}

rl_code rl_graph_check_needs(rl_arena *arena, const rl_graph *graph, const rl_materials *materials,
                             rl_error *err)
{
    for (size_t n = 0; n < graph->n_nodes; n++) {
        const rl_graph_node *node = &graph->nodes[n];
        for (size_t p = 0; p < node->pass->ports.n; p++) {
            const rl_port *port = &node->pass->ports.rows[p];
            const char *key = NULL;
            int value = -1;
            if (!port->needed_by || node->images[p] >= 0)
                continue;
            if (!find_need(arena, node->pass, port->needed_by, &key, &value))
                return rl_fail(err, RL_E_INTERNAL, node->where,
                               "pass %s: port '%s' is needed by '%s', which is no word of a shading key",
                               node->pass->name, port->name, port->needed_by);
            size_t material = who_needs(materials, key, value);
            if (material)
                return rl_fail(err, RL_E_CONFIG, node->where,
                               "pass '%s' (%s): port '%s' needs an image (%s), since material '%s' has '%s': "
                               "name one in `in:` or "
                               "give the capture a layer '%s'",
                               node->name, node->pass->name, port->name, rl_format_name(port->format),
                               materials->names[material], port->needed_by, port->name);
        }
    }
    return RL_OK;
}
