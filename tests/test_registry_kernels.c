/* The kernels of every registered pass build without a warning in every structural form, and take the
 * arguments that the executor hands them; the place of a compiler's message is found. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/materials.h"
#include "graph/model/params.h"
#include "graph/run/device.h"
#include "graph/run/kernel_source.h"
#include "kernels/shared.h"
#include "tests/tool_run.h"

static int word_count(const char *words)
{
    int n = 1;
    for (const char *c = words; *c; c++)
        n += *c == '|';
    return n;
}

/* ---- kernels ---------------------------------------------------------------------------------------------
 */

enum { MOST_PORTS = 32, SIZE = 64 };

/* A node of one pass as a plan would have it: what rl_kernel_text reads, and nothing else. */
typedef struct form {
    const rl_pass *pass;
    int32_t params[64];
    int buffers[MOST_PORTS];
    rl_buffer buffer[MOST_PORTS];
    rl_graph_node node;
    rl_graph graph;
    rl_plan plan;
} form;

static rl_device *device;
static int built;

static void form_init(form *f, const rl_pass *pass)
{
    *f = (form){.pass = pass};
    assert_true(pass->ports.n <= MOST_PORTS && pass->params_size <= sizeof f->params);
    for (size_t i = 0; i < pass->params.n; i++)
        rl_param_default(&pass->params.rows[i], (char *)f->params + pass->params.rows[i].offset);
    for (size_t i = 0; i < pass->ports.n; i++) {
        f->buffers[i] = (int)i;
        f->buffer[i] = (rl_buffer){.layout = pass->ports.rows[i].layout};
    }
    f->node = (rl_graph_node){.name = "node", .pass = pass, .params = f->params};
    f->graph = (rl_graph){.nodes = &f->node, .n_nodes = 1};
    f->plan = (rl_plan){.graph = &f->graph, .buffers = f->buffer, .n_buffers = pass->ports.n};
}

/* The program's text with a material that has the rows of this pass alone. */
static char *own_materials(const rl_pass *pass, const char *text)
{
    const rl_pass *const one[] = {pass};
    const rl_registry registry = {one, 1};
    rl_str all = {0}, own = {0};
    rl_materials_struct_text(&all);
    rl_materials_struct_text_from(&registry, &own);
    char *replaced = text_replace(text, rl_str_text(&all), rl_str_text(&own));
    rl_str_free(&all);
    rl_str_free(&own);
    return replaced;
}

/* What a kernel reads of the materials it must declare: a merged graph (graph_merge.h) tells by that which
 * nodes are equal. */
static rl_program *form_build(const form *f, const char *what)
{
    rl_arena arena = {0};
    rl_str text = {0};
    rl_error err = {0};
    rl_program *program = NULL;
    rl_plan_node node = {.node = 0, .buffers = f->buffers};
    rl_code code = rl_kernel_text(&arena, &f->plan, &node, true, &text, &err);
    char *own = code ? NULL : own_materials(f->pass, rl_str_text(&text));
    if (code || rl_program_build(device, f->pass->name, own, true, &program, &err))
        fail_msg("%s (%s): %s:%d:%d: %s", f->pass->name, what, err.file, err.line, err.column, err.text);
    free(own);
    rl_str_free(&text);
    rl_arena_free(&arena);
    built++;
    return program;
}

static void form_try(const form *f, const char *what)
{
    rl_program *program = form_build(f, what);
    rl_program_free(&program);
}

/* Every value of every structural parameter, one at a time. */
static void try_structural(form *f)
{
    const rl_params rows = f->pass->params;
    for (size_t i = 0; i < rows.n; i++) {
        const rl_param *row = &rows.rows[i];
        if (!row->structural)
            continue;
        int32_t *at = &f->params[row->offset / 4], before = *at;
        if (row->type == RL_I32) {
            const double ends[] = {row->min, row->max};
            for (int k = 0; k < 2; k++, *at = before) {
                *at = (int32_t)ends[k];
                form_try(f, row->name);
            }
        } else {
            int n = row->type == RL_BOOL ? 2 : word_count(row->words);
            for (*at = 0; *at < n; ++*at)
                form_try(f, row->name);
        }
        *at = before;
    }
}

