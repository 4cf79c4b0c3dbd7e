/* Ports and profile keys that a material's shading makes necessary. */
#include <string.h>

#include "graph/model/graph.h"

typedef struct needs {
    rl_arena *arena;
    const rl_materials *materials;
    const rl_graph_node *node;
    rl_error *err;
} needs;

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

/* "key: word" as one of the rows and the value that it asks for. */
static rl_code find_word(const needs *n, rl_params rows, const char *name, const char *need, const char **key,
                         int *value)
{
    char *text = rl_arena_strdup(n->arena, need), *colon = text ? strstr(text, ": ") : NULL;
    if (!text)
        return rl_fail_memory(n->err, strlen(need));
    *value = -1;
    if (colon)
        *colon = 0;
    for (size_t i = 0; colon && i < rows.n; i++)
        if (!strcmp(rows.rows[i].name, text))
            *value = word_index(rows.rows[i].words, colon + 2);
    *key = text;
    return *value >= 0 ? RL_OK
                       : rl_fail(n->err, RL_E_INTERNAL, n->node->where,
                                 "pass %s: '%s' is needed by '%s', which is no word of its rows",
                                 n->node->pass->name, name, need);
}

static rl_code find_need(const needs *n, const char *name, const char *need, const char **key, int *value)
{
    return find_word(n, n->node->pass->shading_keys, name, need, key, value);
}

static bool asks(const rl_materials *m, size_t material, const char *key, int value)
{
    double v[3] = {-1};
    return rl_material_has_profile(m, material) && rl_material_get(m, material, "shading", key, v) &&
           (int)v[0] == value;
}

static rl_code check_port(const needs *n, const rl_port *port)
{
    const char *key;
    int value;
    rl_code code = find_need(n, port->name, port->needed_by, &key, &value);
    for (size_t i = 1; i < n->materials->count && !code; i++)
        if (asks(n->materials, i, key, value))
            code = rl_fail(n->err, RL_E_CONFIG, n->node->where,
                           "pass '%s' (%s): port '%s' needs an image (%s), since material '%s' has '%s': "
                           "name one in `in:` or give the "
                           "capture a layer '%s'",
                           n->node->name, n->node->pass->name, port->name, rl_format_name(port->format),
                           n->materials->names[i], port->needed_by, port->name);
    return code;
}

static bool gives(const rl_materials *m, size_t material, const char *key)
{
    double v[3] = {-1};
    return key && rl_material_get(m, material, "profile", key, v) && v[0] >= 0;
}

static rl_code check_row(const needs *n, const rl_param *row)
{
    const char *key;
    int value;
    rl_code code = find_need(n, row->name, row->needed_by, &key, &value);
    for (size_t i = 1; i < n->materials->count && !code; i++)
        if (asks(n->materials, i, key, value) && !gives(n->materials, i, row->name) &&
            !gives(n->materials, i, row->instead))
            code = rl_fail(n->err, RL_E_CONFIG, n->node->where,
                           "pass '%s' (%s): the profile of material '%s' needs '%s'%s%s%s, since it has '%s'",
                           n->node->name, n->node->pass->name, n->materials->names[i], row->name,
                           row->instead ? " or '" : "", row->instead ? row->instead : "",
                           row->instead ? "'" : "", row->needed_by);
    return code;
}

static bool has_row(rl_params rows, const char *name)
{
    for (size_t i = 0; i < rows.n; i++)
        if (!strcmp(rows.rows[i].name, name))
            return true;
    return false;
}

static bool has_pass(const rl_graph *graph, const rl_pass *pass)
{
    for (size_t i = 0; i < graph->n_nodes; i++)
        if (graph->nodes[i].pass == pass)
            return true;
    return false;
}

/* A material whose profile asks for what only `pass` does, which the graph has not; n->node reads the key. */
static rl_code check_pass(const needs *n, const rl_pass *pass)
{
    const char *key;
    int value;
    rl_code code = find_word(n, pass->profile_keys, pass->name, pass->fulfils, &key, &value);
    if (code || !has_row(n->node->pass->profile_keys, key))
        return code;
    for (size_t i = 1; i < n->materials->count && !code; i++) {
        double v[3] = {-1}, on[3] = {1};
        rl_material_get(n->materials, i, "shading", key, on);
        if (rl_material_has_profile(n->materials, i) && on[0] != 0 &&
            rl_material_get(n->materials, i, "profile", key, v) && (int)v[0] == value)
            code = rl_fail(n->err, RL_E_CONFIG, n->node->where,
                           "the profile of material '%s' has '%s', which pass %s does: the graph has none; "
                           "add it, or change the profile's '%s'",
                           n->materials->names[i], pass->fulfils, pass->name, key);
    }
    return code;
}

rl_code rl_graph_check_needs(rl_arena *arena, const rl_graph *graph, const rl_materials *materials,
                             rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < graph->n_nodes && !code; i++) {
        const needs n = {arena, materials, &graph->nodes[i], err};
        const rl_pass *pass = n.node->pass;
        for (size_t p = 0; p < pass->ports.n && !code; p++)
            if (pass->ports.rows[p].needed_by && n.node->images[p] < 0)
                code = check_port(&n, &pass->ports.rows[p]);
        for (size_t k = 0; k < pass->profile_keys.n && !code; k++)
            if (pass->profile_keys.rows[k].needed_by)
                code = check_row(&n, &pass->profile_keys.rows[k]);
        for (size_t k = 0; k < rl_pass_count() && !code; k++)
            if (rl_pass_at(k)->fulfils && !has_pass(graph, rl_pass_at(k)))
                code = check_pass(&n, rl_pass_at(k));
    }
    return code;
}
