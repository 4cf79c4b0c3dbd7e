/* The layers of a manifest. */
#include "graph/model/manifest_parts.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

const rl_layer_type rl_layer_types[RL_LAYER_COUNT] = {
    [RL_LAYER_ALBEDO] = {"albedo", RL_RGB, 3, .required = true, .keys = {"colorspace"},
                         .help = "scene-linear diffuse colour, 0..1"},
    [RL_LAYER_NORMAL] = {"normal", RL_NORMAL, 3, .required = true, .keys = {"space", "encoding", "axes"},
                         .help = "unit shading normal"},
    [RL_LAYER_DEPTH] = {"depth", RL_SCALAR, 1, .required = true,
                        .keys = {"kind", "near", "far", "reversed", "empty", "unit", "negated"},
                        .help = "distance along the view axis"},
    [RL_LAYER_STENCIL] = {"stencil", RL_ID, 1, .required = true, .keys = {"encoding", "constant"},
                          .help = "material id, any 32-bit integer"},
    [RL_LAYER_THICKNESS] = {"thickness", RL_SCALAR, 1, .keys = {"unit", "remap"},
                            .help = "length along the inward normal to the back face, 0 = unknown"},
    [RL_LAYER_SHADOW] = {"shadow", RL_LIGHTS, 1, .per_light = true, .help = "visibility of a light, 0..1"},
    [RL_LAYER_SHADOW_THICKNESS] = {"shadow_thickness", RL_LIGHTS, 1, .per_light = true,
                                   .keys = {"unit", "remap"},
                                   .help =
                                       "length along a light's ray inside what it meets first, 0 where lit"},
    [RL_LAYER_MOTION] = {"motion", RL_VEC2, 2, .keys = {"unit", "points", "y"},
                         .help = "from here to where the point was one frame before"},
    [RL_LAYER_ROUGHNESS] = {"roughness", RL_SCALAR, 1, .help = "perceptual roughness, alpha = roughness^2"},
    [RL_LAYER_SPECULAR] = {"specular", RL_SCALAR, 1, .help = "reflectance at normal incidence"},
    [RL_LAYER_METALLIC] = {"metallic", RL_SCALAR, 1, .help = "0 dielectric, 1 metal"},
    [RL_LAYER_EMISSION] = {"emission", RL_RGB, 3, .keys = {"colorspace"}, .help = "emitted radiance"},
    [RL_LAYER_CURVATURE] = {"curvature", RL_SCALAR, 1, .keys = {"unit"},
                            .help = "mean curvature, 1 / length, convex positive"},
    [RL_LAYER_BACK_DEPTH] = {"back_depth", RL_SCALAR, 1,
                             .keys = {"kind", "near", "far", "reversed", "empty", "unit", "negated"},
                             .help = "depth of the closest back face, empty where there is none"},
    [RL_LAYER_BACK_NORMAL] = {"back_normal", RL_NORMAL, 3, .keys = {"space", "encoding", "axes"},
                              .help = "normal of the closest back face, out of the object"},
    [RL_LAYER_BACK_ALBEDO] = {"back_albedo", RL_RGB, 3, .keys = {"colorspace"},
                              .help = "albedo of the closest back face"},
};

/* One layer while it is read: the map it comes from (NULL in a short form), and whom to tell. */
typedef struct layer_reader {
    rl_manifest_reader *r;
    const rl_value *map;
    rl_layer *layer;
} layer_reader;

static bool has_key(const rl_layer_type *type, const char *key)
{
    for (int i = 0; type->keys[i]; i++)
        if (!strcmp(type->keys[i], key))
            return true;
    return false;
}

/* The value of a key that matters, or NULL after a note that a default is assumed. */
static const rl_value *stated(const layer_reader *l, const char *key, const char *assumed)
{
    const rl_value *v = rl_value_get(l->map, key);
    if (!v)
        rl_report(l->r->log, RL_NOTE, l->layer->where, "layer '%s': '%s' is not given; assuming %s",
                  l->layer->name, key, assumed);
    return v;
}

static rl_code read_channels(const layer_reader *l, const rl_value *v, size_t n, const char **out,
                             rl_error *err)
{
    if (v->kind == RL_TEXT && n == 1) {
        *out = v->text;
        return v->text[0] ? RL_OK : rl_value_wrong(v, "channels", "the name of a channel", err);
    }
    char expected[64];
    snprintf(expected, sizeof expected, "a list of %zu channel name%s", n, n == 1 ? "" : "s");
    if (v->kind != RL_LIST || v->n != n)
        return rl_fail(err, RL_E_CONFIG, v->where, "layer '%s': expected %s", l->layer->name, expected);
    for (size_t i = 0; i < n; i++) {
        /* `Y` and `N` are texts in the core schema; a channel named 1 is what was written */
        const rl_value *c = v->items[i];
        if (!c->text || !c->text[0])
            return rl_value_wrong(c, "channels", "the name of a channel", err);
        out[i] = c->text;
    }
    return RL_OK;
}

