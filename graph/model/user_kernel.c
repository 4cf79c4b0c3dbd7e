/* `pass: kernel`: a pass whose ports, parameters and program the pipeline brings itself. */
#include "graph/model/pipeline_parts.h"

#include <float.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

const char *const rl_user_kernel_keys[] = {"pass", "in", "file", "entry", "ports", "params", "items"};
const size_t rl_user_kernel_n_keys = RL_ARRAY_LENGTH(rl_user_kernel_keys);

typedef struct kernel_reader {
    rl_arena *arena;
    const char *name; /* of the node */
    rl_where where;
    const rl_value *map;
    rl_pass *pass;
    rl_error *err;
} kernel_reader;

/* ---- names that OpenCL C can use
 * --------------------------------------------------------------------------------- */

static const char *const reserved[] = {
    "auto",      "bool",      "break",     "case",      "char",   "complex",   "const",      "constant",
    "continue",  "default",   "do",        "double",    "else",   "enum",      "event_t",    "extern",
    "false",     "float",     "for",       "global",    "goto",   "half",      "if",         "image1d_t",
    "image2d_t", "image3d_t", "imaginary", "inline",    "int",    "intptr_t",  "kernel",     "local",
    "long",      "pipe",      "private",   "ptrdiff_t", "quad",   "read_only", "read_write", "register",
    "restrict",  "return",    "sampler_t", "short",     "signed", "size_t",    "sizeof",     "static",
    "struct",    "switch",    "true",      "typedef",   "uchar",  "uint",      "uintptr_t",  "ulong",
    "union",     "unsigned",  "uniform",   "ushort",    "void",   "volatile",  "while",      "write_only",
};

/* "float4", "uchar16": a vector of a type of the list. */
static bool is_vector_type(const char *name)
{
    static const char *const scalars[] = {"char",  "uchar", "short",  "ushort", "int",  "uint", "long",
                                          "ulong", "float", "double", "half",   "bool", "quad"};
    static const char *const sizes[] = {"2", "3", "4", "8", "16"};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(scalars); i++) {
        size_t n = strlen(scalars[i]);
        for (size_t k = 0; k < RL_ARRAY_LENGTH(sizes) && !strncmp(name, scalars[i], n); k++)
            if (!strcmp(name + n, sizes[k]))
                return true;
    }
    return false;
}

static bool is_reserved(const char *name)
{
    /* The generated part and common.cl define macros that begin so; "__" belongs to the compiler. */
    static const char *const beginnings[] = {"RL_", "rl_", "P_", "HAS_", "WANTS_", "LAYOUT_", "__"};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(reserved); i++)
        if (!strcmp(name, reserved[i]))
            return true;
    for (size_t i = 0; i < RL_ARRAY_LENGTH(beginnings); i++)
        if (!strncmp(name, beginnings[i], strlen(beginnings[i])))
            return true;
    return is_vector_type(name);
}

static rl_code check_identifier(kernel_reader *r, const char *name, const char *what, rl_where where)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";
    size_t n = strlen(name);
    if (!n || strspn(name, letters) != n || (name[0] >= '0' && name[0] <= '9'))
        return rl_fail(r->err, RL_E_CONFIG, where,
                       "'%s' cannot be the name of %s: it has to be a C identifier (letters, digits and '_')",
                       name, what);
    if (is_reserved(name))
        return rl_fail(r->err, RL_E_CONFIG, where, "'%s' cannot be the name of %s: OpenCL C or relit uses it",
                       name, what);
    return RL_OK;
}

/* ---- small readings
 * ---------------------------------------------------------------------------------------------- */

/* An optional text; *out stays as it is without one. */
static rl_code read_text(kernel_reader *r, const rl_value *map, const char *key, const char **out)
{
    const rl_value *v = rl_value_get(map, key);
    return v ? rl_value_text(v, key, out, r->err) : RL_OK;
}

/* An optional word of "a|b|c". */
static rl_code read_word(kernel_reader *r, const rl_value *map, const char *key, const char *words, int *out)
{
    const rl_value *v = rl_value_get(map, key);
    return v ? rl_value_word(v, key, words, out, r->err) : RL_OK;
}

