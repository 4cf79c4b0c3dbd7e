/* Pictures to be compared, as files hold them: EXR through relit's reader, everything else through
 * OpenImageIO. */
#ifndef RL_TOOL_COMPARE_IMAGE_H
#define RL_TOOL_COMPARE_IMAGE_H

#include "graph/tool/metrics.h"

/* Owned; freed by rl_compare_image_free. */
typedef struct rl_compare_image {
    rl_metric_image view; /* of an EXR: R, G, B, or its single layer; alpha is left out */
    float *pixels;
    int x, y;           /* of the first pixel in the display window */
    bool data;          /* neither RGB nor a single channel, such as a normal: colour metrics do not apply */
    char channels[160]; /* "R G B" */
    int levels;         /* of integers: 255, 65535; 0: floats */
    bool rec709;        /* false: the file has chromaticities, and they are others */
    bool has_xy;        /* the file has chromaticities: */
    double xy[8];       /* x, y of red, green, blue, white */
    char space[64];     /* relit:colorspace, or "" */
} rl_compare_image;

/* 8 and 16 bits an sample are taken as sRGB-encoded, half, float and uint as linear. Errors name the file:
 * RL_E_IO, RL_E_FORMAT (not an image, or one with several layers and no R, G, B), RL_E_DATA (NaN or infinity,
 * with channel and pixel), RL_E_MEMORY. `pool` may be NULL. */
rl_code rl_compare_image_read(const char *path, rl_pool *pool, rl_compare_image *out, rl_error *err);
void rl_compare_image_free(rl_compare_image *image);

#endif