static rl_code read_alternatives(const layer_reader *l, const rl_value *v)
{
    rl_layer *layer = l->layer;
    rl_error *err = l->r->err;
    size_t n = layer->encoding == RL_ENCODING_OCTAHEDRAL ? 2 : (size_t)rl_layer_types[layer->id].channels;
    bool several = v->kind == RL_LIST && v->n > 0 && v->items[0]->kind == RL_LIST;
    size_t alternatives = several ? v->n : 1;
    layer->n_channels = (int)n;
    layer->n_alternatives = (int)alternatives;
    layer->channels = rl_arena_array(l->r->arena, n * alternatives, sizeof *layer->channels);
    if (!layer->channels)
        return rl_fail_memory(err, n * alternatives * sizeof *layer->channels);
    rl_code code = RL_OK;
    for (size_t i = 0; i < alternatives && !code; i++)
        code = read_channels(l, several ? v->items[i] : v, n, layer->channels + i * n, err);
    return code;
}

/* axes: [-x, z, y]: what the file calls x, turned around, is our x, what it calls z our y, … */
static rl_code read_axes(const layer_reader *l, const rl_value *v)
{
    static const char expected[] = "three of x, y, z, -x, -y, -z, each axis once, such as [x, -z, y]";
    unsigned seen = 0;
    if (v->kind != RL_LIST || v->n != 3)
        return rl_value_wrong(v, "axes", expected, l->r->err);
    for (int i = 0; i < 3; i++) {
        const char *text = v->items[i]->text ? v->items[i]->text : "";
        int sign = text[0] == '-' ? -1 : 1;
        const char *name = text + (sign < 0 || text[0] == '+');
        bool one = name[0] >= 'x' && name[0] <= 'z' && !name[1];
        if (!one || seen & 1u << (name[0] - 'x'))
            return rl_value_wrong(v->items[i], "axes", expected, l->r->err);
        seen |= 1u << (name[0] - 'x');
        l->layer->axes[i] = sign * (name[0] - 'x' + 1);
    }
    return RL_OK;
}

static rl_code read_normal(const layer_reader *l)
{
    const rl_value *space = stated(l, "space", "world"), *encoding = stated(l, "encoding", "signed");
    int word = 0;
    rl_code code = space ? rl_value_word(space, "space", "world|camera", &word, l->r->err) : RL_OK;
    l->layer->space = (rl_space)word;
    word = 0;
    if (!code && encoding)
        code = rl_value_word(encoding, "encoding", "signed|unsigned|octahedral", &word, l->r->err);
    l->layer->encoding = (rl_encoding)word;
    const rl_value *axes = rl_value_get(l->map, "axes");
    for (int i = 0; i < 3; i++)
        l->layer->axes[i] = i + 1;
    return code || !axes ? code : read_axes(l, axes);
}

static rl_code read_stencil(const layer_reader *l)
{
    const rl_value *encoding = rl_value_get(l->map, "encoding"), *constant = rl_value_get(l->map, "constant");
    int word = 0;
    long long id = 0;
    rl_code code =
        encoding ? rl_value_word(encoding, "encoding", "integer|cryptomatte", &word, l->r->err) : RL_OK;
    if (!code && constant)
        code = rl_value_integer(constant, "constant", INT32_MIN, UINT32_MAX, &id, l->r->err);
    if (!code && constant && (encoding || rl_value_get(l->map, "channels") || rl_value_get(l->map, "part")))
        code = rl_fail(l->r->err, RL_E_CONFIG, constant->where,
                       "layer 'stencil': 'constant' is the id of every pixel, instead of channels");
    l->layer->hashed = word == 1;
    l->layer->constant = (uint32_t)id;
    return code;
}

static rl_code read_device(const layer_reader *l)
{
    rl_layer *layer = l->layer;
    rl_error *err = l->r->err;
    const rl_value *near = rl_value_get(l->map, "near"), *far = rl_value_get(l->map, "far");
    const rl_value *reversed = rl_value_get(l->map, "reversed");
    if (!near || !far)
        return rl_fail(err, RL_E_CONFIG, layer->where, "layer '%s': device depth needs 'near' and 'far'",
                       layer->name);
    rl_code code = rl_value_number(near, "near", DBL_MIN, DBL_MAX, &layer->near_m, err);
    if (!code)
        code = rl_value_number(far, "far", DBL_MIN, INFINITY, &layer->far_m, err);
    if (!code && reversed)
        code = rl_value_truth(reversed, "reversed", &layer->reversed, err);
    if (!code && !(layer->far_m > layer->near_m))
        code = rl_fail(err, RL_E_CONFIG, far->where, "'far' is %s, but must be beyond 'near', which is %s",
                       far->text, near->text);
    layer->near_m *= layer->scale;
    layer->far_m *= layer->scale;
    layer->empty = layer->reversed ? 0 : 1;
    return code;
}

