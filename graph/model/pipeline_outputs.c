/* `outputs:`, checked as far as that is possible without the graph. */
#include "graph/model/pipeline_parts.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graph/base/file.h"

/* ---- what the files can hold
 * ----------------------------------------------------------------------------------- */

/* In the order of rl_pixel_type. */
static const char type_words[] = "half|float|uint8|uint16|uint32";

#define BIT(type) (1u << (type))

typedef struct file_type {
    const char *extension;    /* lower case */
    rl_pixel_type type;       /* the default */
    unsigned types;           /* BITs that `type:` may ask for; ids in EXR are uint32 without asking */
    const char *compressions; /* "zip|none", the default first; NULL: nothing to choose */
    double most_quality;      /* `quality` goes from 0 (DWA) or 1 to this; 0: there is none */
    const char *quality_of;   /* compressions that have a quality; NULL: all */
    const char *level_of;     /* compressions that have a level; "" = the file has one; NULL: none */
    bool layers;              /* holds more than one image */
} file_type;

static const char exr_compressions[] = "zip|none|rle|zips|piz|pxr24|b44|b44a|dwaa|dwab";
static const char tiff_compressions[] = "zip|none|lzw";

static const file_type file_types[] = {
    {".exr", RL_HALF, BIT(RL_HALF) | BIT(RL_FLOAT), exr_compressions, 1e4, "dwaa|dwab", "zip|zips", true},
    {".png", RL_UINT8, BIT(RL_UINT8) | BIT(RL_UINT16), NULL, 0, NULL, "", false},
    {".tif", RL_UINT16, BIT(RL_UINT8) | BIT(RL_UINT16) | BIT(RL_FLOAT), tiff_compressions, 0, NULL, "zip",
     false},
    {".tiff", RL_UINT16, BIT(RL_UINT8) | BIT(RL_UINT16) | BIT(RL_FLOAT), tiff_compressions, 0, NULL, "zip",
     false},
    {".jpg", RL_UINT8, BIT(RL_UINT8), NULL, 100, NULL, NULL, false},
    {".jpeg", RL_UINT8, BIT(RL_UINT8), NULL, 100, NULL, NULL, false},
    {".webp", RL_UINT8, BIT(RL_UINT8), NULL, 100, NULL, NULL, false},
    {".hdr", RL_FLOAT, BIT(RL_FLOAT), NULL, 0, NULL, NULL, false},
    {".dpx", RL_UINT16, BIT(RL_UINT8) | BIT(RL_UINT16), NULL, 0, NULL, NULL, false},
    {".tga", RL_UINT8, BIT(RL_UINT8), NULL, 0, NULL, NULL, false},
    {".bmp", RL_UINT8, BIT(RL_UINT8), NULL, 0, NULL, NULL, false},
};

/* One of "a|b|c", whatever the case. */
static bool has_word(const char *words, const char *word)
{
    size_t n = strlen(word);
    for (; words; words = strchr(words, '|'), words = words ? words + 1 : NULL)
        if (n && strcspn(words, "|") == n && !strncasecmp(words, word, n))
            return true;
    return false;
}

static rl_code find_file_type(const rl_output *o, const file_type **out, rl_error *err)
{
    const char *known[RL_ARRAY_LENGTH(file_types)];
    const char *extension = rl_path_extension(o->file);
    char text[256];
    for (size_t i = 0; i < RL_ARRAY_LENGTH(file_types); i++) {
        *out = &file_types[i];
        known[i] = file_types[i].extension;
        if (!strcasecmp(known[i], extension))
            return RL_OK;
    }
    snprintf(text, sizeof text,
             "output '%.80s': a file's ending says its format, and relit does not write '%.40s'", o->name,
             extension);
    return rl_fail_suggest(err, o->file_where, text, extension, known, RL_ARRAY_LENGTH(known));
}

/* ---- keys
 * ------------------------------------------------------------------------------------------------------ */

typedef struct output_reader {
    rl_arena *arena;
    const rl_value *map;
    rl_output *o;
    const file_type *type;
    rl_error *err;
} output_reader;

/* An optional text that is not empty. */
static rl_code read_text(output_reader *r, const char *key, const char **out)
{
    const rl_value *v = rl_value_get(r->map, key);
    rl_code code = v ? rl_value_text(v, key, out, r->err) : RL_OK;
    return !code && v && !(*out)[0] ? rl_value_wrong(v, key, "a name", r->err) : code;
}

