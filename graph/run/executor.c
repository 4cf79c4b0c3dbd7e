#include "graph/run/executor.h"

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/executor_parts.h"

/* Kernels address images from pixel (0, 0) on; the guard in front can be read. */
#define GUARD_BYTES (RL_GUARD * sizeof(float))

struct rl_frame_buffers {
    rl_geometry geometry;
    rl_memory **memory; /* [n] */
    size_t n;
};

/* ---- making ----------------------------------------------------------------------------------------------
 */

static rl_code upload(rl_executor *x, const void *data, size_t bytes, rl_memory **out, rl_error *err)
{
    if (!*out || rl_memory_bytes(*out) < bytes) {
        rl_memory_free(out);
        rl_code code = rl_memory_new(x->device, bytes, 0, out, err);
        if (code)
            return code;
    }
    void *p;
    rl_code code = rl_memory_map(*out, true, &p, err);
    if (code)
        return code;
    if (bytes)
        memcpy(p, data, bytes);
    return rl_memory_unmap(*out, err);
}

static rl_code make_constants(rl_executor *x, int node, rl_error *err)
{
    const rl_graph_node *g = &x->plan->graph->nodes[node];
    rl_node_state *n = &x->nodes[node];
    rl_code code = RL_OK;
    if (g->pass->params.n > 0)
        code = upload(x, g->params, g->pass->params_size, &n->params, err);
    if (!code && g->pass->tables) {
        rl_tables t = {0};
        rl_pass_input in = {
            .pass = g->pass, .params = g->params, .materials = x->scenes[g->scene].scene.materials};
        code = g->pass->tables(&in, &x->arena, &t, err);
        if (!code)
            code = upload(x, t.data, t.n * sizeof *t.data, &n->tables, err);
    }
    return code;
}

static rl_code upload_scenes(rl_executor *x, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < x->n_scenes && !code; i++) {
        rl_scene_state *s = &x->scenes[i];
        const rl_materials *m = s->scene.materials;
        code = upload(x, m->data, m->count * m->entry_bytes, &s->materials, err);
        const rl_light_setup *l = &s->scene.lights;
        if (!code && l->n_profiles)
            code = upload(x, l->profiles, l->n_profiles * sizeof *l->profiles, &s->profiles, err);
        if (!code && l->n_sky)
            code = upload(x, l->sky, l->n_sky * sizeof *l->sky, &s->sky, err);
        if (!code)
            code = rl_memory_new(x->device, sizeof(frame_t), 0, &s->frame, err);
    }
    return code;
}

rl_code rl_executor_new(rl_device *device, const rl_plan *plan, const rl_scene *scenes, size_t n_scenes,
                        int threads, const rl_log *log, rl_executor **out, rl_error *err)
{
    *out = NULL;
    rl_executor *x = rl_calloc(1, sizeof *x);
    if (!x)
        return rl_fail_memory(err, sizeof *x);
    x->device = device;
    x->plan = plan;
    x->log = log;
    x->scenes = rl_arena_array(&x->arena, n_scenes, sizeof *x->scenes);
    x->nodes = rl_arena_array(&x->arena, plan->graph->n_nodes + 1, sizeof *x->nodes);
    x->slots = rl_arena_array(&x->arena, plan->n_slots + 1, sizeof *x->slots);
    x->history = rl_arena_array(&x->arena, 2 * plan->n_buffers + 1, sizeof *x->history);
    rl_code code = x->nodes && x->slots && x->history && x->scenes ? RL_OK : rl_fail_memory(err, 1);
    for (size_t i = 0; i < n_scenes && !code; i++)
        x->scenes[x->n_scenes++].scene = scenes[i];
    if (!code)
        code = rl_executor_build(x, threads, err);
    for (size_t i = 0; i < plan->n_nodes && !code; i++)
        code = make_constants(x, plan->nodes[i].node, err);
    if (!code)
        code = upload_scenes(x, err);
    if (code)
        rl_executor_free(&x);
    *out = x;
    return code;
}

static void free_images(rl_executor *x)
{
    for (size_t i = 0; x->slots && i < x->plan->n_slots; i++)
        rl_memory_free(&x->slots[i]);
    for (size_t i = 0; x->history && i < 2 * x->plan->n_buffers; i++)
        rl_memory_free(&x->history[i]);
    x->geometry = (rl_geometry){0};
    x->has_history = false;
}

void rl_executor_free(rl_executor **executor)
{
    rl_executor *x = *executor;
    *executor = NULL;
    if (!x)
        return;
    free_images(x);
    for (size_t i = 0; x->nodes && i < x->plan->graph->n_nodes; i++) {
        rl_program_free(&x->nodes[i].program);
        rl_memory_free(&x->nodes[i].params);
        rl_memory_free(&x->nodes[i].tables);
    }
    rl_program_free(&x->convert);
    for (size_t i = 0; i < x->n_scenes; i++) {
        rl_memory_free(&x->scenes[i].materials);
        rl_memory_free(&x->scenes[i].frame);
        rl_memory_free(&x->scenes[i].lights);
        rl_memory_free(&x->scenes[i].ambient);
        rl_memory_free(&x->scenes[i].profiles);
        rl_memory_free(&x->scenes[i].sky);
    }
    rl_arena_free(&x->arena);
    rl_free(x);
}

