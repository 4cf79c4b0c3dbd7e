/* Attributes of EXR files: as numbers and text, out of a file and into one. */
#include "graph/run/exr_core.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"

/* ours, the core's, the core's name for the struct and its setter, the type of its elements, how many */
#define NUMBER_TYPES(X)                                                                                      \
    X(RL_EXR_T_V2I, EXR_ATTR_V2I, v2i, int32_t, 2)                                                           \
    X(RL_EXR_T_V2F, EXR_ATTR_V2F, v2f, float, 2)                                                             \
    X(RL_EXR_T_V2D, EXR_ATTR_V2D, v2d, double, 2)                                                            \
    X(RL_EXR_T_V3I, EXR_ATTR_V3I, v3i, int32_t, 3)                                                           \
    X(RL_EXR_T_V3F, EXR_ATTR_V3F, v3f, float, 3)                                                             \
    X(RL_EXR_T_V3D, EXR_ATTR_V3D, v3d, double, 3)                                                            \
    X(RL_EXR_T_M33F, EXR_ATTR_M33F, m33f, float, 9)                                                          \
    X(RL_EXR_T_M33D, EXR_ATTR_M33D, m33d, double, 9)                                                         \
    X(RL_EXR_T_M44F, EXR_ATTR_M44F, m44f, float, 16)                                                         \
    X(RL_EXR_T_M44D, EXR_ATTR_M44D, m44d, double, 16)                                                        \
    X(RL_EXR_T_BOX2I, EXR_ATTR_BOX2I, box2i, int32_t, 4)                                                     \
    X(RL_EXR_T_BOX2F, EXR_ATTR_BOX2F, box2f, float, 4)                                                       \
    X(RL_EXR_T_CHROMATICITIES, EXR_ATTR_CHROMATICITIES, chromaticities, float, 8)                            \
    X(RL_EXR_T_TIMECODE, EXR_ATTR_TIMECODE, timecode, uint32_t, 2)

int rl_exr_type_numbers(rl_exr_type type)
{
    switch (type) {
#define COUNT(ours, core, member, element, n)                                                                \
    case ours:                                                                                               \
        return n;
        NUMBER_TYPES(COUNT)
#undef COUNT
    case RL_EXR_T_INT:
    case RL_EXR_T_FLOAT:
    case RL_EXR_T_DOUBLE:
        return 1;
    case RL_EXR_T_RATIONAL:
        return 2;
    default:
        return 0;
    }
}

/* ---- reading ---- */

static void value_of(const exr_attribute_t *a, rl_exr_value *out)
{
    *out = (rl_exr_value){0};
    switch (a->type) {
#define READ(ours, core, member, element, n)                                                                 \
    case core: {                                                                                             \
        element e[n];                                                                                        \
        memcpy(e, a->member, sizeof e);                                                                      \
        out->type = ours;                                                                                    \
        for (int i = 0; i < n; i++)                                                                          \
            out->v[i] = (double)e[i];                                                                        \
        break;                                                                                               \
    }
        NUMBER_TYPES(READ)
#undef READ
    case EXR_ATTR_RATIONAL:
        out->type = RL_EXR_T_RATIONAL;
        out->v[0] = a->rational->num;
        out->v[1] = a->rational->denom;
        break;
    case EXR_ATTR_INT:
        out->type = RL_EXR_T_INT;
        out->v[0] = a->i;
        break;
    case EXR_ATTR_FLOAT:
        out->type = RL_EXR_T_FLOAT;
        out->v[0] = (double)a->f;
        break;
    case EXR_ATTR_DOUBLE:
        out->type = RL_EXR_T_DOUBLE;
        out->v[0] = a->d;
        break;
    case EXR_ATTR_STRING:
        out->type = RL_EXR_T_STRING;
        out->text = a->string->str ? a->string->str : "";
        break;
    default:
        break;
    }
}

static const exr_attribute_t *attr_named(const rl_exr *file, int part, const char *name)
{
    /* By hand: the core would call its error handler when there is none. */
    for (size_t i = 0; i < file->parts[part].n_attrs; i++) {
        const exr_attribute_t *a;
        if (!exr_get_attribute_by_index(file->ctx, part, EXR_ATTR_LIST_FILE_ORDER, (int32_t)i, &a) &&
            !strcmp(a->name, name))
            return a;
    }
    return NULL;
}

bool rl_exr_attr(const rl_exr *file, int part, const char *name, rl_exr_value *out)
{
    const exr_attribute_t *a = attr_named(file, part, name);
    if (a)
        value_of(a, out);
    return a != NULL;
}

const exr_attribute_t *rl_exr_attr_raw(const rl_exr *file, int part, size_t i)
{
    const exr_attribute_t *a = NULL;
    if (i >= file->parts[part].n_attrs ||
        exr_get_attribute_by_index(file->ctx, part, EXR_ATTR_LIST_FILE_ORDER, (int32_t)i, &a))
        return NULL;
    return a;
}

void rl_exr_attr_at(const rl_exr *file, int part, size_t i, const char **name, const char **type,
                    rl_exr_value *out)
{
    const exr_attribute_t *a = rl_exr_attr_raw(file, part, i);
    if (name)
        *name = a ? a->name : "";
    if (type)
        *type = a ? a->type_name : "";
    if (out && a)
        value_of(a, out);
    else if (out)
        *out = (rl_exr_value){0};
}

/* ---- writing ---- */

/* A double of an attribute as the file's integer; a value that is none becomes the nearest. */
static int32_t to_int32(double v)
{
    return v >= INT32_MAX ? INT32_MAX : v <= INT32_MIN ? INT32_MIN : (int32_t)lrint(v);
}

