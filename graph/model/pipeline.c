#include "graph/model/pipeline.h"

#include <string.h>
#include <xxhash.h>

#include "graph/base/file.h"
#include "graph/model/pipeline_parts.h"

static const char user_kernel[] = "kernel"; /* the one `pass:` that is not in the registry */

/* ---- shared with the other parts
 * ----------------------------------------------------------------------------- */

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

rl_code rl_name_check(const char *name, const char *what, rl_where where, rl_error *err)
{
    bool good = is_letter(name[0]);
    for (const char *c = name; good && *c; c++)
        good = is_letter(*c) || (*c >= '0' && *c <= '9') || *c == '_' || *c == '-';
    if (good)
        return RL_OK;
    return rl_fail(
        err, RL_E_CONFIG, where,
        "'%s' cannot be the name of %s: letters, digits, '_' and '-' may be in it, a letter comes first",
        name, what);
}

rl_code rl_value_need(const rl_value *map, const char *key, const char *what, const char *name,
                      const char *remedy, rl_where where, const rl_value **out, rl_error *err)
{
    *out = rl_value_get(map, key);
    if (*out)
        return RL_OK;
    return rl_fail(err, RL_E_CONFIG, where, "%s '%s' needs '%s': %s", what, name, key, remedy);
}

/* ---- nodes
 * --------------------------------------------------------------------------------------------------- */

typedef struct parser {
    const rl_registry *registry;
    rl_arena *arena;
    rl_pipeline *p;
    rl_error *err;
} parser;

static rl_code find_pass(parser *q, const rl_entry *entry, const rl_pass **out)
{
    const rl_value *v;
    const char *name = NULL;
    rl_code code = rl_value_need(entry->value, "pass", "graph entry", entry->key, "the pass that it runs",
                                 entry->where, &v, q->err);
    if (!code)
        code = rl_value_text(v, "pass", &name, q->err);
    if (code)
        return code;
    if (!strcmp(name, user_kernel))
        return rl_user_kernel_read(q->arena, entry, out, q->err);
    *out = rl_registry_find(q->registry, name);
    if (*out)
        return RL_OK;
    size_t n = q->registry->n;
    const char **known = rl_arena_array(q->arena, n + 1, sizeof *known);
    if (!known)
        return rl_fail_memory(q->err, n * sizeof *known);
    for (size_t i = 0; i < n; i++)
        known[i] = q->registry->passes[i]->name;
    known[n] = user_kernel;
    return rl_fail_suggest(q->err, v->where, rl_arena_printf(q->arena, "there is no pass '%s'", name), name,
                           known, n + 1);
}

static bool is_input(const rl_port *port)
{
    return port->role == RL_READ;
}

static rl_code check_input(parser *q, const rl_node *node, const rl_entry *entry)
{
    const rl_pass *pass = node->pass;
    const char **known = rl_arena_array(q->arena, pass->ports.n, sizeof *known);
    size_t n = 0;
    if (!known)
        return rl_fail_memory(q->err, pass->ports.n * sizeof *known);
    for (size_t i = 0; i < pass->ports.n; i++) {
        if (!is_input(&pass->ports.rows[i]))
            continue;
        if (!strcmp(pass->ports.rows[i].name, entry->key))
            return RL_OK;
        known[n++] = pass->ports.rows[i].name;
    }
    char *text =
        rl_arena_printf(q->arena, "pass '%s' (%s) has no input '%s'", node->name, pass->name, entry->key);
    return rl_fail_suggest(q->err, entry->where, text, entry->key, known, n);
}

static rl_code read_inputs(parser *q, rl_node *node, const rl_value *in)
{
    if (!in)
        return RL_OK;
    if (in->kind != RL_MAP)
        return rl_value_wrong(in, "in", "a map from ports to images", q->err);
    rl_node_input *inputs = rl_arena_array(q->arena, in->n, sizeof *inputs);
    if (!inputs)
        return rl_fail_memory(q->err, in->n * sizeof *inputs);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < in->n; i++) {
        const rl_entry *entry = &in->entries[i];
        inputs[i] = (rl_node_input){.port = entry->key, .where = entry->value->where};
        code = check_input(q, node, entry);
        if (!code)
            code = rl_value_text(entry->value, entry->key, &inputs[i].image, q->err);
    }
    node->inputs = inputs;
    node->n_inputs = in->n;
    return code;
}

