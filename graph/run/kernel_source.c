#include "graph/run/kernel_source.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/model/materials.h"
#include "graph/model/params.h"

/* Made by the Makefile from kernels/ (build/kernels.c). */
typedef struct embedded {
    const char *name;
    const unsigned char *text; /* terminated */
} embedded;
extern const embedded rl_embedded_kernels[];

const char *rl_kernel_file(rl_arena *arena, const char *name)
{
    const char *folder = getenv("RELIT_KERNELS");
    if (folder && *folder) {
        const char *path = rl_path_join(arena, folder, name);
        char *text = NULL, *copy = NULL;
        size_t size;
        if (path && !rl_file_read(path, &text, &size, NULL))
            copy = rl_arena_strdup(arena, text);
        rl_free(text);
        return copy;
    }
    for (const embedded *e = rl_embedded_kernels; e->name; e++)
        if (!strcmp(e->name, name))
            return (const char *)e->text;
    return NULL;
}

uint64_t rl_kernel_files_hash(void)
{
    const char *folder = getenv("RELIT_KERNELS");
    uint64_t hash = 0;
    rl_arena arena = {0};
    for (const embedded *e = rl_embedded_kernels; folder && *folder && e->name; e++) {
        const char *text = rl_kernel_file(&arena, e->name);
        hash = XXH3_64bits_withSeed(text ? text : "", text ? strlen(text) : 0, hash + 1);
    }
    rl_arena_free(&arena);
    return hash;
}

/* A path is whatever the user's folders are called. */
static void add_line(const char *name, rl_str *out)
{
    rl_str_add(out, "#line 1 \"");
    for (const char *c = name; *c; c++) {
        if (*c == '"' || *c == '\\')
            rl_str_add(out, "\\");
        rl_str_addn(out, (unsigned char)*c < ' ' ? "?" : c, 1);
    }
    rl_str_add(out, "\"\n");
}

static rl_code add_file(rl_arena *arena, const char *name, rl_str *out, rl_error *err)
{
    const char *text = rl_kernel_file(arena, name);
    if (!text)
        return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "kernels/%s is not there", name);
    rl_str_printf(out, "#line 1 \"kernels/%s\"\n", name);
    rl_str_add(out, text);
    rl_str_add(out, "\n");
    return RL_OK;
}

/* Names separated by spaces. */
static rl_code add_files(rl_arena *arena, const char *names, rl_str *out, rl_error *err)
{
    rl_code code = RL_OK;
    while (names && *names && !code) {
        size_t n = strcspn(names, " ");
        const char *name = rl_arena_strndup(arena, names, n);
        code = name ? add_file(arena, name, out, err) : rl_fail_memory(err, n);
        names += n + strspn(names + n, " ");
    }
    return code;
}

static rl_code add_shared(rl_arena *arena, rl_str *out, rl_error *err)
{
    rl_code code = add_file(arena, "shared.h", out, err);
    return code ? code : add_file(arena, "common.cl", out, err);
}

static void add_ports(const rl_plan *plan, const rl_plan_node *node, const rl_pass *pass, rl_str *out)
{
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *port = &pass->ports.rows[i];
        int b = node->buffers[i];
        if (port->role == RL_READ)
            rl_str_printf(out, "#define HAS_%s %d\n", port->name, b >= 0);
        if (port->role == RL_REDUCTION)
            rl_str_printf(out, "#define WANTS_%s %d\n", port->name, b >= 0);
        if (port->role == RL_WRITE && port->any_layout)
            rl_str_printf(out, "#define LAYOUT_%s %d\n", port->name,
                          b >= 0 ? (int)plan->buffers[b].layout : 0);
    }
}

static void add_structural(const rl_pass *pass, const void *params, rl_str *out)
{
    for (size_t i = 0; i < pass->params.n; i++) {
        const rl_param *row = &pass->params.rows[i];
        if (!row->structural)
            continue;
        int32_t v;
        memcpy(&v, (const char *)params + row->offset, sizeof v);
        rl_str_printf(out, "#define P_%s %d\n", row->name, (int)v);
    }
}

rl_code rl_kernel_text(rl_arena *arena, const rl_plan *plan, const rl_plan_node *node, unsigned lights,
                       rl_str *out, rl_error *err)
{
    const rl_graph_node *n = &plan->graph->nodes[node->node];
    const rl_pass *pass = n->pass;
    rl_str_add(out, "#line 1 \"generated\"\n");
    add_ports(plan, node, pass, out);
    add_structural(pass, n->params, out);
    if (pass->lights || pass->light_tables)
        rl_str_printf(out,
                      "#define LIGHTS_MARCH %d\n#define LIGHTS_AREA %d\n#define LIGHTS_PROFILE %d\n"
                      "#define LIGHTS_SKY %d\n",
                      !!(lights & RL_LIGHTS_MARCH), !!(lights & RL_LIGHTS_AREA),
                      !!(lights & RL_LIGHTS_PROFILE), !!(lights & RL_LIGHTS_SKY));
    if (pass->params.n > 0) {
        rl_params_struct_text(pass->params, "params_t", out);
        rl_str_add(out, "\n");
    }
    rl_materials_struct_text(out);
    rl_str_add(out, "\n");
    rl_code code = add_shared(arena, out, err);
    if (code)
        return code;
    code = add_files(arena, pass->kernel_prelude, out, err);
    if (code)
        return code;
    if (pass->kernel_text) {
        add_line(pass->kernel_file ? pass->kernel_file : n->name, out);
        rl_str_add(out, pass->kernel_text);
        rl_str_add(out, "\n");
    } else {
        code = add_file(arena, pass->kernel, out, err);
    }
    if (!code && out->failed)
        code = rl_fail_memory(err, out->length);
    return code;
}

rl_code rl_kernel_convert_text(rl_arena *arena, rl_str *out, rl_error *err)
{
    rl_code code = add_shared(arena, out, err);
    if (!code)
        code = add_file(arena, "convert.cl", out, err);
    if (!code && out->failed)
        code = rl_fail_memory(err, out->length);
    return code;
}