/* ---- memory of a size ------------------------------------------------------------------------------------
 */

rl_code rl_executor_resize(rl_executor *x, const rl_geometry *geometry, rl_error *err)
{
    if (!memcmp(&x->geometry, geometry, sizeof *geometry))
        return RL_OK;
    free_images(x);
    rl_code code = RL_OK;
    for (size_t i = 0; i < x->plan->n_slots && !code; i++)
        code = rl_memory_new(x->device, rl_slot_bytes(x->plan, (int)i, geometry), GUARD_BYTES, &x->slots[i],
                             err);
    for (size_t i = 0; i < x->plan->n_buffers && !code; i++) {
        const rl_buffer *b = &x->plan->buffers[i];
        for (size_t half = 0; half < 2 && b->kind == RL_BUFFER_HISTORY && !code; half++)
            code = rl_memory_new(x->device, rl_buffer_bytes(b, geometry), GUARD_BYTES,
                                 &x->history[2 * i + half], err);
    }
    if (code)
        free_images(x);
    else
        x->geometry = *geometry;
    return code;
}

const rl_geometry *rl_executor_geometry(const rl_executor *x)
{
    return &x->geometry;
}

rl_code rl_frame_buffers_new(rl_executor *x, const rl_geometry *geometry, rl_frame_buffers **out,
                             rl_error *err)
{
    rl_frame_buffers *f = rl_calloc(1, sizeof *f);
    *out = f;
    if (!f)
        return rl_fail_memory(err, sizeof *f);
    f->geometry = *geometry;
    f->n = x->plan->n_buffers;
    f->memory = rl_calloc(f->n + 1, sizeof *f->memory);
    rl_code code = f->memory ? RL_OK : rl_fail_memory(err, f->n * sizeof *f->memory);
    for (size_t i = 0; i < f->n && !code; i++) {
        const rl_buffer *b = &x->plan->buffers[i];
        if (b->kind == RL_BUFFER_SOURCE || b->kind == RL_BUFFER_SINK)
            code = rl_memory_new(x->device, rl_buffer_bytes(b, geometry), GUARD_BYTES, &f->memory[i], err);
    }
    if (code)
        rl_frame_buffers_free(out);
    return code;
}

void rl_frame_buffers_free(rl_frame_buffers **buffers)
{
    rl_frame_buffers *f = *buffers;
    *buffers = NULL;
    if (!f)
        return;
    for (size_t i = 0; f->memory && i < f->n; i++)
        rl_memory_free(&f->memory[i]);
    rl_free(f->memory);
    rl_free(f);
}

const rl_geometry *rl_frame_buffers_geometry(const rl_frame_buffers *buffers)
{
    return &buffers->geometry;
}

rl_memory *rl_frame_buffers_memory(const rl_frame_buffers *buffers, int buffer)
{
    return buffer >= 0 && (size_t)buffer < buffers->n ? buffers->memory[buffer] : NULL;
}

/* ---- running ---------------------------------------------------------------------------------------------
 */

/* Where a buffer is during this frame; `past` asks for the older half of a pair. */
static rl_memory *locate(const rl_executor *x, const rl_frame_buffers *f, int buffer, bool past)
{
    if (buffer < 0)
        return NULL;
    const rl_buffer *b = &x->plan->buffers[buffer];
    switch (b->kind) {
    case RL_BUFFER_SOURCE:
    case RL_BUFFER_SINK:
        return f->memory[buffer];
    case RL_BUFFER_TRANSIENT:
        return x->slots[b->slot];
    case RL_BUFFER_HISTORY:
        return x->history[2 * buffer + (past ? !x->newest : x->newest)];
    }
    return NULL;
}

static void domain_sizes(rl_domain domain, const rl_geometry *g, rl_dispatch *d)
{
    size_t columns = (size_t)g->columns, rows = (size_t)g->rows;
    switch (domain) {
    case RL_EVERY_PIXEL:
        *d = (rl_dispatch){.dims = 2, .global = {columns, rows}, .local = {64, 1}};
        break;
    case RL_EVERY_VECTOR:
        *d = (rl_dispatch){.dims = 2, .global = {columns / 16, rows}, .local = {4, 1}};
        break;
    case RL_EVERY_PHASE:
        *d = (rl_dispatch){.dims = 3, .global = {16, columns / 64, rows / 4}, .local = {16, 1, 1}};
        break;
    case RL_EVERY_BAND:
        *d = (rl_dispatch){.dims = 1, .global = {RL_BANDS}, .local = {1}};
        break;
    }
}

enum { MOST_ARGUMENTS = 64 };