static uint32_t to_uint32(double v)
{
    return v >= UINT32_MAX ? UINT32_MAX : v <= 0 ? 0 : (uint32_t)llrint(v);
}

static float to_float(double v)
{
    return (float)v;
}

static double to_double(double v)
{
    return v;
}

#define CONVERT_int32_t  to_int32
#define CONVERT_uint32_t to_uint32
#define CONVERT_float    to_float
#define CONVERT_double   to_double

static exr_result_t set_value(exr_context_t ctx, const char *name, const rl_exr_value *v)
{
    exr_attr_rational_t ratio;
    switch (v->type) {
#define WRITE(ours, core, member, element, n)                                                                \
    case ours: {                                                                                             \
        element e[n];                                                                                        \
        exr_attr_##member##_t data;                                                                          \
        _Static_assert(sizeof e == sizeof data, "the core's struct holds its numbers and nothing else");     \
        for (int i = 0; i < n; i++)                                                                          \
            e[i] = CONVERT_##element(v->v[i]);                                                               \
        memcpy(&data, e, sizeof data);                                                                       \
        return exr_attr_set_##member(ctx, 0, name, &data);                                                   \
    }
        NUMBER_TYPES(WRITE)
#undef WRITE
    case RL_EXR_T_RATIONAL:
        ratio.num = to_int32(v->v[0]);
        ratio.denom = to_uint32(v->v[1]);
        return exr_attr_set_rational(ctx, 0, name, &ratio);
    case RL_EXR_T_INT:
        return exr_attr_set_int(ctx, 0, name, to_int32(v->v[0]));
    case RL_EXR_T_FLOAT:
        return exr_attr_set_float(ctx, 0, name, (float)v->v[0]);
    case RL_EXR_T_DOUBLE:
        return exr_attr_set_double(ctx, 0, name, v->v[0]);
    case RL_EXR_T_STRING:
        return exr_attr_set_string(ctx, 0, name, v->text ? v->text : "");
    default:
        return EXR_ERR_ATTR_TYPE_MISMATCH;
    }
}

/* What has no numbers, from file to file. */
static exr_result_t copy_other(exr_context_t ctx, const exr_attribute_t *a)
{
    exr_result_t rv = 0;
    switch (a->type) {
    case EXR_ATTR_FLOAT_VECTOR:
        return exr_attr_set_float_vector(ctx, 0, a->name, a->floatvector->length, a->floatvector->arr);
    case EXR_ATTR_KEYCODE:
        return exr_attr_set_keycode(ctx, 0, a->name, a->keycode);
    case EXR_ATTR_ENVMAP:
        return exr_attr_set_envmap(ctx, 0, a->name, (exr_envmap_t)a->uc);
    case EXR_ATTR_OPAQUE:
        return exr_attr_set_user(ctx, 0, a->name, a->type_name, a->opaque->size, a->opaque->packed_data);
    case EXR_ATTR_STRING_VECTOR: {
        int32_t n = a->stringvector->n_strings;
        const char **texts = rl_calloc((size_t)n, sizeof *texts);
        for (int32_t i = 0; texts && i < n; i++)
            texts[i] = a->stringvector->strings[i].str;
        rv = texts ? exr_attr_set_string_vector(ctx, 0, a->name, n, texts) : EXR_ERR_OUT_OF_MEMORY;
        rl_free(texts);
        return rv;
    }
    default:
        return rv; /* previews and the like belong to the old pixels */
    }
}

/* What describes a file's own pixels is never copied. */
static bool is_structural(const char *name)
{
    static const char *const names[] = {"channels",
                                        "compression",
                                        "dataWindow",
                                        "displayWindow",
                                        "lineOrder",
                                        "pixelAspectRatio",
                                        "screenWindowCenter",
                                        "screenWindowWidth",
                                        "tiles",
                                        "type",
                                        "name",
                                        "version",
                                        "chunkCount",
                                        "preview",
                                        "maxSamplesPerPixel"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(names[i], name))
            return true;
    return false;
}

static bool is_wanted(const rl_exr_image *image, const char *name)
{
    if (is_structural(name))
        return false;
    for (size_t i = 0; i < image->n_attrs; i++)
        if (!strcmp(image->attrs[i].name, name))
            return false;
    for (size_t i = 0; i < image->n_copy; i++) {
        size_t n = strlen(image->copy[i]);
        if (!strcmp(image->copy[i], name) ||
            (n && image->copy[i][n - 1] == '*' && !strncmp(image->copy[i], name, n - 1)))
            return true;
    }
    return false;
}

rl_code rl_exr_attrs_write(exr_context_t ctx, const char *path, const rl_exr_image *image, rl_error *err)
{
    const rl_exr *from = image->copy_from;
    size_t n = from ? from->parts[image->copy_part].n_attrs : 0;
    for (size_t i = 0; i < n; i++) {
        const exr_attribute_t *a = rl_exr_attr_raw(from, image->copy_part, i);
        rl_exr_value v;
        if (!a || !is_wanted(image, a->name))
            continue;
        value_of(a, &v);
        exr_result_t rv = v.type == RL_EXR_T_OTHER ? copy_other(ctx, a) : set_value(ctx, a->name, &v);
        if (rv)
            return rl_exr_core_fail(err, path, rv, a->name);
    }
    for (size_t i = 0; i < image->n_attrs; i++) {
        const rl_exr_attribute *a = &image->attrs[i];
        if (is_structural(a->name))
            return rl_fail_file(err, RL_E_USAGE, path, "attribute '%s' is given by the image itself",
                                a->name);
        exr_result_t rv = set_value(ctx, a->name, &a->value);
        if (rv)
            return rl_exr_core_fail(err, path, rv, a->name);
    }
    return RL_OK;
}