static rl_code read_depth(const layer_reader *l)
{
    static const char *const device_keys[] = {"near", "far", "reversed"};
    rl_error *err = l->r->err;
    const rl_value *kind = stated(l, "kind", "planar"), *empty = rl_value_get(l->map, "empty");
    const rl_value *negated = rl_value_get(l->map, "negated");
    int word = 0;
    rl_code code = kind ? rl_value_word(kind, "kind", "planar|radial|device", &word, err) : RL_OK;
    l->layer->kind = (rl_depth_kind)word;
    l->layer->empty = INFINITY;
    for (int i = 0; i < 3 && !code && word != RL_DEPTH_DEVICE; i++) {
        const rl_value *v = rl_value_get(l->map, device_keys[i]);
        if (v)
            code = rl_fail(err, RL_E_CONFIG, v->where, "layer '%s': '%s' belongs to `kind: device`",
                           l->layer->name, device_keys[i]);
    }
    if (!code && word == RL_DEPTH_DEVICE)
        code = read_device(l);
    if (!code && negated)
        code = rl_value_truth(negated, "negated", &l->layer->negated, err);
    if (!code && empty)
        code = rl_value_number(empty, "empty", word == RL_DEPTH_DEVICE ? -INFINITY : DBL_MIN, INFINITY,
                               &l->layer->empty, err);
    return code;
}

static rl_code read_motion(const layer_reader *l)
{
    rl_error *err = l->r->err;
    const rl_value *unit = stated(l, "unit", "pixels"), *points = stated(l, "points", "previous");
    const rl_value *y = stated(l, "y", "down");
    int words[3] = {0};
    rl_code code = unit ? rl_value_word(unit, "unit", "pixels|uv|ndc", &words[0], err) : RL_OK;
    if (!code && points)
        code = rl_value_word(points, "points", "previous|next", &words[1], err);
    if (!code && y)
        code = rl_value_word(y, "y", "down|up", &words[2], err);
    l->layer->motion_unit = (rl_motion_unit)words[0];
    l->layer->points_next = words[1] == 1;
    l->layer->y_up = words[2] == 1;
    return code;
}

static rl_code read_scale(const layer_reader *l)
{
    const rl_value *unit = rl_value_get(l->map, "unit"), *remap = rl_value_get(l->map, "remap");
    rl_layer *layer = l->layer;
    double metres = l->r->m->unit;
    rl_code code = unit && layer->id != RL_LAYER_MOTION ? rl_manifest_unit(unit, &metres, l->r->err) : RL_OK;
    layer->scale = layer->id == RL_LAYER_CURVATURE ? 1 / metres : metres;
    if (code || !remap)
        return code;
    layer->remapped = true;
    code = rl_value_numbers(remap, "remap", 2, layer->remap, l->r->err);
    if (!code && (layer->remap[0] < 0 || layer->remap[1] <= layer->remap[0]))
        code =
            rl_fail(l->r->err, RL_E_CONFIG, remap->where, "'remap' must be [min, max] with 0 <= min < max");
    return code;
}

static rl_code read_keys(const layer_reader *l)
{
    const char *known[10] = {"channels", "part"};
    const rl_layer_type *type = &rl_layer_types[l->layer->id];
    size_t n = 2;
    for (int i = 0; type->keys[i]; i++)
        known[n++] = type->keys[i];
    rl_str what = {0};
    rl_str_printf(&what, "layer '%s'", l->layer->name);
    rl_code code = what.failed ? rl_fail_memory(l->r->err, what.room)
                               : rl_value_keys(l->map, what.text, known, n, l->r->err);
    rl_str_free(&what);
    return code;
}

