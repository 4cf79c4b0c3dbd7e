#include "graph/tool/heatmap.h"

#include <math.h>

#include "graph/base/alloc.h"
#include "graph/run/image_file.h"
#include "graph/tool/metric_color.h"

#define PI 3.14159265358979323846

/* A path through L*C*h: lightness is the parameter, hue turns from blue-violet through red to yellow, chroma
 * swells in the middle and vanishes at both ends. */
void rl_heat_color(double t, float rgb[3])
{
    const rl_matrix rgb_from_xyz = rl_rgb_from_xyz();
    t = t > 0 ? fmin(t, 1) : 0;
    double hue = (-65 + 165 * t) * PI / 180, chroma = 66 * pow(sin(PI * pow(t, 0.8)), 0.75);
    double lab[3] = {97 * t, chroma * cos(hue), chroma * sin(hue)}, linear[3];
    rl_rgb_from_lab(&rgb_from_xyz, lab, linear);
    for (int c = 0; c < 3; c++)
        rgb[c] = (float)rl_srgb_encode(fmin(fmax(linear[c], 0), 1));
}

void rl_heat_scale(rl_metric metric, const float *map, size_t n, float *out, double *white)
{
    float largest = 0;
    *white = 1;
    for (size_t i = 0; i < n; i++) {
        out[i] = metric == RL_METRIC_SSIM ? 1 - map[i] : metric == RL_METRIC_PSNR ? sqrtf(map[i]) : map[i];
        largest = fmaxf(largest, out[i]);
    }
    if (metric <= RL_METRIC_HDRFLIP || metric == RL_METRIC_SSIM || !(largest > 0))
        return;
    *white = (double)largest;
    for (size_t i = 0; i < n; i++)
        out[i] /= largest;
}

rl_code rl_heatmap_write(const char *path, rl_metric metric, const float *map, int width, int height,
                         rl_pool *pool, const rl_log *log, rl_error *err)
{
    enum { COLORS = 1024 }; /* four for each step of 8 bits */
    size_t n = (size_t)width * (size_t)height;
    float *planes = rl_calloc(n, 3 * sizeof *planes), colors[COLORS][3];
    double white;
    rl_code code;
    if (!planes)
        return rl_fail_memory(err, 3 * n * sizeof *planes);
    for (int i = 0; i < COLORS; i++)
        rl_heat_color(i / (COLORS - 1.0), colors[i]);
    rl_heat_scale(metric, map, n, planes, &white);
    for (size_t i = n; i-- > 0;) {
        float t = planes[i] > 0 ? fminf(planes[i], 1) : 0;
        const float *color = colors[(int)(t * (COLORS - 1) + 0.5f)];
        planes[i] = color[0];
        planes[n + i] = color[1];
        planes[2 * n + i] = color[2];
    }
    rl_image_planes image = {.width = width,
                             .height = height,
                             .channels = 3,
                             .stride = (size_t)width,
                             .plane = {planes, planes + n, planes + 2 * n}};
    rl_image_options options = {.type = RL_IMAGE_U8, .colorspace = "sRGB"};
    code = rl_image_file_write(path, &image, &options, pool, NULL, err);
    if (!code && white != 1)
        rl_report(log, RL_NOTE, (rl_where){.file = path}, "white is a difference of %g", white);
    rl_free(planes);
    return code;
}
