/* What a pass is. A pass is a const descriptor at the end of passes/NAME.c (or one that is built at run time,
 * for user kernels and colour transforms); nothing in the engine knows a pass by its name.
 *
 * The tables here are the only truth: they drive parsing, range checks, --set, did-you-mean, `relit passes`,
 * the documentation, the OpenCL struct that the kernel sees and the order of the kernel's arguments:
 *
 *     one buffer a port, in the order of the ports (NULL for an optional port that nothing feeds; none for
 *                              a REDUCTION, and what is .with it, that nobody asks for)
 *     constant params_t *      the parameters, in the order of their rows (absent when there are none)
 *     constant frame_t *       size, number, cameras            (kernels/shared.h)
 *     constant material_t *    one entry a dense stencil index  (generated: every registered pass's rows)
 *     constant light_t *       when .lights is set
 *     constant ambient_t *     when .ambient is set
 *     global const float *     when .light_tables is set: profiles of the lights; NULL: no light has one
 *     global const float *     the same: mirror images of the sky; NULL: there is none
 *     constant float *         when .tables is set: what the host computed (global const float * when it may
 *                              be more than the 64 KiB that every device has as constant memory)
 */
#ifndef RL_MODEL_PASS_H
#define RL_MODEL_PASS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- parameters ---------------------------------------------------------------------------------------- */

/* All are made of 4-byte scalars, so that host and device structs are equal. */
typedef enum rl_type {
    RL_F32,  /* float */
    RL_I32,  /* int32_t; may have words: word i reads as -1-i ("auto" = -1) */
    RL_BOOL, /* int32_t 0 or 1 */
    RL_ENUM, /* int32_t: index into words */
    RL_RGBF, /* float[3]; one number in YAML means three equal ones */
    RL_ROWS, /* a list of min … max maps of further rows (.list): int32_t NAME_n, then for each of those rows
                an array NAME_ROW[max], RGB rows [3 * max]; elements beyond NAME_n are 0 */
    RL_MATERIALS, /* a set of materials, by name, stencil name or id: uint32_t[8], bit id & 31 of word id >> 5
                     for dense index id. Parameters of a pass only; filled per capture, since stencil names
                     are the capture's */
} rl_type;

struct rl_param;

typedef struct rl_params {
    const struct rl_param *rows;
    size_t n;
} rl_params;

/* One way to give the value of a profile row in other terms, chosen by a word of another row (.form_row). */
typedef struct rl_form {
    const char *word; /* of the .form_row */
    const char
        *from[2]; /* the profile rows that it is computed from, one or two; no other form's may be given */
    double (*derive)(const double from[2]); /* of one channel; pure. NULL: the row is given itself (.from is
                                               its own name) */
    const char *formula;                    /* one line for people */
    const char *source;                     /* paper, equation, program */
} rl_form;

typedef struct rl_forms {
    const rl_form *rows;
    size_t n;
} rl_forms;

/* A row of a table of parameters, or of profile, material or shading keys. */
typedef struct rl_param {
    const char *name; /* as in YAML and, the same, as a field of the struct */
    rl_type type;
    size_t offset;      /* in the pass's own struct; not used by rows of materials and profiles */
    double min, max;    /* inclusive, compared in double before narrowing */
    double def[3];      /* default; RL_ENUM and RL_I32 words: the value they stand for */
    const char *words;  /* "screen|tangent", for RL_ENUM and RL_I32; else NULL */
    const char *unit;   /* "ratio", "mm", "stops", "" */
    const char *help;   /* one line, lower case, no full stop */
    const char *source; /* where the idea is from, or NULL */
    bool structural;    /* a #define P_NAME for the program, since the code itself depends on it */
    bool required; /* profile rows: every profile that a material uses must give it, when a pass of the graph
                      declares it so; rows of a list: every element must */
    bool no_default; /* rows of the material table with min >= 0: the device sees -1 where it is not given */
    const char
        *required_with;    /* profile rows, "KEY=a|b": required of profiles whose KEY is one of the words */
    const char *needed_by; /* profile rows with no_default, "diffuse: sg": required of the profiles of
                              materials with that shading word (graph.h), */
    const char *instead;   /* unless the profile gives this other row; or NULL */
    const char *form_row;  /* profile rows of numbers with no_default: the row whose word says which of .forms
                              is given */
    rl_forms forms;        /* one for each of that row's words; what they derive must be within min … max */
    rl_params list;        /* RL_ROWS: the keys of an element, none of them RL_ROWS */
    double
        most_sum; /* float rows of a list, > 0: what the elements add up to at most, each channel (+1e-6) */
} rl_param;