static rl_code run_kernel(rl_executor *x, const rl_plan_step *s, const rl_frame_buffers *f, rl_span *span,
                          rl_error *err)
{
    const rl_graph_node *g = &x->plan->graph->nodes[s->node];
    const rl_node_state *n = &x->nodes[s->node];
    const rl_scene_state *scene = &x->scenes[g->scene];
    const rl_pass *pass = g->pass;
    const rl_step *step = &pass->steps.rows[s->step];
    rl_memory *args[MOST_ARGUMENTS];
    size_t k = 0;
    if (pass->ports.n + 8 > MOST_ARGUMENTS)
        return rl_fail(err, RL_E_CONFIG, g->where, "pass '%s' (%s) has too many ports (%zu)", g->name,
                       pass->name, pass->ports.n);
    for (size_t i = 0; i < pass->ports.n; i++)
        if (s->buffers[i] >= 0 || !rl_port_on_request(&pass->ports.rows[i]))
            args[k++] = locate(x, f, s->buffers[i], pass->ports.rows[i].role == RL_HISTORY);
    if (pass->params.n > 0)
        args[k++] = n->params;
    args[k++] = scene->frame;
    args[k++] = scene->materials;
    if (pass->lights)
        args[k++] = scene->lights;
    if (pass->ambient)
        args[k++] = scene->ambient;
    if (pass->light_tables) {
        args[k++] = scene->profiles;
        args[k++] = scene->sky;
    }
    if (pass->tables)
        args[k++] = n->tables;
    rl_dispatch d;
    domain_sizes(step->domain, &x->geometry, &d);
    d.entry = step->entry;
    d.arguments = args;
    d.n_arguments = k;
    return rl_device_run(x->device, n->program, &d, span, err);
}

static rl_code run_convert(rl_executor *x, const rl_plan_step *s, const rl_frame_buffers *f, rl_span *span,
                           rl_error *err)
{
    const rl_buffer *from = &x->plan->buffers[s->buffers[0]], *to = &x->plan->buffers[s->buffers[1]];
    rl_memory *args[] = {locate(x, f, s->buffers[0], false), locate(x, f, s->buffers[1], false),
                         x->scenes[0].frame};
    rl_dispatch d = {
        .entry = to->layout == RL_PHASE4 ? "linear_to_phase4" : "phase4_to_linear",
        .arguments = args,
        .n_arguments = 3,
        .dims = 3,
        .global = {(size_t)x->geometry.columns / 64 + 2, (size_t)x->geometry.rows, (size_t)from->planes},
        .local = {1, 4, 1}};
    return rl_device_run(x->device, x->convert, &d, span, err);
}

static rl_code run_step(rl_executor *x, const rl_plan_step *s, const rl_frame_buffers *f, rl_span *span,
                        rl_error *err)
{
    switch (s->kind) {
    case RL_STEP_KERNEL:
        return run_kernel(x, s, f, span, err);
    case RL_STEP_CONVERT:
        return run_convert(x, s, f, span, err);
    case RL_STEP_COPY:
        return rl_memory_copy(locate(x, f, s->buffers[1], false), locate(x, f, s->buffers[0], false), err);
    }
    return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "a step of an unknown kind");
}

static rl_code upload_scene(rl_executor *x, const rl_frame_values *v, size_t scene, rl_error *err)
{
    rl_scene_state *s = &x->scenes[scene];
    const rl_scene_values *own = &v->scenes[scene];
    const rl_geometry *g = &x->geometry;
    int left = g->x - g->origin_x, top = g->y - g->origin_y;
    frame_t f = {.columns = g->columns,
                 .rows = g->rows,
                 .valid = {left, top, left + g->width, top + g->height},
                 .origin = {g->origin_x, g->origin_y},
                 .stride = g->stride,
                 .plane = g->plane,
                 .stride4 = g->stride4,
                 .plane4 = g->plane4,
                 .number = v->number,
                 .history = x->has_history,
                 .materials = (int)s->scene.materials->count,
                 .lights = own->n_lights,
                 .camera = v->camera,
                 .previous = x->has_history ? x->previous : v->camera};
    rl_code code = upload(x, &f, sizeof f, &s->frame, err);
    if (!code)
        code = upload(x, own->lights, (size_t)own->n_lights * sizeof *own->lights, &s->lights, err);
    const ambient_t none = {0};
    if (!code)
        code = upload(x, own->ambient ? own->ambient : &none, sizeof none, &s->ambient, err);
    return code;
}

rl_code rl_executor_run(rl_executor *x, rl_frame_buffers *buffers, const rl_frame_values *values,
                        rl_span *spans, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < x->n_scenes && !code; i++)
        code = upload_scene(x, values, i, err);
    for (size_t i = 0; i < x->plan->n_steps && !code; i++)
        code = run_step(x, &x->plan->steps[i], buffers, spans ? &spans[i] : NULL, err);
    rl_code finished = rl_device_finish(x->device, code ? NULL : err);
    code = code ? code : finished;
    x->has_history = !code;
    x->newest = !x->newest;
    x->previous = values->camera;
    return code;
}

void rl_executor_cut(rl_executor *x)
{
    x->has_history = false;
}