static rl_code read_layers(output_reader *r)
{
    const rl_value *image = rl_value_get(r->map, "image"), *layers = rl_value_get(r->map, "layers");
    if (!image == !layers)
        return rl_fail(r->err, RL_E_CONFIG, r->o->where,
                       "output '%s' needs %s: 'image' names one image, 'layers' is a map {layer: image}",
                       r->o->name, image ? "one of 'image' and 'layers', not both" : "'image' or 'layers'");
    if (layers && (layers->kind != RL_MAP || !layers->n))
        return rl_value_wrong(layers, "layers", "a map {layer: image}", r->err);
    size_t n = layers ? layers->n : 1;
    rl_output_layer *out = rl_arena_array(r->arena, n, sizeof *out);
    if (!out)
        return rl_fail_memory(r->err, n * sizeof *out);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < n; i++) {
        const rl_value *v = layers ? layers->entries[i].value : image;
        out[i] = (rl_output_layer){.name = layers ? layers->entries[i].key : "", .where = v->where};
        if (layers)
            code = rl_name_check(out[i].name, "a layer", layers->entries[i].where, r->err);
        if (!code)
            code = rl_value_text(v, layers ? out[i].name : "image", &out[i].image, r->err);
    }
    r->o->layers = out;
    r->o->n_layers = n;
    return code;
}

static rl_code read_file(output_reader *r)
{
    const rl_value *file;
    const char *expanded;
    rl_output *o = r->o;
    rl_code code = rl_value_need(r->map, "file", "output", o->name, "such as \"{capture}.{frame:04}.exr\"",
                                 o->where, &file, r->err);
    if (!code)
        code = rl_value_text(file, "file", &o->file, r->err);
    if (code)
        return code;
    o->file_where = file->where;
    code = rl_pattern_expand(r->arena, o->file, o->file_where, "capture", 1, "variant", &expanded, r->err);
    if (!code)
        code = find_file_type(o, &r->type, r->err);
    if (!code && o->n_layers > 1 && !r->type->layers)
        code = rl_fail(
            r->err, RL_E_CONFIG, o->file_where,
            "output '%s' has %zu layers, and a %s file holds one image: write .exr, or an output each",
            o->name, o->n_layers, r->type->extension);
    return code;
}

static rl_code read_pixel_type(output_reader *r)
{
    static const char *const names[] = {"half", "float", "uint8", "uint16", "uint32"};
    const rl_value *v = rl_value_get(r->map, "type");
    int word = 0;
    r->o->type = r->type->type;
    if (!v)
        return RL_OK;
    rl_code code = rl_value_word(v, "type", type_words, &word, r->err);
    if (code)
        return code;
    r->o->type = (rl_pixel_type)word;
    if (r->type->types & BIT(word))
        return RL_OK;
    char can[64] = "";
    for (unsigned i = 0; i < RL_ARRAY_LENGTH(names); i++)
        if (r->type->types & BIT(i))
            strcat(strcat(can, can[0] ? ", " : ""), names[i]);
    return rl_fail(r->err, RL_E_CONFIG, v->where, "output '%s': a %s file cannot hold %s; it can hold: %s",
                   r->o->name, r->type->extension, names[word], can);
}

static rl_code read_color(output_reader *r)
{
    rl_output *o = r->o;
    const rl_value *space = rl_value_get(r->map, "colorspace"), *display = rl_value_get(r->map, "display");
    const rl_value *view = rl_value_get(r->map, "view"), *look = rl_value_get(r->map, "look");
    const rl_value *exposure = rl_value_get(r->map, "exposure"), *first = space ? space : display;
    o->color_where = first ? first->where : o->where;
    o->view_where = view ? view->where : o->color_where;
    o->look_where = look ? look->where : o->color_where;
    rl_code code = read_text(r, "colorspace", &o->colorspace);
    if (!code)
        code = read_text(r, "display", &o->display);
    if (!code)
        code = read_text(r, "view", &o->view);
    if (!code)
        code = read_text(r, "look", &o->look);
    if (!code && exposure)
        code = rl_value_number(exposure, "exposure", -100, 100, &o->exposure, r->err);
    if (code)
        return code;
    if (space && display)
        return rl_fail(r->err, RL_E_CONFIG, display->where,
                       "output '%s' has both 'colorspace' and 'display': keep 'colorspace' for files that "
                       "are worked on, "
                       "'display' for files that are looked at",
                       o->name);
    if ((view || look) && !display)
        return rl_fail(r->err, RL_E_CONFIG, (view ? view : look)->where,
                       "output '%s': '%s' is of a display; name it in 'display'", o->name,
                       view ? "view" : "look");
    return RL_OK;
}

