#include "graph/run/image_file.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/run/image_module.h"

rl_code rl_image_file_load(rl_error *err)
{
    return rl_image_module(err) ? RL_OK : RL_E_IO;
}

/* ---- formats
 * ------------------------------------------------------------------------------------------------ */

static bool in_list(const char *list, const char *word)
{
    size_t n = strlen(word);
    for (const char *p = list; *p;) {
        size_t length = strcspn(p, ",");
        if (length == n && strncasecmp(p, word, n) == 0)
            return true;
        p += length + (p[length] == ',');
    }
    return false;
}

rl_code rl_image_file_check(const char *path, rl_where where, rl_error *err)
{
    const char *extension = rl_path_extension(path);
    if (*extension && in_list("png,tif,tiff,jpg,jpeg", extension + 1))
        return RL_OK;
    const rl_oiio_module *module = rl_image_module(err);
    if (!module)
        return RL_E_IO;
    if (*extension && in_list(module->writable(), extension + 1))
        return RL_OK;
    return rl_fail(err, RL_E_USAGE, where, "'%s' has %s%s%s; known: exr,%s", path,
                   *extension ? "an extension that no format has: '" : "no extension that tells the format",
                   extension, *extension ? "'" : "", module->writable());
}

/* ---- from planes of floats to samples of a file
 * ------------------------------------------------------------- */

#define SAMPLE_BYTES(type) ((type) == RL_IMAGE_U8 ? 1u : (type) == RL_IMAGE_U16 ? 2u : 4u)
#define ROWS_AT_ONCE       16

typedef struct packing {
    const rl_image_planes *image;
    rl_image_type type;
    unsigned char *out;      /* interleaved */
    rl_image_counts *counts; /* one for each group of rows */
} packing;

/* NaN compares false, so it becomes 0. */
static inline float clip(float v)
{
    v = v > 0 ? v : 0;
    return v < 1 ? v : 1;
}

static void pack_u8(const float *in, int n, unsigned char *out, int step)
{
    for (int i = 0; i < n; i++)
        out[(size_t)i * (size_t)step] = (unsigned char)(int)(clip(in[i]) * 255.0f + 0.5f);
}

static void pack_u16(const float *in, int n, uint16_t *out, int step)
{
    for (int i = 0; i < n; i++)
        out[(size_t)i * (size_t)step] = (uint16_t)(int)(clip(in[i]) * 65535.0f + 0.5f);
}

static void pack_float(const float *in, int n, float *out, int step)
{
    for (int i = 0; i < n; i++)
        out[(size_t)i * (size_t)step] = in[i];
}

static void count(const float *in, int n, rl_image_counts *counts)
{
    int nan = 0, clipped = 0;
    for (int i = 0; i < n; i++) {
        nan += in[i] != in[i];
        clipped += (in[i] < 0) + (in[i] > 1);
    }
    counts->nan += (unsigned)nan;
    counts->clipped += (unsigned)clipped;
}

static void pack_rows(void *ctx, int group)
{
    const packing *p = ctx;
    const rl_image_planes *image = p->image;
    int end = (group + 1) * ROWS_AT_ONCE < image->height ? (group + 1) * ROWS_AT_ONCE : image->height;
    for (int y = group * ROWS_AT_ONCE; y < end; y++)
        for (int c = 0; c < image->channels; c++) {
            const float *in = image->plane[c] + (size_t)y * image->stride;
            size_t at = ((size_t)y * (size_t)image->width) * (size_t)image->channels + (size_t)c;
            if (p->type == RL_IMAGE_U8)
                pack_u8(in, image->width, p->out + at, image->channels);
            else if (p->type == RL_IMAGE_U16)
                pack_u16(in, image->width, (uint16_t *)(void *)p->out + at, image->channels);
            else
                pack_float(in, image->width, (float *)(void *)p->out + at, image->channels);
            if (p->type == RL_IMAGE_U8 || p->type == RL_IMAGE_U16)
                count(in, image->width, &p->counts[group]);
        }
}

