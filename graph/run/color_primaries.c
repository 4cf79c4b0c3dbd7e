/* Primaries and white of a linear RGB space, from its matrix to ACES2065-1. */
#include <math.h>
#include <string.h>

#include "graph/run/color.h"

typedef struct named_primaries {
    const char *name;
    double xy[8];      /* red, green, blue, white */
    double adapted[2]; /* the white that stands for the scene's, where it is not that of the set; else 0 */
} named_primaries;

#define WHITE_D65  0.3127, 0.3290
#define WHITE_ACES 0.32168, 0.33767

/* SMPTE ST 2065-1 and S-2014-004; ITU-R BT.709, BT.2020; SMPTE RP 431-2, EG 432-1; Adobe RGB (1998); ARRI,
 * RED, Sony, Panasonic and Canon white papers. */
static const named_primaries known[] = {
    {"ACES AP0", {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, WHITE_ACES}, {0, 0}},
    {"ACES AP1", {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, WHITE_ACES}, {0, 0}},
    {"Rec.709", {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, WHITE_D65}, {0, 0}},
    {"Rec.2020", {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, WHITE_D65}, {0, 0}},
    {"P3-D65", {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, WHITE_D65}, {0, 0}},
    {"P3-DCI", {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351}, {0, 0}},
    {"Adobe RGB", {0.64, 0.33, 0.21, 0.71, 0.15, 0.06, WHITE_D65}, {0, 0}},
    {"ARRI Wide Gamut 3", {0.684, 0.313, 0.221, 0.848, 0.0861, -0.102, WHITE_D65}, {0, 0}},
    {"REDWideGamutRGB", {0.780308, 0.304253, 0.121595, 1.493994, 0.095612, -0.084589, WHITE_D65}, {0, 0}},
    {"S-Gamut3", {0.730, 0.280, 0.140, 0.855, 0.100, -0.050, WHITE_D65}, {0, 0}},
    {"S-Gamut3.Cine", {0.766, 0.275, 0.225, 0.800, 0.089, -0.087, WHITE_D65}, {0, 0}},
    {"V-Gamut", {0.730, 0.280, 0.165, 0.840, 0.100, -0.030, WHITE_D65}, {0, 0}},
    {"Cinema Gamut", {0.740, 0.270, 0.170, 1.140, 0.080, -0.100, WHITE_D65}, {0, 0}},
    {"CIE XYZ, D65", {1, 0, 0, 1, 0, 0, 1.0 / 3, 1.0 / 3}, {WHITE_D65}},
};

/* ---- 3x3, rows listed, column vectors ---------------------------------------------------------------- */

static void multiply(const double a[9], const double b[9], double out[9])
{
    for (int i = 0; i < 9; i++)
        out[i] = a[i / 3 * 3] * b[i % 3] + a[i / 3 * 3 + 1] * b[3 + i % 3] + a[i / 3 * 3 + 2] * b[6 + i % 3];
}

static void apply(const double m[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2];
}

/* m is regular: only matrices of primaries and adaptations come here. */
static void invert(const double m[9], double out[9])
{
    double det = 0;
    for (int i = 0; i < 9; i++) {
        int r = i % 3, c = i / 3, r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        out[i] = m[3 * r1 + c1] * m[3 * r2 + c2] - m[3 * r1 + c2] * m[3 * r2 + c1];
    }
    for (int i = 0; i < 3; i++)
        det += m[i] * out[3 * i];
    for (int i = 0; i < 9; i++)
        out[i] /= det;
}

static void xyz_of(const double xy[2], double out[3])
{
    out[0] = xy[0] / xy[1];
    out[1] = 1;
    out[2] = (1 - xy[0] - xy[1]) / xy[1];
}

/* RGB to XYZ with Y = 1 for white: SMPTE RP 177. */
static void to_xyz(const double xy[8], double out[9])
{
    double columns[9], inverse[9], white[3], scale[3];
    for (int c = 0; c < 3; c++) {
        columns[c] = xy[2 * c];
        columns[3 + c] = xy[2 * c + 1];
        columns[6 + c] = 1 - xy[2 * c] - xy[2 * c + 1];
    }
    invert(columns, inverse);
    xyz_of(xy + 6, white);
    apply(inverse, white, scale);
    for (int i = 0; i < 9; i++)
        out[i] = columns[i] * scale[i % 3];
}

