/* What the OpenImageIO module (relit_oiio.so) offers. It is a shared object of its own because OpenImageIO
 * takes a quarter of a second to load; graph/run/image_file.c loads it on first use. The module calls nothing
 * of relit, so it works with the static and the shared library; it reports errors as text. */
#ifndef RL_RUN_SHIM_OIIO_H
#define RL_RUN_SHIM_OIIO_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Counts up when anything below changes. */
#define RL_OIIO_VERSION 2

typedef enum rl_oiio_type { RL_OIIO_U8, RL_OIIO_U16, RL_OIIO_HALF, RL_OIIO_FLOAT } rl_oiio_type;

/* A number when text is NULL. */
typedef struct rl_oiio_attribute {
    const char *name, *text;
    int number;
} rl_oiio_attribute;

typedef struct rl_oiio_image {
    const char *path;   /* where to write */
    const char *format; /* "png", "tif": decides the format, whatever the path ends in */
    int width, height, channels;
    int x, y;          /* of the first pixel in the display window */
    int display[4];    /* x, y, width, height of the display window */
    rl_oiio_type type; /* in the file */
    const void
        *pixels; /* interleaved, rows from the top, no gaps: uint8_t, uint16_t; float for HALF and FLOAT */
    const rl_oiio_attribute *attributes;
    size_t attributes_n;
} rl_oiio_image;

typedef struct rl_oiio_info {
    int width, height, channels;
    int x, y, display[4];
    rl_oiio_type type;   /* the nearest to what the file holds */
    char names[256];     /* of the channels, "R,G,B" */
    char colorspace[64]; /* as the file says or its format implies; "" when neither does */
} rl_oiio_info;

typedef struct rl_oiio_file rl_oiio_file;

/* Functions return 0, or 1 with a line in `message` (room for `size` bytes). All may be called from several
 * threads at a time, on different files. */
typedef struct rl_oiio_module {
    int version;
    int (*write)(const rl_oiio_image *image, char *message, size_t size);
    /* The extensions that can be written, "bmp,png,…". Static. */
    const char *(*writable)(void);
    int (*open)(const char *path, rl_oiio_file **out, rl_oiio_info *info, char *message, size_t size);
    /* All pixels, interleaved float, integers divided by their largest value. */
    int (*read)(rl_oiio_file *file, float *pixels, char *message, size_t size);
    /* A text attribute, "" when there is none. Lives until close. */
    const char *(*attribute)(rl_oiio_file *file, const char *name);
    void (*close)(rl_oiio_file *file); /* NULL is safe */
    /* A line of UTF-8 text in DejaVu Sans, or in what fontconfig has instead; `height` is of a line, pixels.
     */
    int (*text_width)(const char *text, int height, int bold, int *width, char *message, size_t size);
    /* Draws it into a plane of width · height floats without gaps, 0 … 1, black where there is none: its
     * left end at (x, baseline). What lies outside is cut off. */
    int (*text)(const char *text, int height, int bold, float *plane, int plane_width, int plane_height,
                int x, int baseline, char *message, size_t size);
} rl_oiio_module;

/* The only symbol of the module. */
#define RL_OIIO_SYMBOL "rl_oiio_module_get"
const rl_oiio_module *rl_oiio_module_get(void);

#ifdef __cplusplus
}
#endif
#endif
