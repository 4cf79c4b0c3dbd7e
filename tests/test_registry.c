/* What every registered pass promises (graph/model/pass.h): a table that can be trusted, ports that fit together, and kernels
 * that build without a warning in every structural form and take the arguments that the executor hands them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/params.h"
#include "graph/run/device.h"
#include "graph/run/kernel_source.h"
#include "kernels/shared.h"

/* ---- texts ----------------------------------------------------------------------------------------------- */

/* One line, lower case (but for names such as "GGX", "Burley's", "SG" further on), no full stop. */
static void check_help(const char *pass, const char *name, const char *help)
{
    size_t n = help ? strlen(help) : 0;
    bool good = n > 0 && help[n - 1] != '.' && !strchr(help, '\n') && n < 110;
    if (good && isupper((unsigned char)help[0]) && !isupper((unsigned char)help[1]))
        good = strstr(help, "'s ") != NULL; /* a person's name may begin it */
    if (!good)
        fail_msg("%s, %s: the help '%s' is not one lower-case line without a full stop", pass, name, help ? help : "");
}

static void test_texts(void **state)
{
    (void)state;
    assert_true(rl_pass_count() > 0);
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        assert_non_null(p->name);
        check_help(p->name, "pass", p->help);
        assert_true(p->source && strlen(p->source) > 3);
        assert_true(strspn(p->name, "abcdefghijklmnopqrstuvwxyz0123456789_") == strlen(p->name));
        assert_ptr_equal(rl_pass_find(p->name), p); /* so names differ, too */
        assert_string_not_equal(p->name, "kernel"); /* stands for a user's own */
        assert_true(!p->kernel != !p->kernel_text);
        assert_true(p->steps.n > 0);
    }
}

/* ---- parameters ------------------------------------------------------------------------------------------ */

static int word_count(const char *words)
{
    int n = 1;
    for (const char *c = words; *c; c++)
        n += *c == '|';
    return n;
}

static void check_words(const rl_param *row)
{
    const char *w = row->words;
    assert_true(*w && *w != '|' && w[strlen(w) - 1] != '|' && !strstr(w, "||"));
    assert_null(strpbrk(w, " \t,'\""));
}

/* A default that the row's own reader would refuse is a value that no user can write. */
static void check_default(const char *pass, const rl_param *row)
{
    int lanes = row->type == RL_RGBF ? 3 : 1;
    if (row->no_default || row->required)
        return;
    for (int i = 0; i < lanes; i++) {
        double d = row->def[i];
        bool word = row->words && d < 0 && row->type == RL_I32 && -1 - d < word_count(row->words);
        bool in = d >= row->min && d <= row->max;
        if (row->type == RL_ENUM)
            in = d >= 0 && d < word_count(row->words);
        if (row->type != RL_F32 && row->type != RL_RGBF)
            in = in && d == rint(d);
        if (!in && !word)
            fail_msg("%s.%s: the default %g is not within %g … %g", pass, row->name, d, row->min, row->max);
    }
}

static void check_row(const char *pass, const rl_param *row, bool of_struct)
{
    check_help(pass, row->name, row->help);
    assert_non_null(row->unit);
    assert_true(isfinite(row->min) && isfinite(row->max) && row->min <= row->max);
    assert_true((row->type == RL_ENUM) <= (row->words != NULL));
    assert_true(!row->words || row->type == RL_ENUM || row->type == RL_I32);
    if (row->words)
        check_words(row);
    if (row->words && row->type == RL_I32)
        assert_true(row->min >= 0); /* words take the negative numbers */
    if (row->no_default)
        assert_true(!of_struct && row->min >= 0); /* the device sees -1 */
    if (row->required)
        assert_false(of_struct);
    if (row->structural)
        assert_true(of_struct && row->type != RL_F32 && row->type != RL_RGBF);
    check_default(pass, row);
}

static void check_unique(const char *pass, rl_params rows)
{
    for (size_t i = 0; i < rows.n; i++)
        for (size_t k = 0; k < i; k++)
            if (!strcmp(rows.rows[i].name, rows.rows[k].name))
                fail_msg("%s has two parameters '%s'", pass, rows.rows[i].name);
}

