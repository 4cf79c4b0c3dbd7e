#include "graph/run/color.h"

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/run/color_bake.h"
#include "graph/run/color_emit.h"

/* ---- names ------------------------------------------------------------------------------------------- */

/* "… has no <what> 'name'; did you mean …? known: …", with the names of a list. */
static rl_code unknown(const rl_ocio *ocio, rl_ocio_list list, const char *of, const char *what,
                       const char *name, rl_where where, rl_error *err)
{
    rl_arena arena = {0};
    rl_str text = {0};
    rl_ocio_names names;
    rl_code code = rl_ocio_list_names(ocio, list, of, &arena, &names, err);
    if (code != RL_OK)
        goto done;
    if (of)
        rl_str_printf(&text, "display '%s' of the colour configuration has no %s '%s'", of, what, name);
    else
        rl_str_printf(&text, "the colour configuration has no %s '%s'", what, name);
    rl_suggest(&text, name, names.names, names.n, "known");
    if (!names.n)
        rl_str_add(&text, ": it has none");
    if (!strcmp(name, "lin_rec709"))
        rl_str_add(&text, " (lights and albedo are in lin_rec709 unless their 'colorspace' says otherwise)");
    code = rl_fail(err, RL_E_CONFIG, where, "%s", rl_str_text(&text));
done:
    rl_str_free(&text);
    rl_arena_free(&arena);
    return code;
}

rl_code rl_color_space(const rl_ocio *ocio, const char *name, rl_where where, const char **out, rl_error *err)
{
    *out = rl_ocio_space(ocio, name);
    return *out ? RL_OK : unknown(ocio, RL_OCIO_SPACES, NULL, "colour space", name, where, err);
}

rl_code rl_color_working(const rl_ocio *ocio, rl_where where, const char **out, rl_error *err)
{
    *out = rl_ocio_space(ocio, "scene_linear");
    if (*out)
        return RL_OK;
    return rl_fail(
        err, RL_E_CONFIG, where,
        "the colour configuration has no role 'scene_linear'; set color.working to a colour space");
}

/* One name against one list. */
static rl_code check_name(const rl_ocio *ocio, rl_ocio_list list, const char *of, const char *what,
                          const char *name, rl_where where, rl_error *err)
{
    rl_arena arena = {0};
    rl_ocio_names names;
    bool found = false;
    if (!name)
        return rl_fail(err, RL_E_CONFIG, where, "a %s is needed", what);
    rl_code code = rl_ocio_list_names(ocio, list, of, &arena, &names, err);
    for (size_t i = 0; code == RL_OK && i < names.n; i++)
        found = found || strcmp(names.names[i], name) == 0;
    rl_arena_free(&arena);
    if (code != RL_OK || found)
        return code;
    return unknown(ocio, list, of, what, name, where, err);
}

rl_code rl_color_view(const rl_ocio *ocio, const char *display, const char *view, const char *look,
                      rl_where where, rl_error *err)
{
    rl_code code = check_name(ocio, RL_OCIO_DISPLAYS, NULL, "display", display, where, err);
    if (code == RL_OK && view)
        code = check_name(ocio, RL_OCIO_VIEWS, display, "view", view, where, err);
    if (code == RL_OK && look)
        code = check_name(ocio, RL_OCIO_LOOKS, NULL, "look", look, where, err);
    return code;
}

static rl_code check_request(const rl_ocio *ocio, const rl_ocio_request *request, rl_where where,
                             rl_error *err)
{
    const char *space;
    rl_code code = rl_color_space(ocio, request->from, where, &space, err);
    if (code != RL_OK)
        return code;
    if (!request->to)
        return rl_color_view(ocio, request->display, request->view, request->look, where, err);
    code = rl_color_space(ocio, request->to, where, &space, err);
    if (code == RL_OK && request->look)
        code = check_name(ocio, RL_OCIO_LOOKS, NULL, "look", request->look, where, err);
    return code;
}

/* ---- the pass ---------------------------------------------------------------------------------------- */

static const rl_param params[] = {
    P(rl_color_params, RL_F32, exposure, -64, 64, 0, "stops", "colours are multiplied by 2^exposure first"),
};
RL_PARAMS_MATCH(rl_color_params, 1);

static const rl_port ports[] = {
    {"in", RL_READ, RL_RGB, "colours in the working space", .layout = RL_LINEAR},
    {"out", RL_WRITE, RL_RGB, "the same in another space, or as a display shows them", .layout = RL_LINEAR},
};

static const rl_step steps[] = {{"color_apply", .domain = RL_EVERY_VECTOR}};

static rl_code give_tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    const rl_tables *ready = in->pass->data;
    (void)arena;
    (void)err;
    *out = *ready;
    return RL_OK;
}

static void add_pieces(rl_str *s, const char *const *pieces)
{
    for (; *pieces; pieces++)
        rl_str_add(s, *pieces);
}

