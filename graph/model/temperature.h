/* The colour of a black body. Pure functions. */
#ifndef RL_MODEL_TEMPERATURE_H
#define RL_MODEL_TEMPERATURE_H

#ifdef __cplusplus
extern "C" {
#endif

#define RL_KELVIN_LEAST 1000
#define RL_KELVIN_MOST  40000
#define RL_DUV_MOST     0.05

/* Chromaticity x, y (CIE 1931, 2°) of a black body of RL_KELVIN_LEAST … RL_KELVIN_MOST kelvin: Planck's law
 * with c2 = 1.4388 cm K summed against the CIE's colour matching functions, every 5 nm; within 2e-4 of the
 * published ones. */
void rl_kelvin_xy(double kelvin, double xy[2]);

/* The same moved off the locus by `duv` in CIE 1960 u, v, at a right angle: positive is greener, negative
 * pinker (ANSI C78.377). |duv| <= RL_DUV_MOST. */
void rl_kelvin_tinted_xy(double kelvin, double duv, double xy[2]);

/* Factors for the channels of a linear RGB space that give white light this colour and leave its luminance as
 * it is. to_rec709: from the space to linear Rec.709 (white D65), rows listed. What the space cannot show,
 * such as a black body below 1900 K in Rec.709, has negative channels: they become 0 and the luminance is set
 * again. Where to_rec709 has no inverse the factors are 1. */
void rl_kelvin_rgb(double kelvin, double duv, const double to_rec709[9], double rgb[3]);

/* The inverse of a 3 x 3 matrix, rows listed; 0 when it has none. */
int rl_invert3(const double m[9], double out[9]);

#ifdef __cplusplus
}
#endif
#endif