/* A word that must be there. */
static rl_code need_word(kernel_reader *r, const rl_entry *entry, const char *what, const char *key,
                         const char *words, int *out)
{
    const rl_value *v;
    rl_code code = rl_value_need(entry->value, key, what, entry->key, words, entry->where, &v, r->err);
    return code ? code : rl_value_word(v, key, words, out, r->err);
}

/* ---- ports
 * ------------------------------------------------------------------------------------------------------- */

static rl_code check_history(kernel_reader *r, const rl_port *ports, size_t n, size_t which, rl_where where)
{
    const rl_port *history = &ports[which];
    if (!history->of)
        return rl_fail(r->err, RL_E_CONFIG, where,
                       "port '%s' of kernel '%s' needs 'of': the port whose past it is", history->name,
                       r->name);
    const char **known = rl_arena_array(r->arena, n, sizeof *known);
    size_t n_known = 0;
    if (!known)
        return rl_fail_memory(r->err, n * sizeof *known);
    for (size_t i = 0; i < n; i++) {
        if (ports[i].role != RL_READ && ports[i].role != RL_WRITE)
            continue;
        known[n_known++] = ports[i].name;
        if (strcmp(ports[i].name, history->of) != 0)
            continue;
        if (ports[i].format == history->format)
            return RL_OK;
        return rl_fail(r->err, RL_E_CONFIG, where,
                       "port '%s' of kernel '%s' and '%s', whose past it is, differ in type", history->name,
                       r->name, history->of);
    }
    char *text =
        rl_arena_printf(r->arena, "port '%s' of kernel '%s' is the past of '%s', which is no image of it",
                        history->name, r->name, history->of);
    return rl_fail_suggest(r->err, where, text, history->of, known, n_known);
}

static rl_code read_port(kernel_reader *r, const rl_entry *entry, rl_port *port)
{
    static const char *const keys[] = {"role", "type", "optional", "of", "layout", "help"};
    int role = 0, format = 0, layout = 0;
    const rl_value *map = entry->value, *optional = rl_value_get(map, "optional"),
                   *of = rl_value_get(map, "of");
    *port = (rl_port){.name = entry->key, .help = ""};
    rl_code code = check_identifier(r, entry->key, "a port", entry->where);
    if (!code)
        code = rl_value_keys(map, "a port", keys, RL_ARRAY_LENGTH(keys), r->err);
    if (!code)
        code = need_word(r, entry, "port", "role", "read|write|history|scratch", &role);
    if (!code)
        code = need_word(r, entry, "port", "type", "rgb|normal|vec2|scalar|id", &format);
    if (!code)
        code = read_word(r, map, "layout", "linear|phase4", &layout);
    if (!code && optional)
        code = rl_value_truth(optional, "optional", &port->optional, r->err);
    if (!code)
        code = read_text(r, map, "of", &port->of);
    if (!code)
        code = read_text(r, map, "help", &port->help);
    port->role = (rl_role)role;
    port->format = (rl_format)format;
    port->layout = (rl_layout)layout;
    if (!code && port->optional && port->role != RL_READ)
        code = rl_fail(r->err, RL_E_CONFIG, optional->where,
                       "port '%s': only a port that is read can be optional", port->name);
    if (!code && of && port->role != RL_HISTORY)
        code = rl_fail(r->err, RL_E_CONFIG, of->where, "port '%s': 'of' is for ports with 'role: history'",
                       port->name);
    return code;
}

static rl_code read_ports(kernel_reader *r)
{
    const rl_value *map;
    rl_code code = rl_value_need(r->map, "ports", "kernel", r->name, "{name: {role: read, type: rgb}, …}",
                                 r->where, &map, r->err);
    if (code)
        return code;
    if (map->kind != RL_MAP)
        return rl_value_wrong(map, "ports", "a map {name: {role: read, type: rgb}, …}", r->err);
    rl_port *ports = rl_arena_array(r->arena, map->n, sizeof *ports);
    bool writes = false;
    if (!ports)
        return rl_fail_memory(r->err, map->n * sizeof *ports);
    for (size_t i = 0; !code && i < map->n; i++) {
        code = read_port(r, &map->entries[i], &ports[i]);
        writes |= ports[i].role == RL_WRITE;
    }
    for (size_t i = 0; !code && i < map->n; i++)
        if (ports[i].role == RL_HISTORY)
            code = check_history(r, ports, map->n, i, map->entries[i].where);
    if (!code && !writes)
        code =
            rl_fail(r->err, RL_E_CONFIG, map->where, "kernel '%s' has no port with 'role: write'", r->name);
    r->pass->ports.rows = ports;
    r->pass->ports.n = map->n;
    return code;
}