static bool may_lack(const rl_port *port)
{
    return port->optional || rl_port_on_request(port);
}

/* Whether the form has what a step or a port is only there for. */
static bool has_reduction(const form *f, const char *with)
{
    for (size_t k = 0; with && k < f->pass->ports.n; k++)
        if (!strcmp(f->pass->ports.rows[k].name, with))
            return f->buffers[k] >= 0;
    return !with;
}

/* Without sums, then: optional ports: each absent by itself, each present by itself; free layouts: each in
 * the other one. */
static void try_ports(form *f)
{
    const rl_port *rows = f->pass->ports.rows;
    size_t n = f->pass->ports.n;
    for (size_t k = 0; k < n; k++)
        f->buffers[k] = rl_port_on_request(&rows[k]) ? -1 : (int)k;
    form_try(f, "no sums");
    for (size_t k = 0; k < n; k++)
        f->buffers[k] = (int)k;
    for (size_t i = 0; i < n; i++) {
        if (rows[i].optional) {
            f->buffers[i] = -1;
            form_try(f, rows[i].name);
            for (size_t k = 0; k < n; k++)
                f->buffers[k] = rows[k].optional && k != i ? -1 : (int)k;
            form_try(f, rows[i].name);
            for (size_t k = 0; k < n; k++)
                f->buffers[k] = (int)k;
        }
        if (rows[i].any_layout) {
            f->buffer[i].layout = RL_PHASE4;
            form_try(f, rows[i].name);
            f->buffer[i].layout = RL_LINEAR;
        }
    }
}

static void test_kernels_build(void **state)
{
    (void)state;
    form f;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        form_init(&f, rl_pass_at(i));
        form_try(&f, "all ports");
        try_structural(&f);
        try_ports(&f);
    }
    assert_true((size_t)built > rl_pass_count());
}

/* ---- arguments -------------------------------------------------------------------------------------------
 */

/* Without pixels: the valid rectangle is empty, all ids are 0. */
static void put(rl_memory *m, const void *data, size_t bytes)
{
    rl_error err = {0};
    void *p;
    assert_int_equal(rl_memory_map(m, true, &p, &err), RL_OK);
    memcpy(p, data, bytes);
    assert_int_equal(rl_memory_unmap(m, &err), RL_OK);
}

static rl_memory *image_memory(rl_format format)
{
    rl_error err = {0};
    rl_memory *m;
    size_t floats = format == RL_SUMS ? 2 * RL_GUARD + RL_SUM_FLOATS
                                      : 2 * RL_GUARD + 3 * 16 * (SIZE / 4) * (SIZE / 4 + 2 * RL_MARGIN4);
    assert_int_equal(rl_memory_new(device, floats * sizeof(float), RL_GUARD * sizeof(float), &m, &err),
                     RL_OK);
    return m;
}

/* As the executor orders them (graph/model/pass.h): ports, params, frame, materials, lights, ambient, tables.
 */
static size_t make_arguments(const form *f, rl_memory **args)
{
    const rl_pass *p = f->pass;
    rl_error err = {0};
    size_t n = 0;
    const int stride4 = SIZE / 4 + 2 * RL_MARGIN4;
    frame_t frame = {.columns = SIZE, .rows = SIZE, .stride = SIZE, .plane = SIZE * SIZE, .stride4 = stride4};
    frame.plane4 = SIZE * stride4 * 4;
    frame.materials = 1;
    frame.camera.focal[0] = frame.camera.focal[1] = 1;
    frame.previous = frame.camera;
    for (size_t i = 0; i < p->ports.n; i++)
        if (f->buffers[i] >= 0 || !rl_port_on_request(&p->ports.rows[i]))
            args[n++] = f->buffers[i] < 0 ? NULL : image_memory(p->ports.rows[i].format);
    size_t extra = (p->params.n > 0) + 2u + p->lights + p->ambient + (p->tables != NULL);
    for (size_t i = 0; i < extra; i++)
        assert_int_equal(rl_memory_new(device, 1 << 18, 0, &args[n + i], &err), RL_OK);
    if (p->params.n > 0)
        put(args[n], f->params, p->params_size);
    put(args[n + (p->params.n > 0)], &frame, sizeof frame);
    return n + extra;
}