static rl_code read_compression(output_reader *r)
{
    const rl_value *v = rl_value_get(r->map, "compression");
    const char *words = r->type->compressions, *text = NULL;
    if (v && !words)
        return rl_fail(r->err, RL_E_CONFIG, v->where, "output '%s': a %s file has no choice of compression",
                       r->o->name, r->type->extension);
    if (!words)
        return RL_OK;
    rl_code code = v ? rl_value_text(v, "compression", &text, r->err) : RL_OK;
    if (code)
        return code;
    char *lower =
        text ? rl_arena_strdup(r->arena, text) : rl_arena_strndup(r->arena, words, strcspn(words, "|"));
    if (!lower)
        return rl_fail_memory(r->err, 0);
    for (char *c = lower; *c; c++)
        if (*c >= 'A' && *c <= 'Z')
            *c = (char)(*c - 'A' + 'a');
    r->o->compression = lower;
    if (has_word(words, lower))
        return RL_OK;
    int unused;
    rl_value asked = *v; /* for its suggestion; the names are lower case */
    asked.text = lower;
    return rl_value_word(&asked, "compression", words, &unused, r->err);
}

/* `quality` and `level`, where the compression has them. */
static rl_code read_effort(output_reader *r)
{
    const file_type *t = r->type;
    rl_output *o = r->o;
    const rl_value *quality = rl_value_get(r->map, "quality"), *level = rl_value_get(r->map, "level");
    bool has_quality = t->most_quality > 0 && (!t->quality_of || has_word(t->quality_of, o->compression));
    bool has_level = t->level_of && (!o->compression || has_word(t->level_of, o->compression));
    o->quality = -1;
    if ((quality && !has_quality) || (level && !has_level)) {
        const rl_value *v = quality && !has_quality ? quality : level;
        return rl_fail(r->err, RL_E_CONFIG, v->where, "output '%s': a %s file%s%s has no '%s'", o->name,
                       t->extension, o->compression ? " with compression " : "",
                       o->compression ? o->compression : "", v == quality ? "quality" : "level");
    }
    rl_code code = RL_OK;
    long long n = 0;
    if (quality)
        code =
            rl_value_number(quality, "quality", t->quality_of ? 0 : 1, t->most_quality, &o->quality, r->err);
    if (!code && level)
        code = rl_value_integer(level, "level", 1, 9, &n, r->err);
    o->level = (int)n;
    return code;
}

static rl_code read_output(rl_arena *arena, const rl_value *all, const rl_entry *entry, rl_output *o,
                           rl_error *err)
{
    static const char *const keys[] = {"image", "layers",   "file", "colorspace",  "display", "view",
                                       "look",  "exposure", "type", "compression", "quality", "level"};
    output_reader r = {.arena = arena, .map = entry->value, .o = o, .err = err};
    o->name = entry->key;
    o->where = entry->where;
    char *what = rl_arena_printf(arena, "output '%s'", o->name);
    if (!what)
        return rl_fail_memory(err, strlen(o->name));
    rl_code code = rl_name_check(o->name, "an output", o->where, err);
    if (!code && entry->value->implied && !rl_value_get(entry->value, "image") &&
        !rl_value_get(entry->value, "layers"))
        code = rl_fail_absent(err, all, entry, "there is no output", "'image' or 'layers', and 'file'");
    if (!code)
        code = rl_value_keys(entry->value, what, keys, RL_ARRAY_LENGTH(keys), err);
    if (!code)
        code = read_layers(&r);
    if (!code)
        code = read_file(&r);
    if (!code)
        code = read_pixel_type(&r);
    if (!code)
        code = read_color(&r);
    if (!code)
        code = read_compression(&r);
    return code ? code : read_effort(&r);
}

/* Two patterns that give one name for frame 1 give one name for more. */
static rl_code check_names(rl_arena *arena, const rl_output *outputs, size_t n, rl_error *err)
{
    const char **files = rl_arena_array(arena, n, sizeof *files);
    if (!files)
        return rl_fail_memory(err, n * sizeof *files);
    for (size_t i = 0; i < n; i++) {
        rl_code code = rl_output_path(arena, &outputs[i], "{capture}", 1, "{variant}", &files[i], err);
        for (size_t k = 0; !code && k < i; k++)
            if (!strcmp(files[i], files[k]))
                code = rl_fail(err, RL_E_CONFIG, outputs[i].file_where,
                               "outputs '%s' and '%s' would write one file, '%s'", outputs[k].name,
                               outputs[i].name, outputs[i].file);
        if (code)
            return code;
    }
    return RL_OK;
}

rl_code rl_outputs_read(rl_arena *arena, const rl_value *map, const rl_output **out, size_t *n, rl_error *err)
{
    size_t count = map ? map->n : 0;
    rl_output *outputs = rl_arena_array(arena, count, sizeof *outputs);
    if (!outputs)
        return rl_fail_memory(err, count * sizeof *outputs);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < count; i++)
        code = read_output(arena, map, &map->entries[i], &outputs[i], err);
    *out = outputs;
    *n = count;
    return code ? code : check_names(arena, outputs, count, err);
}
