/* Text on pictures, through the OpenImageIO module: DejaVu Sans, or what fontconfig has in its place. All
 * functions are thread-safe. RL_E_IO: the module or a font is missing, and what to install. */
#ifndef RL_RUN_IMAGE_TEXT_H
#define RL_RUN_IMAGE_TEXT_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_text_style {
    int height; /* of a line, pixels */
    bool bold;
    float color[3]; /* as the planes are encoded */
} rl_text_style;

/* How many pixels a line of UTF-8 takes. */
rl_code rl_image_text_width(const char *text, const rl_text_style *style, int *width, rl_error *err);

/* Draws a line over three planes (row 0 on top, `stride` floats from row to row), its left end at (x,
 * baseline). What lies outside is cut off. */
rl_code rl_image_text(float *const plane[3], int width, int height, size_t stride, int x, int baseline,
                      const char *text, const rl_text_style *style, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