#define RL_ARRAY_LENGTH(a) (sizeof(a) / sizeof *(a))
/* A designated pair: `.params = RL_ARRAY(params)` fills rows and n. */
#define RL_ARRAY(a)                                                                                          \
    {                                                                                                        \
        (a), RL_ARRAY_LENGTH(a)                                                                              \
    }

/* The last argument is the help, more fields may follow it. A row of a pass's struct: P(taa_params, RL_F32,
 * blend, 0, 1, 0.05, "ratio", "least weight …", .source = …) */
#define P(struct_, type_, field, min_, max_, def_, unit_, ...)                                               \
    {                                                                                                        \
        .name = #field, .type = (type_), .offset = offsetof(struct_, field), .min = (min_), .max = (max_),   \
        .def = {(def_), (def_), (def_)}, .unit = (unit_), .help = __VA_ARGS__                                \
    }
/* The same for one of a list of words; def_ is the index of the default. */
#define P_ENUM(struct_, field, words_, def_, ...)                                                            \
    {                                                                                                        \
        .name = #field, .type = RL_ENUM, .offset = offsetof(struct_, field), .min = 0, .max = 1e9,           \
        .def = {(def_), (def_), (def_)}, .words = (words_), .unit = "", .help = __VA_ARGS__                  \
    }
/* A set of materials, empty by default. */
#define P_MATERIALS(struct_, field, ...)                                                                     \
    {                                                                                                        \
        .name = #field, .type = RL_MATERIALS, .offset = offsetof(struct_, field), .unit = "",                \
        .help = __VA_ARGS__                                                                                  \
    }
/* Rows of the material table (profile, material, shading keys): no struct on the host. */
#define M(type_, field, min_, max_, def_, unit_, ...)                                                        \
    {                                                                                                        \
        .name = #field, .type = (type_), .min = (min_), .max = (max_), .def = {(def_), (def_), (def_)},      \
        .unit = (unit_), .help = __VA_ARGS__                                                                 \
    }
#define M_ENUM(field, words_, def_, ...)                                                                     \
    {                                                                                                        \
        .name = #field, .type = RL_ENUM, .min = 0, .max = 1e9, .def = {(def_), (def_), (def_)},              \
        .words = (words_), .unit = "", .help = __VA_ARGS__                                                   \
    }
/* least_ … most_ maps whose keys are the array rows_. */
#define M_ROWS(field, rows_, least_, most_, ...)                                                             \
    {                                                                                                        \
        .name = #field, .type = RL_ROWS, .min = (least_), .max = (most_), .unit = "",                        \
        .list = RL_ARRAY(rows_), .help = __VA_ARGS__                                                         \
    }

/* Of all types but RL_ROWS: rl_param_bytes in params.h has those too. */
#define RL_PARAM_BYTES(type) ((type) == RL_RGBF ? 12u : (type) == RL_MATERIALS ? 4u * RL_SET_WORDS : 4u)
#define RL_SET_WORDS         8u /* of RL_MATERIALS: room for 256 materials, the empty one included */

/* ---- ports --------------------------------------------------------------------------------------------- */

typedef enum rl_role {
    RL_READ,
    RL_WRITE,
    RL_HISTORY, /* what the port named by .of held one frame before; never aliased, makes no ordering edge */
    RL_SCRATCH, /* between the steps of this pass; nobody else sees it */
    RL_REDUCTION, /* sums over the frame that the host reads, of format RL_SUMS; nobody binds them. What only
                     they need (.with, here and in steps) exists when an output asks for them: then WANTS_NAME
                     is 1, else 0, and the kernels have no such arguments */
} rl_role;

