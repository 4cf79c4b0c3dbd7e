#include "tests/direct_metrics.h"

#include <math.h>

static const double pi = 3.14159265358979323846, ppd = 67.0206432765823;
/* White of D65 as the sRGB standard's matrix gives it, to the digits that the authors print. */
static const double white[3] = {0.950428545, 1, 1.088900371};

static void xyz(const double *rgb, double *out)
{
    out[0] = (10135552 * rgb[0] + 8788810 * rgb[1] + 4435075 * rgb[2]) / 24577794;
    out[1] = (2613072 * rgb[0] + 8788810 * rgb[1] + 887015 * rgb[2]) / 12288897;
    out[2] = (1425312 * rgb[0] + 8788810 * rgb[1] + 70074185 * rgb[2]) / 73733382;
}

static void ycxcz(const double *rgb, double *out)
{
    double v[3];
    xyz(rgb, v);
    out[0] = 116 * v[1] / white[1] - 16;
    out[1] = 500 * (v[0] / white[0] - v[1] / white[1]);
    out[2] = 200 * (v[1] / white[1] - v[2] / white[2]);
}

static double lab_curve(double t)
{
    return t > 216.0 / 24389 ? cbrt(t) : 841.0 / 108 * t + 4.0 / 29;
}

/* L*a*b* with Hunt's scaling, of a colour in YCxCz that is clipped to the RGB cube first. */
static void hunt(const double *opponent, double *out)
{
    double y = (opponent[0] + 16) / 116, v[3], rgb[3];
    v[0] = (y + opponent[1] / 500) * white[0];
    v[1] = y * white[1];
    v[2] = (y - opponent[2] / 200) * white[2];
    rgb[0] = 3.241003275 * v[0] - 1.537398934 * v[1] - 0.498615861 * v[2];
    rgb[1] = -0.969224334 * v[0] + 1.875930071 * v[1] + 0.041554224 * v[2];
    rgb[2] = 0.055639423 * v[0] - 0.204011202 * v[1] + 1.057148933 * v[2];
    for (int c = 0; c < 3; c++)
        rgb[c] = fmin(fmax(rgb[c], 0), 1);
    xyz(rgb, v);
    for (int c = 0; c < 3; c++)
        v[c] = lab_curve(v[c] / white[c]);
    out[0] = 116 * v[1] - 16;
    out[1] = 0.01 * out[0] * 500 * (v[0] - v[1]);
    out[2] = 0.01 * out[0] * 200 * (v[1] - v[2]);
}

static double distance(const double *a, const double *b)
{
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

static int clamp(int v, int n)
{
    return v < 0 ? 0 : v < n ? v : n - 1;
}

static const double *at(const double *image, int width, int height, int x, int y)
{
    return image + 3 * (clamp(y, height) * width + clamp(x, width));
}

/* The contrast sensitivity of a channel in space, d² in square degrees. */
static double sensitivity(int channel, double d2)
{
    static const double a1[3] = {1, 1, 34.1}, b1[3] = {0.0047, 0.0053, 0.04};
    double v = a1[channel] * sqrt(pi / b1[channel]) * exp(-pi * pi * d2 / b1[channel]);
    return channel < 2 ? v : v + 13.5 * sqrt(pi / 0.025) * exp(-pi * pi * d2 / 0.025);
}

static void see(const double *image, int width, int height, int x, int y, double *out)
{
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * pi * pi)) * ppd);
    double sum[3] = {0}, total[3] = {0};
    for (int j = -radius; j <= radius; j++) {
        for (int i = -radius; i <= radius; i++) {
            double v[3];
            ycxcz(at(image, width, height, x + i, y + j), v);
            for (int c = 0; c < 3; c++) {
                double w = sensitivity(c, (i * i + j * j) / (ppd * ppd));
                sum[c] += w * v[c];
                total[c] += w;
            }
        }
    }
    for (int c = 0; c < 3; c++)
        sum[c] /= total[c];
    hunt(sum, out);
}

/* Edge (order 1) or point (order 2) strength. */
static double feature(const double *image, int width, int height, int x, int y, int order)
{
    double sd = 0.5 * 0.082 * ppd, above[2] = {0}, below[2] = {0}, plus = 0, minus = 0;
    int radius = (int)ceil(3 * sd);
    for (int j = -radius; j <= radius; j++) {
        for (int i = -radius; i <= radius; i++) {
            double g = exp(-(i * i + j * j) / (2 * sd * sd)), v[3], u[3];
            double w = (order == 1 ? -i : i * i / (sd * sd) - 1) * g;
            ycxcz(at(image, width, height, x + i, y + j), v);
            ycxcz(at(image, width, height, x + j, y + i), u);
            (w > 0 ? above : below)[0] += w * (v[0] + 16) / 116;
            (w > 0 ? above : below)[1] += w * (u[0] + 16) / 116;
            *(w > 0 ? &plus : &minus) += w;
        }
    }
    return hypot(above[0] / plus - below[0] / minus, above[1] / plus - below[1] / minus);
}

double direct_flip(const double *a, const double *b, int width, int height, int x, int y)
{
    const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    double opponent[3], hunt_green[3], hunt_blue[3], seen_a[3], seen_b[3];
    ycxcz(green, opponent);
    hunt(opponent, hunt_green);
    ycxcz(blue, opponent);
    hunt(opponent, hunt_blue);
    double largest = pow(distance(hunt_green, hunt_blue), 0.7);

    see(a, width, height, x, y, seen_a);
    see(b, width, height, x, y, seen_b);
    double color = pow(distance(seen_a, seen_b), 0.7);
    if (color < 0.4 * largest)
        color *= 0.95 / (0.4 * largest);
    else
        color = 0.95 + (color - 0.4 * largest) / (0.6 * largest) * 0.05;

    double edges = fabs(feature(a, width, height, x, y, 1) - feature(b, width, height, x, y, 1));
    double points = fabs(feature(a, width, height, x, y, 2) - feature(b, width, height, x, y, 2));
    return pow(color, 1 - sqrt(fmax(edges, points) / sqrt(2)));
}

double direct_ssim(const double *a, const double *b, int width, int x, int y)
{
    double weights = 0, ma = 0, mb = 0, va = 0, vb = 0, cov = 0;
    for (int pass = 0; pass < 2; pass++) { /* means first, then moments about them */
        for (int j = -5; j <= 5; j++) {
            for (int i = -5; i <= 5; i++) {
                double w = exp(-(i * i + j * j) / 4.5);
                double p = a[(y + j) * width + x + i], q = b[(y + j) * width + x + i];
                if (pass == 0) {
                    weights += w;
                    ma += w * p;
                    mb += w * q;
                } else {
                    va += w * (p - ma) * (p - ma);
                    vb += w * (q - mb) * (q - mb);
                    cov += w * (p - ma) * (q - mb);
                }
            }
        }
        if (pass == 0) {
            ma /= weights;
            mb /= weights;
        }
    }
    va /= weights;
    vb /= weights;
    cov /= weights;
    return (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
}

double direct_tone(double v)
{
    v *= 0.6;
    return fmin(fmax(v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14), 0), 1);
}