static void test_params(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        size_t bytes = 0;
        for (size_t k = 0; k < p->params.n; k++) {
            check_row(p->name, &p->params.rows[k], true);
            assert_int_equal(p->params.rows[k].offset, bytes); /* in order, without gaps: as OpenCL lays it out */
            bytes += RL_PARAM_BYTES(p->params.rows[k].type);
        }
        assert_int_equal(p->params_size, bytes);
        check_unique(p->name, p->params);
        const rl_params groups[] = {p->profile_keys, p->material_keys, p->shading_keys};
        for (int g = 0; g < 3; g++) {
            for (size_t k = 0; k < groups[g].n; k++)
                check_row(p->name, &groups[g].rows[k], false);
            check_unique(p->name, groups[g]);
        }
    }
}

static bool same_text(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

static bool same_row(const rl_param *a, const rl_param *b)
{
    return a->type == b->type && a->min == b->min && a->max == b->max && !memcmp(a->def, b->def, sizeof a->def) &&
           same_text(a->words, b->words) && same_text(a->unit, b->unit) && same_text(a->help, b->help) &&
           a->no_default == b->no_default; /* .required is each pass's own: lighting needs d only for transmission */
}

/* material_t takes the first of equal names: the others must be the same row. */
static void test_shared_rows(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        for (size_t j = 0; j < i; j++) {
            const rl_pass *a = rl_pass_at(i), *b = rl_pass_at(j);
            const rl_params one[] = {a->profile_keys, a->material_keys, a->shading_keys};
            const rl_params two[] = {b->profile_keys, b->material_keys, b->shading_keys};
            for (int g = 0; g < 3; g++)
                for (size_t k = 0; k < one[g].n; k++)
                    for (size_t m = 0; m < two[g].n; m++)
                        if (!strcmp(one[g].rows[k].name, two[g].rows[m].name) &&
                            !same_row(&one[g].rows[k], &two[g].rows[m]))
                            fail_msg("%s and %s differ in '%s'", a->name, b->name, one[g].rows[k].name);
        }
    }
}

/* ---- ports ----------------------------------------------------------------------------------------------- */

/* Own output first, else own input. */
static const rl_port *past_of(const rl_pass *p, const char *name)
{
    for (int writes = 1; writes >= 0; writes--)
        for (size_t i = 0; i < p->ports.n; i++)
            if (!strcmp(p->ports.rows[i].name, name) && p->ports.rows[i].role == (writes ? RL_WRITE : RL_READ))
                return &p->ports.rows[i];
    return NULL;
}

static void check_port(const rl_pass *p, size_t which)
{
    const rl_port *a = &p->ports.rows[which];
    check_help(p->name, a->name, a->help);
    assert_true(strspn(a->name, "abcdefghijklmnopqrstuvwxyz0123456789_") == strlen(a->name));
    assert_true((a->of != NULL) == (a->role == RL_HISTORY));
    if (a->of) {
        const rl_port *past = past_of(p, a->of);
        assert_non_null(past);
        assert_int_equal(past->format, a->format);
        assert_true(a->optional || !past->optional);
    }
    if (a->optional)
        assert_true(a->role == RL_READ || a->role == RL_HISTORY);
    if (a->any_layout)
        assert_true(a->role == RL_WRITE && a->layout == RL_LINEAR);
    if (a->format == RL_LIGHTS)
        assert_true(a->role == RL_READ && a->layout == RL_LINEAR && p->lights);
    for (size_t k = 0; k < which; k++) { /* a pass may read and write under one name */
        const rl_port *b = &p->ports.rows[k];
        if (!strcmp(a->name, b->name) && !((a->role == RL_WRITE) ^ (b->role == RL_WRITE)))
            fail_msg("%s has two ports '%s'", p->name, a->name);
    }
}

static void test_ports(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        bool phases = false, writes = false;
        for (size_t k = 0; k < p->steps.n; k++)
            phases |= p->steps.rows[k].domain == RL_EVERY_PHASE;
        for (size_t k = 0; k < p->ports.n; k++) {
            check_port(p, k);
            writes |= p->ports.rows[k].role == RL_WRITE;
            if (p->ports.rows[k].layout == RL_PHASE4 && !phases)
                fail_msg("%s wants '%s' in phases, but no step of it runs by phases", p->name, p->ports.rows[k].name);
        }
        assert_true(writes);
    }
}