typedef enum rl_format {
    RL_RGB,    /* 3 planes: R G B */
    RL_NORMAL, /* 3 planes: X Y Z, world space, unit */
    RL_VEC2,   /* 2 planes: X Y */
    RL_SCALAR, /* 1 plane */
    RL_ID,     /* 1 plane of uint: dense stencil index, 0 = no material */
    RL_LIGHTS, /* a plane for each light that has the layer, in the order of the lights (light_t says which)
                */
    RL_SUMS,   /* no planes: RL_SUM_FLOATS floats a frame, whatever its size (kernels/shared.h) */
} rl_format;

typedef enum rl_layout {
    RL_LINEAR, /* rows, one after the other */
    RL_PHASE4, /* 16 sub-images, (y&3)*4 + (x&3): every 4th pixel is a neighbour (kernels/shared.h) */
} rl_layout;

typedef struct rl_port {
    const char *name; /* as in YAML; the kernel's argument. A pass may read and write under one name. */
    rl_role role;
    rl_format format;
    const char *help;
    bool optional;         /* READ: may be absent; the kernel sees NULL and HAS_NAME 0 */
    const char *if_absent; /* optional READ: what the pass does without it, said once in the log; NULL = not
                              worth a word */
    const char *missed_by; /* optional READ: "transmission: thin|thick", a profile key of this pass and words
                              of it; where a material's profile has one of them, and neither this port nor */
    const char *instead;   /* this other one (or NULL) has an image, the log says */
    const char *if_missed; /* what comes of it */
    const char
        *needed_by; /* optional READ: "diffuse: sg" is a shading key of this pass and a word of it; a material
                       with a profile and that word makes the port required (graph.h); NULL = none does */
    const char *without; /* SCRATCH: an optional port; there is memory only where nothing feeds that */
    const char *with;    /* SCRATCH: the REDUCTION port that it exists for; NULL = always */
    const char
        *when; /* SCRATCH: a structural parameter; there is memory only where it is .is; NULL = always */
    int32_t is;
    const char *of;   /* HISTORY: the port (own output first, else own input) whose past this is */
    rl_layout layout; /* the layout that the kernel wants; the plan inserts the conversion */
    bool any_layout;  /* WRITE: the kernel stores through RL_STORE, so the plan may choose (LAYOUT_NAME) */
} rl_port;

/* Whether a port makes an image of the graph. */
static inline bool rl_port_makes(const rl_port *port)
{
    return port->role == RL_WRITE || port->role == RL_REDUCTION;
}

/* Ports that nobody asked for, as others have none, are no arguments of the kernels. */
static inline bool rl_port_on_request(const rl_port *port)
{
    return port->role == RL_REDUCTION || port->with;
}

/* ---- steps --------------------------------------------------------------------------------------------- */

typedef enum rl_domain {
    RL_EVERY_PIXEL,  /* an item a pixel: get_global_id(0) = x, (1) = y, buffer coordinates */
    RL_EVERY_VECTOR, /* an item RL_W pixels of a row: x = RL_W*get_global_id(0), y = (1) */
    RL_EVERY_PHASE,  /* an item RL_W pixels of one sub-image of RL_PHASE4: (0) = phase, (1) = vector, (2) =
                        sub-row */
    RL_EVERY_BAND,   /* an item every RL_BANDS-th part of the rows: (0) = band (kernels/energy.cl) */
} rl_domain;

typedef struct rl_step {
    const char *entry; /* the kernel function; its arguments are those of the pass */
    rl_domain domain;
    const char *when; /* a structural parameter: the step runs only where it is .is; NULL = always */
    int32_t is;
    const char *with;    /* a REDUCTION port: the step runs only when an output asks for it; NULL = always */
    const char *without; /* an optional port: the step runs only where nothing feeds it; NULL = always */
} rl_step;

/* ---- the pass ------------------------------------------------------------------------------------------ */

