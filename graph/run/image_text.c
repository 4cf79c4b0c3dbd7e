#include "graph/run/image_text.h"

#include "graph/base/alloc.h"
#include "graph/run/image_module.h"

rl_code rl_image_text_width(const char *text, const rl_text_style *style, int *width, rl_error *err)
{
    char message[512];
    const rl_oiio_module *module = rl_image_module(err);
    *width = 0;
    if (!module)
        return RL_E_IO;
    if (module->text_width(text, style->height, style->bold, width, message, sizeof message))
        return rl_fail(err, RL_E_IO, RL_NOWHERE, "%s", message);
    return RL_OK;
}

/* The text's coverage over the planes, from row `top` of them on. */
static void blend(float *const plane[3], int width, int height, size_t stride, const float *coverage, int top,
                  int rows, const float color[3])
{
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < rows; y++)
            for (int x = 0; x < width && top + y >= 0 && top + y < height; x++) {
                float *at = &plane[c][(size_t)(top + y) * stride + (size_t)x];
                *at += coverage[(size_t)y * (size_t)width + (size_t)x] * (color[c] - *at);
            }
}

rl_code rl_image_text(float *const plane[3], int width, int height, size_t stride, int x, int baseline,
                      const char *text, const rl_text_style *style, rl_error *err)
{
    char message[512];
    const rl_oiio_module *module = rl_image_module(err);
    int above = 2 * style->height, rows = 3 * style->height; /* more than any letter takes */
    if (!module)
        return RL_E_IO;
    float *coverage = rl_calloc((size_t)width * (size_t)rows, sizeof *coverage);
    if (!coverage)
        return rl_fail_memory(err, (size_t)width * (size_t)rows * sizeof *coverage);
    rl_code code = RL_OK;
    if (module->text(text, style->height, style->bold, coverage, width, rows, x, above, message,
                     sizeof message))
        code = rl_fail(err, RL_E_IO, RL_NOWHERE, "%s", message);
    else
        blend(plane, width, height, stride, coverage, baseline - above, rows, style->color);
    rl_free(coverage);
    return code;
}