static rl_code pack(const rl_image_planes *image, rl_image_type type, rl_pool *pool, unsigned char *out,
                    rl_image_counts *counts, rl_error *err)
{
    int groups = (image->height + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    packing p = {image, type, out, rl_calloc((size_t)groups, sizeof *p.counts)};
    if (!p.counts)
        return rl_fail_memory(err, (size_t)groups * sizeof *p.counts);
    if (pool)
        rl_pool_for(pool, groups, pack_rows, &p);
    for (int i = 0; i < groups; i++) {
        if (!pool)
            pack_rows(&p, i);
        counts->nan += p.counts[i].nan;
        counts->clipped += p.counts[i].clipped;
    }
    rl_free(p.counts);
    return RL_OK;
}

/* ---- writing
 * ------------------------------------------------------------------------------------------------ */

#define OWN_ATTRIBUTES 8

/* TIFF and JPEG keep no text under names of our own: there all of it goes into the description. */
static void describe(const rl_image_options *o, char *out, size_t size)
{
    size_t n = 0;
    out[0] = 0;
    for (size_t i = 0; i < o->notes_n; i++)
        if (strchr(o->notes[i].name, ':') && n < size)
            n += (size_t)snprintf(out + n, size - n, "%s%s = %s", n ? "; " : "", o->notes[i].name,
                                  o->notes[i].text);
    if (o->colorspace && n < size)
        snprintf(out + n, size - n, "%srelit:colorspace = %s", n ? "; " : "", o->colorspace);
}

/* What a format's own tag can say: "sRGB" for the display of that name, whatever the view. */
static const char *tag_of(const char *colorspace)
{
    size_t n = strcspn(colorspace, " ");
    bool srgb = strncasecmp(colorspace, "sRGB", n) == 0 && n == 4 &&
                (colorspace[n] == 0 || strncmp(colorspace + n, " / ", 3) == 0);
    return srgb ? "sRGB" : colorspace;
}

/* Formats keep text that they do not know as text, so each gets only what is meant for it. */
static size_t fill_attributes(const char *path, const rl_image_options *o, const char *description,
                              rl_oiio_attribute *out)
{
    const char *extension = rl_path_extension(path);
    int level = o->compression ? o->compression : 1;
    size_t n = 0;
    if (in_list(".tif,.tiff", extension)) {
        /* OpenImageIO puts the time of writing into TIFF files; the same image must be the same file. Exif's
         * form of "not known". */
        out[n++] = (rl_oiio_attribute){"DateTime", "    :  :     :  :  ", 0};
        out[n++] = (rl_oiio_attribute){"tiff:zipquality", NULL, level};
        out[n++] = (rl_oiio_attribute){"tiff:half", NULL, o->type == RL_IMAGE_HALF}; /* or it becomes float */
    } else if (in_list(".png", extension)) {
        /* One filter for all rows (libpng's "sub") takes 40 % less time than trying them all, for 5 % larger
         * files. */
        out[n++] = (rl_oiio_attribute){"png:compressionLevel", NULL, level};
        out[n++] = (rl_oiio_attribute){"png:filter", NULL, 0x10};
    } else {
        out[n++] = (rl_oiio_attribute){"CompressionQuality", NULL, o->quality ? o->quality : 95};
        out[n++] = (rl_oiio_attribute){"jpeg:subsampling", "4:4:4", 0};
    }
    if (in_list(".tif,.tiff,.jpg,.jpeg", extension) && *description)
        out[n++] = (rl_oiio_attribute){"ImageDescription", description, 0};
    if (o->colorspace) {
        out[n++] = (rl_oiio_attribute){"oiio:ColorSpace", tag_of(o->colorspace), 0};
        out[n++] = (rl_oiio_attribute){"relit:colorspace", o->colorspace, 0};
    }
    for (size_t i = 0; i < o->notes_n; i++)
        out[n++] = (rl_oiio_attribute){o->notes[i].name, o->notes[i].text, 0};
    return n;
}

static rl_code write_through(const rl_oiio_module *module, const char *path, const rl_oiio_image *packed,
                             rl_error *err)
{
    char temp[4096], message[1024];
    rl_oiio_image image = *packed;
    rl_code code = rl_file_temp(path, temp, sizeof temp, err);
    if (code != RL_OK)
        return code;
    image.path = temp;
    if (module->write(&image, message, sizeof message)) {
        rl_file_discard(temp);
        /* The temporary name means nothing to a reader. */
        const char *where = strstr(message, temp);
        if (where)
            return rl_fail_file(err, RL_E_IO, path, "cannot be written: %.*s'%s'%s", (int)(where - message),
                                message, path, where + strlen(temp));
        return rl_fail_file(err, RL_E_IO, path, "cannot be written: %s", message);
    }
    return rl_file_commit(temp, path, err);
}

rl_code rl_image_file_write(const char *path, const rl_image_planes *image, const rl_image_options *options,
                            rl_pool *pool, rl_image_counts *counts, rl_error *err)
{
    rl_image_counts unused = {0};
    rl_code code = rl_image_file_check(path, RL_NOWHERE, err);
    const rl_oiio_module *module = code == RL_OK ? rl_image_module(err) : NULL;
    if (!module)
        return code != RL_OK ? code : RL_E_IO;
    if (image->width < 1 || image->height < 1 || image->channels < 1 || image->channels > 4)
        return rl_fail_file(err, RL_E_USAGE, path,
                            "an image of %d x %d pixels and %d channels cannot be written", image->width,
                            image->height, image->channels);
    size_t samples = (size_t)image->width * (size_t)image->height * (size_t)image->channels;
    unsigned char *pixels = rl_aligned(samples * SAMPLE_BYTES(options->type));
    rl_oiio_attribute *attributes = rl_calloc(options->notes_n + OWN_ATTRIBUTES, sizeof *attributes);
    if (!pixels || !attributes) {
        code = rl_fail_memory(err, samples * SAMPLE_BYTES(options->type));
        goto done;
    }
    code = pack(image, options->type, pool, pixels, counts ? counts : &unused, err);
    if (code != RL_OK)
        goto done;
    char description[1024];
    describe(options, description, sizeof description);
    rl_oiio_image packed = {.format = rl_path_extension(path) + 1,
                            .width = image->width,
                            .height = image->height,
                            .channels = image->channels,
                            .x = options->x,
                            .y = options->y,
                            .type = (rl_oiio_type)options->type,
                            .pixels = pixels,
                            .attributes = attributes,
                            .attributes_n = fill_attributes(path, options, description, attributes)};
    memcpy(packed.display, options->display, sizeof packed.display);
    if (packed.display[2] == 0)
        memcpy(packed.display, (int[4]){options->x, options->y, image->width, image->height},
               sizeof packed.display);
    code = write_through(module, path, &packed, err);
done:
    rl_free(attributes);
    rl_free(pixels);
    return code;
}

/* ---- reading
 * ------------------------------------------------------------------------------------------------ */

static rl_code open_file(const char *path, const rl_oiio_module **module, rl_oiio_file **file,
                         rl_oiio_info *info, rl_error *err)
{
    char message[1024];
    *file = NULL;
    *module = rl_image_module(err);
    if (!*module)
        return RL_E_IO;
    struct stat st; /* the system's own reason first */
    if (stat(path, &st) || access(path, R_OK))
        return rl_fail_file(err, RL_E_IO, path, "cannot be read: %s", strerror(errno));
    if (!S_ISREG(st.st_mode)) /* a pipe or a device may have no end */
        return rl_fail_file(err, RL_E_IO, path, "cannot be read: not a regular file");
    if ((*module)->open(path, file, info, message, sizeof message))
        return rl_fail_file(err, RL_E_FORMAT, path, "is not an image that can be read: %s", message);
    return RL_OK;
}

/* A file that claims more is damaged, or not meant for this. */
#define MOST_SAMPLES ((size_t)1 << 33)

static rl_code read_planes(const rl_oiio_module *module, rl_oiio_file *file, const char *path, uint64_t limit,
                           rl_image_file *out, rl_error *err)
{
    char message[1024];
    size_t pixels = (size_t)out->width * (size_t)out->height, channels = (size_t)out->channels;
    if (out->width < 1 || out->height < 1 || out->channels < 1 || pixels > MOST_SAMPLES / channels)
        return rl_fail_file(err, RL_E_FORMAT, path, "claims %d x %d pixels of %d channels", out->width,
                            out->height, out->channels);
    const uint64_t bytes = 2 * (uint64_t)pixels * channels * sizeof(float);
    if (limit && bytes > limit) {
        char need[32], most[32];
        return rl_fail_file(
            err, RL_E_MEMORY, path,
            "has %d x %d pixels of %d channels, which take %s to read, more than --memory-limit %s",
            out->width, out->height, out->channels, rl_format_bytes(bytes, need),
            rl_format_bytes(limit, most));
    }
    float *mixed = rl_aligned(pixels * channels * sizeof *mixed);
    out->planes = rl_aligned(pixels * channels * sizeof *mixed);
    rl_code code = RL_OK;
    if (!mixed || !out->planes)
        code = rl_fail_memory(err, pixels * channels * sizeof *mixed);
    else if (module->read(file, mixed, message, sizeof message))
        code = rl_fail_file(err, RL_E_FORMAT, path, "cannot be decoded: %s", message);
    for (size_t c = 0; code == RL_OK && c < channels; c++)
        for (size_t i = 0; i < pixels; i++)
            out->planes[c * pixels + i] = mixed[i * channels + c];
    rl_free(mixed);
    return code;
}

rl_code rl_image_file_read(const char *path, rl_image_file *out, rl_error *err)
{
    return rl_image_file_read_within(path, 0, out, err);
}

rl_code rl_image_file_read_within(const char *path, uint64_t limit, rl_image_file *out, rl_error *err)
{
    const rl_oiio_module *module;
    rl_oiio_file *file;
    rl_oiio_info info;
    *out = (rl_image_file){0};
    rl_code code = open_file(path, &module, &file, &info, err);
    if (code != RL_OK)
        return code;
    *out = (rl_image_file){.width = info.width,
                           .height = info.height,
                           .channels = info.channels,
                           .x = info.x,
                           .y = info.y,
                           .type = (rl_image_type)info.type};
    memcpy(out->display, info.display, sizeof out->display);
    memcpy(out->names, info.names, sizeof out->names);
    memcpy(out->colorspace, info.colorspace, sizeof out->colorspace);
    code = read_planes(module, file, path, limit, out, err);
    module->close(file);
    if (code != RL_OK)
        rl_image_file_free(out);
    return code;
}

void rl_image_file_free(rl_image_file *file)
{
    rl_free(file->planes);
    file->planes = NULL;
}

rl_code rl_image_file_note(const char *path, const char *name, char *out, size_t size, rl_error *err)
{
    const rl_oiio_module *module;
    rl_oiio_file *file;
    rl_oiio_info info;
    rl_code code = open_file(path, &module, &file, &info, err);
    if (code != RL_OK)
        return code;
    snprintf(out, size, "%s", module->attribute(file, name));
    module->close(file);
    return RL_OK;
}