/* What the host-side hook of a pass may read. */
typedef struct rl_pass_input {
    const struct rl_pass *pass;           /* the pass itself, for its .data */
    const void *params;                   /* the pass's struct */
    const struct rl_materials *materials; /* resolved; read with rl_material_* below */
} rl_pass_input;

typedef struct rl_tables {
    float *data; /* in the arena */
    size_t n;
} rl_tables;

typedef struct rl_pass {
    const char *name;
    const char *help;           /* one line */
    const char *source;         /* paper, talk, equation */
    const char *kernel;         /* file in kernels/, or NULL when kernel_text is set */
    const char *kernel_prelude; /* other files in kernels/, put in front of it: "a.cl b.cl"; NULL = none */
    const char
        *kernel_text; /* the program itself, for passes built at run time; named kernel_file in errors */
    const char *kernel_file;
    rl_params params;
    size_t params_size; /* sizeof the pass's struct; RL_PARAMS_MATCH proves it equal to the table */
    rl_params profile_keys, material_keys, shading_keys; /* rows of the material table that it reads */
    struct {
        const rl_port *rows;
        size_t n;
    } ports;
    struct {
        const rl_step *rows;
        size_t n;
    } steps;
    bool lights;       /* the kernel gets the lights, and the run the shadow layers that they use */
    bool ambient;      /* the kernel gets the ambient light */
    bool light_tables; /* the kernel gets the tables that light_t and ambient_t point into (kernels/shared.h)
                        */
    /* Computes constant tables from parameters and materials, in double, into `arena`; NULL = none. Pure. */
    rl_code (*tables)(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err);
    const void *data; /* for .tables of a pass that is built at run time; the engine does not look at it */
    /* Passes with HISTORY ports: the least share that a frame has in its own result, so that the share of
     * what is k frames old is at most (1 - it)^k; NULL = not known. `fades_where`: where that holds, and what
     * holds elsewhere. */
    double (*least_share)(const void *params);
    const char *fades_where;
    /* "transmission: gather", a profile key of the pass and a word of it, that no other pass fulfils: a graph
     * that reads the key elsewhere needs this pass too (graph.h). A shading key of that name that is false
     * switches it off. NULL: there is no such word. */
    const char *fulfils;
    /* Passes with a parameter `seed`: whether the result depends on it; `march`: some light has `shadow:
     * screen`. NULL: it always does. */
    bool (*stochastic)(const void *params, bool march);
    /* What the arithmetic of a pixel costs, as so many reads or writes of a plane: a rough figure from `relit
     * bench`, for predictions. NULL: next to nothing. `params` is the pass's struct. */
    double (*cost)(const void *params);
    bool conserves; /* what its ledger (graph/run/energy.h) says to come out should be what goes in */
} rl_pass;

/* The struct holds the table's 4-byte fields and nothing else; RGB rows count three. */
#define RL_PARAMS_MATCH(struct_, scalars)                                                                    \
    _Static_assert(sizeof(struct_) == 4 * (scalars), #struct_ " does not match its table of parameters")

/* ---- materials, as passes read them ----------------------------------------------------------------------
 */

/* Number of entries, the empty one (index 0) included. */
size_t rl_material_count(const struct rl_materials *m);
bool rl_material_has_profile(const struct rl_materials *m, size_t material);
/* The value of a row as every pass sees it: `group` is "profile", "material" or "shading". Writes 1 or 3
 * numbers to out (RGB rows 3); false when no registered pass declares such a row. A list's name gives its
 * number of elements, "gaussians.0.weight" a value of one; false beyond the last. */
bool rl_material_get(const struct rl_materials *m, size_t material, const char *group, const char *key,
                     double out[3]);

/* ---- the registry (graph/model/registry.c: one line a pass) ----------------------------------------------
 */

size_t rl_pass_count(void);
const rl_pass *rl_pass_at(size_t i);
const rl_pass *rl_pass_find(const char *name); /* NULL when there is none */

#ifdef __cplusplus
}
#endif
#endif