/* ---- parameters
 * -------------------------------------------------------------------------------------------------- */

/* words: [a, b] as "a|b". */
static rl_code read_words(kernel_reader *r, const rl_value *words, rl_param *row)
{
    if (words->kind != RL_LIST || !words->n)
        return rl_value_wrong(words, "words", "a list of words", r->err);
    const char *joined = "";
    for (size_t i = 0; i < words->n; i++) {
        const rl_value *word = words->items[i];
        if (word->kind != RL_TEXT || !word->text[0] || strchr(word->text, '|'))
            return rl_value_wrong(word, "words", "a word", r->err);
        joined = rl_arena_printf(r->arena, "%s%s%s", joined, i ? "|" : "", word->text);
        if (!joined)
            return rl_fail_memory(r->err, words->n);
    }
    row->words = joined;
    return RL_OK;
}

static rl_code read_range(kernel_reader *r, const rl_value *range, rl_param *row)
{
    double limits[2] = {row->min, row->max};
    if (range && (row->type == RL_BOOL || row->type == RL_ENUM))
        return rl_fail(r->err, RL_E_CONFIG, range->where, "parameter '%s': 'range' is for numbers",
                       row->name);
    rl_code code = range ? rl_value_numbers(range, "range", 2, limits, r->err) : RL_OK;
    if (!code && !(limits[0] <= limits[1]))
        code = rl_value_wrong(range, "range", "[least, most]", r->err);
    row->min = limits[0];
    row->max = limits[1];
    return code;
}

/* `value` is the default: it is read as any value of the row would be. */
static rl_code read_default(kernel_reader *r, const rl_entry *entry, rl_param *row)
{
    const rl_value *v;
    union {
        float f[3];
        int32_t i;
    } value;
    rl_code code =
        rl_value_need(entry->value, "value", "parameter", row->name, "its default", entry->where, &v, r->err);
    if (!code)
        code = rl_param_read(row, v, &value, r->err);
    for (size_t i = 0; !code && i < 3; i++)
        row->def[i] = row->type == RL_RGBF  ? (double)value.f[i]
                      : row->type == RL_F32 ? (double)value.f[0]
                                            : (double)value.i;
    return code;
}

static rl_code read_param(kernel_reader *r, const rl_entry *entry, rl_param *row)
{
    static const char *const keys[] = {"type", "value", "range", "unit", "help", "words"};
    static const rl_type types[] = {RL_F32, RL_I32, RL_BOOL, RL_RGBF, RL_ENUM};
    int type = 0;
    *row = (rl_param){.name = entry->key, .offset = r->pass->params_size, .unit = "", .help = ""};
    rl_code code = check_identifier(r, entry->key, "a parameter", entry->where);
    for (size_t i = 0; !code && i < rl_user_kernel_n_keys; i++)
        if (!strcmp(entry->key, rl_user_kernel_keys[i]))
            code = rl_fail(r->err, RL_E_CONFIG, entry->where,
                           "'%s' cannot be the name of a parameter: it is a key of the kernel itself",
                           entry->key);
    if (!code)
        code = rl_value_keys(entry->value, "a parameter", keys, RL_ARRAY_LENGTH(keys), r->err);
    if (!code)
        code = need_word(r, entry, "parameter", "type", "float|int|bool|rgb|enum", &type);
    if (code)
        return code;
    const rl_value *words = rl_value_get(entry->value, "words");
    row->type = types[type];
    row->min = row->type == RL_I32 ? (double)INT32_MIN : (double)-FLT_MAX;
    row->max = row->type == RL_I32 ? (double)INT32_MAX : (double)FLT_MAX;
    if (words && row->type != RL_ENUM && row->type != RL_I32)
        code = rl_fail(r->err, RL_E_CONFIG, words->where, "parameter '%s': 'words' is for enum and int",
                       row->name);
    else if (words)
        code = read_words(r, words, row);
    else if (row->type == RL_ENUM)
        code = rl_fail(r->err, RL_E_CONFIG, entry->where, "parameter '%s' needs 'words': [one, another]",
                       row->name);
    if (!code)
        code = read_range(r, rl_value_get(entry->value, "range"), row);
    if (!code)
        code = read_text(r, entry->value, "unit", &row->unit);
    if (!code)
        code = read_text(r, entry->value, "help", &row->help);
    if (!code)
        code = read_default(r, entry, row);
    r->pass->params_size += RL_PARAM_BYTES(row->type);
    return code;
}