static rl_code read_node(parser *q, const rl_entry *entry, rl_node *node)
{
    static const char *const keys[] = {"pass", "in"};
    node->name = entry->key;
    node->where = entry->where;
    if (!strcmp(entry->key, "capture") || !strcmp(entry->key, "output"))
        return rl_fail(q->err, RL_E_CONFIG, entry->where,
                       "'%s' cannot be the name of a pass: it begins the names of relit's own images",
                       entry->key);
    rl_code code = rl_name_check(entry->key, "a pass", entry->where, q->err);
    if (!code && entry->value->kind != RL_MAP)
        code = rl_value_wrong(entry->value, entry->key, "a map such as {pass: lighting}", q->err);
    if (!code)
        code = find_pass(q, entry, &node->pass);
    if (!code)
        code = read_inputs(q, node, rl_value_get(entry->value, "in"));
    if (code)
        return code;
    bool user = !!node->pass->kernel_text;
    node->map = entry->value;
    return rl_params_read(q->arena, node->pass, node->name, entry->value, user ? rl_user_kernel_keys : keys,
                          user ? rl_user_kernel_n_keys : RL_ARRAY_LENGTH(keys), &node->params, q->err);
}

static rl_code read_graph(parser *q, const rl_value *graph)
{
    if (!graph)
        return RL_OK;
    if (graph->kind != RL_MAP)
        return rl_value_wrong(graph, "graph", "a map from names to passes", q->err);
    rl_node *nodes = rl_arena_array(q->arena, graph->n, sizeof *nodes);
    if (!nodes)
        return rl_fail_memory(q->err, graph->n * sizeof *nodes);
    q->p->nodes = nodes;
    q->p->n_nodes = graph->n;
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < graph->n; i++)
        code = read_node(q, &graph->entries[i], &nodes[i]);
    return code;
}

/* ---- the other sections
 * ---------------------------------------------------------------------------------------- */

static rl_code check_version(const rl_value *root, rl_error *err)
{
    const rl_value *version = rl_value_get(root, "relit");
    if (!version && rl_value_get(root, "relit_capture"))
        return rl_fail(
            err, RL_E_CONFIG, root->where,
            "this is the manifest of a capture, not a pipeline: `relit init` writes a pipeline for it");
    if (!version)
        return rl_fail(err, RL_E_CONFIG, root->where,
                       "'relit: 1' is missing: write it as the first line of a pipeline");
    if (version->kind != RL_NUMBER || !version->integral || version->integer != 1)
        return rl_value_wrong(version, "relit", "1, the version of the pipeline format", err);
    return RL_OK;
}

/* A map or absent. */
static rl_code read_map(parser *q, const char *key, const rl_value **out)
{
    *out = rl_value_get(q->p->root, key);
    return *out && (*out)->kind != RL_MAP ? rl_value_wrong(*out, key, "a map", q->err) : RL_OK;
}

static rl_code read_capture(parser *q)
{
    const rl_value *v = q->p->capture = rl_value_get(q->p->root, "capture");
    if (v && v->kind != RL_MAP && (v->kind != RL_TEXT || !v->text[0]))
        return rl_value_wrong(v, "capture", "a path, or a map with the keys of a capture.yaml", q->err);
    return RL_OK;
}

static rl_code read_color(parser *q)
{
    static const char *const keys[] = {"config", "working"};
    const rl_value *color = rl_value_get(q->p->root, "color");
    if (!color)
        return RL_OK;
    rl_code code = rl_value_keys(color, "color", keys, RL_ARRAY_LENGTH(keys), q->err);
    if (code)
        return code;
    const rl_value *config = rl_value_get(color, "config"), *working = rl_value_get(color, "working");
    const char *text;
    q->p->color_where = working ? working->where : config ? config->where : color->where;
    if (working)
        code = rl_value_text(working, "working", &q->p->working, q->err);
    if (!code && config)
        code = rl_value_text(config, "config", &text, q->err);
    if (!code && config && !(q->p->ocio_config = rl_value_path(q->arena, config)))
        code = rl_fail_memory(q->err, 0);
    return code;
}

/* ---- setting ---- */

/* Which name of the path is not there, and what stands in its place. */
static void warn_nothing(const rl_value *root, const char *path, rl_where where, const rl_log *log)
{
    enum { MOST = 64 };
    const char *names[MOST], *rest = path;
    const rl_value *map = root;
    rl_str key = {0}, text = {0};
    for (const rl_value *next = root; next; rest += strcspn(rest, ".") + 1) {
        map = next;
        key.length = 0;
        rl_str_addn(&key, rest, strcspn(rest, "."));
        next = rest[strcspn(rest, ".")] ? rl_value_get(map, rl_str_text(&key)) : NULL;
    }
    size_t n = 0;
    for (; map->kind == RL_MAP && n < map->n && n < MOST; n++)
        names[n] = map->entries[n].key;
    rl_suggest(&text, rl_str_text(&key), names, n, "known");
    if (!key.failed && !text.failed)
        rl_report(log, RL_WARNING, where, "nothing is removed: there is no '%s'%s", path, rl_str_text(&text));
    rl_str_free(&key);
    rl_str_free(&text);
}