/* XYZ under one white to XYZ under another: Bradford, as the transforms that OpenColorIO has built in. */
static void adapt(const double from[2], const double to[2], double out[9])
{
    static const double bradford[9] = {0.8951, 0.2664, -0.1614, -0.7502, 1.7135,
                                       0.0367, 0.0389, -0.0685, 1.0296};
    double inverse[9], a[3], b[3], xyz[3], scaled[9];
    xyz_of(from, xyz);
    apply(bradford, xyz, a);
    xyz_of(to, xyz);
    apply(bradford, xyz, b);
    for (int i = 0; i < 9; i++)
        scaled[i] = bradford[i] * b[i / 3] / a[i / 3];
    invert(bradford, inverse);
    multiply(inverse, scaled, out);
}

/* ---- */

static void to_aces(const named_primaries *set, double out[9])
{
    double rgb[9], adapted[9], ap0[9], inverse[9], both[9];
    to_xyz(set->xy, rgb);
    adapt(set->adapted[0] > 0 ? set->adapted : set->xy + 6, known[0].xy + 6, adapted);
    to_xyz(known[0].xy, ap0);
    invert(ap0, inverse);
    multiply(adapted, rgb, both);
    multiply(inverse, both, out);
}

static double difference(const double a[9], const double b[9])
{
    double most = 0;
    for (int i = 0; i < 9; i++)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

static void chromaticity(const double xyz[3], double out[2])
{
    double sum = xyz[0] + xyz[1] + xyz[2];
    out[0] = xyz[0] / sum;
    out[1] = xyz[1] / sum;
}

/* As the matrix says, white included. */
static void describe(const double m[9], rl_primaries *out)
{
    double ap0[9], to[9];
    to_xyz(known[0].xy, ap0);
    multiply(ap0, m, to);
    for (int c = 0; c < 3; c++)
        chromaticity((double[3]){to[c], to[3 + c], to[6 + c]}, out->xy + 2 * c);
    chromaticity((double[3]){to[0] + to[1] + to[2], to[3] + to[4] + to[5], to[6] + to[7] + to[8]},
                 out->xy + 6);
}

rl_code rl_color_primaries(const rl_ocio *ocio, const char *space, rl_where where, rl_primaries *out,
                           rl_error *err)
{
    const char *name;
    double m[9], want[9];
    *out = (rl_primaries){0};
    rl_code code = rl_color_space(ocio, space, where, &name, err);
    if (code == RL_OK)
        code = rl_ocio_to_aces(ocio, name, &out->known, m, err);
    if (code != RL_OK || !out->known)
        return code;
    describe(m, out);
    /* Published matrices are rounded to 4…10 digits, and sets differ from each other by more than 1e-2. */
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        to_aces(&known[i], want);
        if (difference(m, want) < 1e-3) {
            memcpy(out->xy, known[i].xy, sizeof out->xy);
            out->name = known[i].name;
            break;
        }
    }
    return RL_OK;
}

static double area(const double xy[8])
{
    return (xy[2] - xy[0]) * (xy[5] - xy[1]) - (xy[4] - xy[0]) * (xy[3] - xy[1]);
}

bool rl_color_to_rec709(const double xy[8], double m[9])
{
    static const double rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, WHITE_D65};
    double from[9], to[9], adapted[9], inverse[9], both[9];
    for (int i = 0; i < 8; i++)
        if (!isfinite(xy[i]))
            return false;
    if (fabs(area(xy)) < 1e-6 || !(xy[7] > 0))
        return false;
    to_xyz(xy, from);
    to_xyz(rec709, to);
    adapt(xy + 6, rec709 + 6, adapted);
    invert(to, inverse);
    multiply(adapted, from, both);
    multiply(inverse, both, m);
    return true;
}