/* Whether the form feeds the port of that name. */
static bool feeds(const form *f, const char *port)
{
    for (size_t i = 0; port && i < f->pass->ports.n; i++)
        if (!strcmp(f->pass->ports.rows[i].name, port))
            return f->buffers[i] >= 0;
    return false;
}

static void run_form(const form *f, const char *what)
{
    rl_memory *args[MOST_PORTS + 5] = {0};
    rl_program *program = form_build(f, what);
    size_t n = make_arguments(f, args);
    rl_error err = {0};
    for (size_t s = 0; s < f->pass->steps.n; s++) {
        if (!rl_step_runs(f->pass, &f->pass->steps.rows[s], f->params) ||
            !has_reduction(f, f->pass->steps.rows[s].with) || feeds(f, f->pass->steps.rows[s].without))
            continue;
        rl_dispatch d = {
            .entry = f->pass->steps.rows[s].entry, .arguments = args, .n_arguments = n, .dims = 3};
        size_t one[3] = {4, 1, 1}, phase[3] = {16, 1, 1};
        memcpy(d.global, f->pass->steps.rows[s].domain == RL_EVERY_PHASE ? phase : one, sizeof d.global);
        memcpy(d.local, d.global, sizeof d.local);
        if (rl_device_run(device, program, &d, NULL, &err) || rl_device_finish(device, &err))
            fail_msg("%s (%s), %s: %s", f->pass->name, what, d.entry, err.text);
        d.n_arguments--; /* this test would see a kernel with one argument less or more */
        assert_int_equal(rl_device_run(device, program, &d, NULL, &err), RL_E_BUILD);
        err = (rl_error){0};
    }
    for (size_t i = 0; i < n; i++)
        rl_memory_free(&args[i]);
    rl_program_free(&program);
}

static void test_kernel_arguments(void **state)
{
    (void)state;
    form f;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        form_init(&f, rl_pass_at(i));
        run_form(&f, "all ports");
        bool any = false;
        for (size_t k = 0; k < f.pass->ports.n; k++) {
            any |= may_lack(&f.pass->ports.rows[k]);
            f.buffers[k] = may_lack(&f.pass->ports.rows[k]) ? -1 : (int)k;
        }
        if (any)
            run_form(&f, "no optional port");
    }
}

/* The strict build, on which the tests above rest, refuses what only warns. */
static void test_warnings_are_seen(void **state)
{
    (void)state;
    static const char text[] =
        "#line 1 \"w.cl\"\nint f(int x) { if (x) return 1; }\nkernel void k(global int *p) { *p = f(*p); }\n";
    rl_program *program = NULL;
    rl_error err = {0};
    assert_int_equal(rl_program_build(device, "w", text, false, &program, &err), RL_OK);
    rl_program_free(&program);
    assert_int_equal(rl_program_build(device, "w", text, true, &program, &err), RL_E_BUILD);
    assert_string_equal(err.file, "w.cl");
    assert_int_equal(err.line, 1);
    assert_null(program);
}

/* An error is named by its place in the file, and goes before a warning that stands above it. */
static void test_errors_have_a_place(void **state)
{
    (void)state;
    static const char text[] =
        "#line 7 \"a:b.cl\"\nint f(int x) { if (x) return 1; }\nkernel void k(global qint *p) { }\n";
    rl_program *program = NULL;
    rl_error err = {0};
    assert_int_equal(rl_program_build(device, "w", text, false, &program, &err), RL_E_BUILD);
    assert_string_equal(err.file, "a:b.cl");
    assert_int_equal(err.line, 8);
    assert_non_null(strstr(err.text, "qint"));
}

static int open_device(void **state)
{
    (void)state;
    rl_error err = {0};
    setenv("RELIT_CACHE", "", 1); /* a cached binary has no warnings */
    return (int)rl_device_open(NULL, 0, NULL, &device, &err);
}

static int close_device(void **state)
{
    (void)state;
    rl_device_close(&device);
    return rl_alloc_live() != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kernels_build),
        cmocka_unit_test(test_kernel_arguments),
        cmocka_unit_test(test_warnings_are_seen),
        cmocka_unit_test(test_errors_have_a_place),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
