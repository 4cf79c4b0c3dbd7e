#include "graph/tool/metric_color.h"

#include <math.h>

/* The exact fractions that follow from the chromaticities of Rec. 709 and D65 at x = 0.3127, y = 0.3290; each
 * row divided by its sum, which is white's coordinate. */
#define X_WHITE (10135552.0 + 8788810.0 + 4435075.0)
#define Z_WHITE (1425312.0 + 8788810.0 + 70074185.0)
const double rl_xyz_from_rgb[3][3] = {
    {10135552 / X_WHITE, 8788810 / X_WHITE, 4435075 / X_WHITE},
    {2613072 / 12288897.0, 8788810 / 12288897.0, 887015 / 12288897.0},
    {1425312 / Z_WHITE, 8788810 / Z_WHITE, 70074185 / Z_WHITE},
};

/* Where the cube root of L*a*b* gives way to a line. */
#define LAB_DELTA (6.0 / 29)

rl_matrix rl_rgb_from_xyz(void)
{
    const double(*m)[3] = rl_xyz_from_rgb;
    rl_matrix out;
    double determinant = 0;
    for (int c = 0; c < 3; c++) {
        int a = (c + 1) % 3, b = (c + 2) % 3;
        for (int r = 0; r < 3; r++) {
            int i = (r + 1) % 3, j = (r + 2) % 3;
            out.m[c][r] = m[i][a] * m[j][b] - m[i][b] * m[j][a];
        }
        determinant += m[0][c] * out.m[c][0];
    }
    for (int i = 0; i < 9; i++)
        out.m[i / 3][i % 3] /= determinant;
    return out;
}

double rl_srgb_decode(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

double rl_srgb_encode(double v)
{
    return v <= 0.0031308 ? v * 12.92 : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

double rl_luminance(const double rgb[3])
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

/* The frame that YCxCz and L*a*b* share. */
static void differences(const double v[3], double out[3])
{
    out[0] = 116 * v[1] - 16;
    out[1] = 500 * (v[0] - v[1]);
    out[2] = 200 * (v[1] - v[2]);
}

static void sums(const double v[3], double out[3])
{
    out[1] = (v[0] + 16) / 116;
    out[0] = out[1] + v[1] / 500;
    out[2] = out[1] - v[2] / 200;
}

void rl_opponent_from_rgb(const double rgb[3], double out[3])
{
    double xyz[3];
    multiply(rl_xyz_from_rgb, rgb, xyz);
    differences(xyz, out);
}

void rl_rgb_from_opponent(const rl_matrix *rgb_from_xyz, const double opponent[3], double out[3])
{
    double xyz[3];
    sums(opponent, xyz);
    multiply(rgb_from_xyz->m, xyz, out);
}

void rl_lab_from_rgb(const double rgb[3], double out[3])
{
    double v[3];
    multiply(rl_xyz_from_rgb, rgb, v);
    for (int i = 0; i < 3; i++)
        v[i] = v[i] > LAB_DELTA * LAB_DELTA * LAB_DELTA ? cbrt(v[i])
                                                        : v[i] / (3 * LAB_DELTA * LAB_DELTA) + 4.0 / 29;
    differences(v, out);
}

void rl_rgb_from_lab(const rl_matrix *rgb_from_xyz, const double lab[3], double out[3])
{
    double v[3];
    sums(lab, v);
    for (int i = 0; i < 3; i++)
        v[i] = v[i] > LAB_DELTA ? v[i] * v[i] * v[i] : 3 * LAB_DELTA * LAB_DELTA * (v[i] - 4.0 / 29);
    multiply(rgb_from_xyz->m, v, out);
}
