/* Colour arithmetic of the metrics: linear Rec. 709 RGB, opponent space YCxCz, CIE L*a*b*, all for D65 as the
 * FLIP papers have them. Pure functions, double. */
#ifndef RL_TOOL_METRIC_COLOR_H
#define RL_TOOL_METRIC_COLOR_H

/* Linear RGB to XYZ relative to white (rows sum to 1), and back. */
extern const double rl_xyz_from_rgb[3][3];
typedef struct rl_matrix {
    double m[3][3];
} rl_matrix;
rl_matrix rl_rgb_from_xyz(void);

/* sRGB's transfer curve (IEC 61966-2-1); below 0 and above 1 it goes on. */
double rl_srgb_decode(double v);
double rl_srgb_encode(double v);

/* Rec. 709 luminance. */
double rl_luminance(const double rgb[3]);

/* YCxCz (Flohr et al. 1993): L*a*b* without the cube root. Linear in RGB. */
void rl_opponent_from_rgb(const double rgb[3], double out[3]);
void rl_rgb_from_opponent(const rl_matrix *rgb_from_xyz, const double opponent[3], double out[3]);

void rl_lab_from_rgb(const double rgb[3], double out[3]);
void rl_rgb_from_lab(const rl_matrix *rgb_from_xyz, const double lab[3], double out[3]);

#endif