static rl_code read_params(kernel_reader *r)
{
    const rl_value *map = rl_value_get(r->map, "params");
    if (!map)
        return RL_OK;
    if (map->kind != RL_MAP)
        return rl_value_wrong(map, "params", "a map {name: {type: float, value: 0}, …}", r->err);
    rl_param *rows = rl_arena_array(r->arena, map->n, sizeof *rows);
    if (!rows)
        return rl_fail_memory(r->err, map->n * sizeof *rows);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < map->n; i++)
        code = read_param(r, &map->entries[i], &rows[i]);
    r->pass->params.rows = rows;
    r->pass->params.n = map->n;
    return code;
}

/* ---- the program
 * ------------------------------------------------------------------------------------------------- */

static rl_code read_program(kernel_reader *r)
{
    const rl_value *file;
    rl_error why = {0};
    char *data = NULL;
    size_t size;
    rl_code code = rl_value_need(r->map, "file", "kernel", r->name, "the .cl file with its program", r->where,
                                 &file, r->err);
    if (!code)
        code = rl_value_text(file, "file", &r->pass->kernel_file, r->err);
    if (code)
        return code;
    r->pass->kernel_file = rl_value_path(r->arena, file);
    if (!r->pass->kernel_file)
        return rl_fail_memory(r->err, 0);
    code = rl_file_read(r->pass->kernel_file, &data, &size, &why);
    if (code)
        return rl_fail(r->err, code, file->where, "kernel '%s': file '%s' %s", r->name, r->pass->kernel_file,
                       why.text);
    if (memchr(data, 0, size))
        code = rl_fail(r->err, RL_E_FORMAT, file->where, "kernel '%s': file '%s' is not text", r->name,
                       r->pass->kernel_file);
    else if (!(r->pass->kernel_text = rl_arena_strndup(r->arena, data, size)))
        code = rl_fail_memory(r->err, size);
    rl_free(data);
    return code;
}

static rl_code read_step(kernel_reader *r)
{
    static const rl_domain domains[] = {RL_EVERY_PIXEL, RL_EVERY_VECTOR, RL_EVERY_PHASE};
    const rl_value *entry;
    int items = 0;
    rl_step *step = rl_arena_alloc(r->arena, sizeof *step);
    if (!step)
        return rl_fail_memory(r->err, sizeof *step);
    rl_code code = rl_value_need(r->map, "entry", "kernel", r->name,
                                 "the name of the kernel function in its file", r->where, &entry, r->err);
    if (!code)
        code = rl_value_text(entry, "entry", &step->entry, r->err);
    if (!code)
        code = check_identifier(r, step->entry, "a kernel function", entry->where);
    if (!code)
        code = read_word(r, r->map, "items", "pixel|vector|phase", &items);
    step->domain = domains[items];
    r->pass->steps.rows = step;
    r->pass->steps.n = 1;
    return code;
}

rl_code rl_user_kernel_read(rl_arena *arena, const rl_entry *node, const rl_pass **out, rl_error *err)
{
    rl_pass *pass = rl_arena_alloc(arena, sizeof *pass);
    if (!pass)
        return rl_fail_memory(err, sizeof *pass);
    kernel_reader r = {arena, node->key, node->where, node->value, pass, err};
    pass->name = "kernel";
    pass->help = "a kernel of the pipeline's own";
    rl_code code = read_program(&r);
    if (!code)
        code = read_step(&r);
    if (!code)
        code = read_ports(&r);
    if (!code)
        code = read_params(&r);
    if (!code)
        *out = pass;
    return code;
}