rl_code rl_pipeline_set(rl_arena *arena, rl_value **root, const char *path, rl_value *v, const rl_log *log,
                        rl_error *err)
{
    const rl_value *lights = rl_value_get(*root, "lights");
    bool removes = v->kind == RL_NULL, of_capture = !lights || lights->implied || lights->kind == RL_NULL;
    if (removes && of_capture && !strncmp(path, "lights.", 7)) {
        rl_value *stays = rl_arena_alloc(arena, sizeof *stays);
        if (!stays)
            return rl_fail_memory(err, sizeof *stays);
        *stays = *v;
        stays->kind = RL_TEXT; /* so that rl_value_set puts it there */
        rl_code code = rl_value_set(arena, root, path, stays, err);
        stays->kind = RL_NULL;
        return code;
    }
    bool nothing = removes && !rl_value_at(*root, path);
    rl_code code = rl_value_set(arena, root, path, v, err);
    if (!code && nothing)
        warn_nothing(*root, path, v->where, log);
    return code;
}

/* ---- reading ---- */

/* What the result depends on, as far as the pipeline says it. */
static rl_code make_hash(parser *q)
{
    rl_str content = {0};
    rl_value_print(q->p->root, &content);
    for (size_t i = 0; i < q->p->n_nodes; i++) {
        const char *text = q->p->nodes[i].pass->kernel_text;
        if (text)
            rl_str_addn(&content, text, strlen(text) + 1);
    }
    rl_code code = content.failed ? rl_fail_memory(q->err, content.length) : RL_OK;
    if (!code)
        q->p->hash = XXH3_64bits(rl_str_text(&content), content.length);
    rl_str_free(&content);
    return code;
}

static rl_code read_sections(parser *q)
{
    static const char *const keys[] = {"relit",     "capture", "color",   "profiles", "shading",
                                       "materials", "lights",  "ambient", "graph",    "outputs"};
    const rl_value *root = q->p->root, *include = rl_value_get(root, "include"), *outputs = NULL;
    if (root->kind != RL_MAP)
        return rl_value_wrong(root, "pipeline", "a map that starts with 'relit: 1'", q->err);
    rl_code code = check_version(root, q->err);
    if (!code && include) /* merged and dropped by rl_config_load */
        code = rl_fail(q->err, RL_E_CONFIG, include->where, "'include' works in a file only");
    if (!code)
        code = rl_value_keys(root, "a pipeline", keys, RL_ARRAY_LENGTH(keys), q->err);
    if (!code)
        code = read_capture(q);
    if (!code)
        code = read_color(q);
    if (!code)
        code = read_map(q, "profiles", &q->p->profiles);
    if (!code)
        code = read_map(q, "shading", &q->p->shading);
    if (!code)
        code = read_map(q, "materials", &q->p->materials);
    if (!code)
        code = read_map(q, "lights", &q->p->lights);
    if (!code)
        code = read_map(q, "ambient", &q->p->ambient);
    if (!code)
        code = read_graph(q, rl_value_get(root, "graph"));
    if (!code)
        code = read_map(q, "outputs", &outputs);
    if (!code)
        code = rl_outputs_read(q->arena, outputs, &q->p->outputs, &q->p->n_outputs, q->err);
    return code ? code : make_hash(q);
}

rl_code rl_pipeline_parse_from(const rl_registry *registry, rl_arena *arena, const char *file, rl_value *root,
                               const rl_log *log, const rl_pipeline **out, rl_error *err)
{
    rl_pipeline *p = rl_arena_alloc(arena, sizeof *p);
    const char *name = rl_path_name(file);
    if (!p || !(p->file = rl_arena_strdup(arena, file)) ||
        !(p->name = rl_arena_strndup(arena, name, strlen(name) - strlen(rl_path_extension(file)))))
        return rl_fail_memory(err, sizeof *p);
    p->root = root;
    parser q = {registry, arena, p, err};
    rl_code code = read_sections(&q);
    if (code)
        return code;
    if (!p->n_outputs)
        rl_report(log, RL_WARNING, root->where, "the pipeline has no outputs: nothing needs its passes");
    *out = p;
    return RL_OK;
}

rl_code rl_pipeline_parse(rl_arena *arena, const char *file, rl_value *root, const rl_log *log,
                          const rl_pipeline **out, rl_error *err)
{
    return rl_pipeline_parse_from(rl_registry_all(), arena, file, root, log, out, err);
}