/* ---- kernels --------------------------------------------------------------------------------------------- */

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

static rl_program *form_build(const form *f, const char *what)
{
    rl_arena arena = {0};
    rl_str text = {0};
    rl_error err = {0};
    rl_program *program = NULL;
    rl_plan_node node = {.node = 0, .buffers = f->buffers};
    if (rl_kernel_text(&arena, &f->plan, &node, &text, &err) ||
        rl_program_build(device, f->pass->name, rl_str_text(&text), true, &program, &err))
        fail_msg("%s (%s): %s:%d:%d: %s", f->pass->name, what, err.file, err.line, err.column, err.text);
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

/* Optional ports: each absent by itself, each present by itself; free layouts: each in the other one. */
static void try_ports(form *f)
{
    const rl_port *rows = f->pass->ports.rows;
    size_t n = f->pass->ports.n;
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

/* ---- arguments ------------------------------------------------------------------------------------------- */

/* Without pixels: the valid rectangle is empty, all ids are 0. */
static void put(rl_memory *m, const void *data, size_t bytes)
{
    rl_error err = {0};
    void *p;
    assert_int_equal(rl_memory_map(m, true, &p, &err), RL_OK);
    memcpy(p, data, bytes);
    assert_int_equal(rl_memory_unmap(m, &err), RL_OK);
}

static rl_memory *image_memory(void)
{
    rl_error err = {0};
    rl_memory *m;
    size_t floats = 2 * RL_GUARD + 3 * 16 * (SIZE / 4) * (SIZE / 4 + 2 * RL_MARGIN4);
    assert_int_equal(rl_memory_new(device, floats * sizeof(float), RL_GUARD * sizeof(float), &m, &err), RL_OK);
    return m;
}

/* As the executor orders them (graph/model/pass.h): ports, params, frame, materials, lights, ambient, tables. */
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
        args[n++] = f->buffers[i] < 0 ? NULL : image_memory();
    size_t extra = (p->params.n > 0) + 2u + p->lights + p->ambient + (p->tables != NULL);
    for (size_t i = 0; i < extra; i++)
        assert_int_equal(rl_memory_new(device, 1 << 18, 0, &args[n + i], &err), RL_OK);
    if (p->params.n > 0)
        put(args[n], f->params, p->params_size);
    put(args[n + (p->params.n > 0)], &frame, sizeof frame);
    return n + extra;
}

static void run_form(const form *f, const char *what)
{
    rl_memory *args[MOST_PORTS + 5] = {0};
    rl_program *program = form_build(f, what);
    size_t n = make_arguments(f, args);
    rl_error err = {0};
    for (size_t s = 0; s < f->pass->steps.n; s++) {
        if (!rl_step_runs(f->pass, &f->pass->steps.rows[s], f->params))
            continue;
        rl_dispatch d = {.entry = f->pass->steps.rows[s].entry, .arguments = args, .n_arguments = n, .dims = 3};
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
            any |= f.pass->ports.rows[k].optional;
            f.buffers[k] = f.pass->ports.rows[k].optional ? -1 : (int)k;
        }
        if (any)
            run_form(&f, "no optional port");
    }
}

/* The strict build, on which the tests above rest, refuses what only warns. */
static void test_warnings_are_seen(void **state)
{
    (void)state;
    static const char text[] = "#line 1 \"w.cl\"\nint f(int x) { if (x) return 1; }\nkernel void k(global int *p) { *p = f(*p); }\n";
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
    static const char text[] = "#line 7 \"a:b.cl\"\nint f(int x) { if (x) return 1; }\nkernel void k(global qint *p) { }\n";
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
        cmocka_unit_test(test_texts),          cmocka_unit_test(test_params),
        cmocka_unit_test(test_shared_rows),    cmocka_unit_test(test_ports),
        cmocka_unit_test(test_kernels_build),  cmocka_unit_test(test_kernel_arguments),
        cmocka_unit_test(test_warnings_are_seen), cmocka_unit_test(test_errors_have_a_place),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