/* A layer from its map, or in short from the names of its channels. */
static rl_code read_layer(rl_manifest_reader *r, rl_layer_id id, const rl_entry *e, rl_layer *layer)
{
    const rl_layer_type *type = &rl_layer_types[id];
    layer_reader l = {.r = r, .map = e->value->kind == RL_MAP ? e->value : NULL, .layer = layer};
    layer->id = id;
    layer->light = type->per_light ? e->key : NULL;
    layer->name = type->per_light ? rl_arena_printf(r->arena, "%s.%s", type->name, e->key) : type->name;
    layer->where = e->where;
    layer->from_preset = r->preset_file && e->where.file && !strcmp(e->where.file, r->preset_file);
    if (!layer->name)
        return rl_fail_memory(r->err, 64);
    rl_code code = l.map ? read_keys(&l) : RL_OK;
    if (!code)
        code = read_scale(&l);
    if (!code && has_key(type, "space"))
        code = read_normal(&l);
    if (!code && id == RL_LAYER_STENCIL)
        code = read_stencil(&l);
    if (!code && id == RL_LAYER_STENCIL && rl_value_get(l.map, "constant"))
        return RL_OK;
    if (!code && has_key(type, "kind"))
        code = read_depth(&l);
    if (!code && has_key(type, "points"))
        code = read_motion(&l);
    if (!code && has_key(type, "colorspace")) {
        const rl_value *v = stated(&l, "colorspace", "lin_rec709");
        layer->colorspace = "lin_rec709";
        layer->colorspace_where = v ? v->where : layer->where;
        code = v ? rl_value_text(v, "colorspace", &layer->colorspace, r->err) : RL_OK;
    }
    const rl_value *part = rl_value_get(l.map, "part"),
                   *channels = l.map ? rl_value_get(l.map, "channels") : e->value;
    if (!code && part)
        code = rl_value_text(part, "part", &layer->part, r->err);
    if (!code && !channels)
        code = rl_fail(r->err, RL_E_CONFIG, e->value->where, "layer '%s' needs 'channels'", layer->name);
    return code ? code : read_alternatives(&l, channels);
}

static rl_code find_type(rl_manifest_reader *r, const rl_entry *e, rl_layer_id *id)
{
    const char *names[RL_LAYER_COUNT];
    for (int i = 0; i < RL_LAYER_COUNT; i++) {
        names[i] = rl_layer_types[i].name;
        if (!strcmp(e->key, names[i])) {
            *id = (rl_layer_id)i;
            return RL_OK;
        }
    }
    return rl_fail_unknown(r->err, e->where, "there is no layer", e->key, names, RL_LAYER_COUNT);
}

rl_code rl_manifest_read_layers(rl_manifest_reader *r, const rl_value *v)
{
    rl_manifest *m = r->m;
    if (!v)
        return rl_fail(r->err, RL_E_CONFIG, m->where, "a capture needs 'layers' (or a 'preset')");
    if (v->kind != RL_MAP)
        return rl_value_wrong(v, "layers", "a map of layers", r->err);
    size_t room = 0;
    for (size_t i = 0; i < v->n; i++)
        room += v->entries[i].value->kind == RL_MAP ? v->entries[i].value->n + 1 : 1;
    m->layers = rl_arena_array(r->arena, room, sizeof *m->layers);
    if (!m->layers)
        return rl_fail_memory(r->err, room * sizeof *m->layers);
    for (size_t i = 0; i < v->n; i++) {
        const rl_entry *e = &v->entries[i];
        rl_layer_id id = RL_LAYER_COUNT;
        rl_code code = find_type(r, e, &id);
        if (!code && !rl_layer_types[id].per_light)
            code = read_layer(r, id, e, &m->layers[m->n_layers++]);
        else if (!code && e->value->kind != RL_MAP)
            code = rl_value_wrong(e->value, e->key, "a map, light: channel", r->err);
        else
            for (size_t k = 0; !code && k < e->value->n; k++)
                code = read_layer(r, id, &e->value->entries[k], &m->layers[m->n_layers++]);
        if (code)
            return code;
    }
    return RL_OK;
}

double rl_layer_depth(const rl_layer *layer, double raw, double slope)
{
    raw = layer->negated ? -raw : raw;
    switch (layer->kind) {
    case RL_DEPTH_PLANAR:
        return raw * layer->scale;
    case RL_DEPTH_RADIAL:
        return raw * layer->scale / slope;
    case RL_DEPTH_DEVICE: {
        /* 1/z is linear in the depth buffer: 1/near at its near end, 1/far (0 when infinite) at its far end
         */
        double toward_far = layer->reversed ? 1 - raw : raw;
        return 1 / ((1 - toward_far) / layer->near_m + toward_far / layer->far_m);
    }
    }
    return raw;
}

bool rl_layer_is_empty(const rl_layer *layer, double raw)
{
    if (!isfinite(raw))
        return true;
    raw = layer->negated ? -raw : raw;
    if (layer->kind == RL_DEPTH_DEVICE)
        return layer->reversed ? raw <= layer->empty : raw >= layer->empty;
    return raw >= layer->empty || raw <= 0;
}