/* With COLOR_VECTORS, every other item does its neighbour's vector too; columns are a multiple of 64. */
static void write_program(rl_str *s, const rl_color_text *t)
{
    if (!t->table_n)
        rl_str_add(s, rl_color_wide);
    add_pieces(s, rl_color_prelude);
    if (t->table_n)
        add_pieces(s, rl_color_tables);
    rl_str_printf(
        s,
        "#ifndef COLOR_VECTORS\n#define COLOR_VECTORS 1\n#define color_load rl_load\n#define color_store "
        "rl_store\n#endif\n"
        "\nkernel void color_apply(global const float *in, global float *out, constant params_t *p, "
        "constant frame_t *f,\n                        constant material_t *materials%s)\n{\n",
        t->table_n ? ", constant float *tables" : "");
    rl_str_add(s, "    if (get_global_id(0) % COLOR_VECTORS)\n        return;\n"
                  "    int i = rl_index(f, RL_W * (int)get_global_id(0), (int)get_global_id(1));\n"
                  "    floatv gain = rl_c_exp2(K(p->exposure));\n"
                  "    floatv r = gain * color_load(in, i), g = gain * color_load(in, i + f->plane);\n"
                  "    floatv b = gain * color_load(in, i + 2 * f->plane);\n");
    rl_str_addn(s, rl_str_text(&t->body), t->body.length);
    rl_str_add(s, "    color_store(r, out, i);\n    color_store(g, out, i + f->plane);\n"
                  "    color_store(b, out, i + 2 * f->plane);\n}\n");
    s->failed = s->failed || t->body.failed;
}

static rl_code finish_pass(const rl_color_text *t, rl_arena *arena, const rl_pass **out, rl_error *err)
{
    rl_str program = {0};
    rl_pass *pass = rl_arena_alloc(arena, sizeof *pass);
    rl_tables *tables = rl_arena_alloc(arena, sizeof *tables);
    write_program(&program, t);
    char *text = program.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&program));
    rl_code code = pass && tables && text && !t->no_memory ? RL_OK : rl_fail_memory(err, program.length);
    if (code == RL_OK) {
        *tables = (rl_tables){t->table, t->table_n};
        *pass = (rl_pass){
            .name = "color",
            .help = "a transform of OpenColorIO as a program",
            .kernel_text = text,
            .kernel_file = "(generated from the colour configuration)",
            .params = RL_ARRAY(params),
            .params_size = sizeof(rl_color_params),
            .ports = RL_ARRAY(ports),
            .steps = RL_ARRAY(steps),
            .tables = t->table_n ? give_tables : NULL,
            .data = tables,
        };
        *out = pass;
    }
    rl_str_free(&program);
    return code;
}

/* "matrix, fixed function, …": what a reader of `relit plan` sees. */
static const char *describe(const rl_op *ops, size_t n, rl_arena *arena)
{
    rl_str s = {0};
    rl_str_printf(&s, "%zu operations", n);
    for (size_t i = 0; i < n; i++)
        rl_str_printf(&s, "%s %s", i ? "," : ":", ops[i].name);
    char *text = s.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&s));
    rl_str_free(&s);
    return text;
}

/* All operations as text, or, when one of them has no generator, the whole transform as a table. */
static rl_code generate(const rl_ocio_transform *transform, const rl_op *ops, size_t n, rl_where where,
                        const rl_log *log, rl_color_text *text, rl_color_pass *out, rl_error *err)
{
    for (size_t i = 0; i < n; i++) {
        if (rl_color_emit(text, &ops[i]))
            continue;
        rl_str_free(&text->body);
        text->table_n = 0;
        rl_code code = rl_color_bake(transform, text, &out->error, err);
        if (code != RL_OK)
            return code;
        out->baked = true;
        rl_report(log, RL_WARNING, where,
                  "the colour operation '%s' has no exact form in relit: a table of 65x65x65 colours stands "
                  "for the "
                  "transform, off by up to %.2g of full scale",
                  ops[i].name, out->error);
        return RL_OK;
    }
    return text->no_memory || text->body.failed ? rl_fail_memory(err, 0) : RL_OK;
}

rl_code rl_color_pass_new(const rl_ocio *ocio, const rl_ocio_request *request, bool exposed, rl_where where,
                          rl_arena *arena, const rl_log *log, rl_color_pass *out, rl_error *err)
{
    rl_ocio_transform *transform = NULL;
    rl_color_text text = {.arena = arena};
    rl_op *ops;
    size_t n;
    *out = (rl_color_pass){0};
    rl_code code = check_request(ocio, request, where, err);
    if (code == RL_OK)
        code = rl_ocio_transform_new(ocio, request, &transform, err);
    if (code == RL_OK)
        code = rl_ocio_ops(transform, arena, &ops, &n, err);
    if (code != RL_OK)
        goto done;
    if (n == 0 && !exposed) {
        out->note = "the transform changes nothing";
        goto done;
    }
    code = generate(transform, ops, n, where, log, &text, out, err);
    if (code == RL_OK)
        code = finish_pass(&text, arena, &out->pass, err);
    if (code == RL_OK)
        out->note = describe(ops, n, arena);
    if (code == RL_OK && !out->note)
        code = rl_fail_memory(err, 0);
done:
    rl_str_free(&text.body);
    rl_ocio_transform_free(&transform);
    return code;
}
