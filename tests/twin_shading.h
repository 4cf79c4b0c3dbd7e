/* Lighting and combine for one pixel, in double and plain C: what the kernels are held against. */
#ifndef RL_TESTS_TWIN_SHADING_H
#define RL_TESTS_TWIN_SHADING_H

#include "tests/cl_shade.h"

/* Ports of the lighting pass, in their order. */
enum {
    LIGHTING_ALBEDO,
    LIGHTING_NORMAL,
    LIGHTING_DEPTH,
    LIGHTING_STENCIL,
    LIGHTING_THICKNESS,
    LIGHTING_SHADOW,
    LIGHTING_SHADOW_THICKNESS,
    LIGHTING_ROUGHNESS,
    LIGHTING_SPECULAR,
    LIGHTING_METALLIC,
    LIGHTING_EMISSION,
    LIGHTING_CURVATURE,
    LIGHTING_SMOOTH_NORMAL,
    LIGHTING_DIFFUSE,
    LIGHTING_LIT,
    LIGHTING_PORTS
};

enum {
    COMBINE_DIFFUSE,
    COMBINE_LIT,
    COMBINE_ALBEDO,
    COMBINE_NORMAL,
    COMBINE_DEPTH,
    COMBINE_STENCIL,
    COMBINE_COLOR,
    COMBINE_PORTS
};

/* Inputs are read from run->images; diffuse and lit get three numbers each. */
void twin_lighting(const shade_run *run, int x, int y, double *diffuse, double *lit);

/* Irradiance of the normalized spherical Gaussian of DESIGN 4.4, mu = axis.n, as it is printed there. */
double twin_sg_irradiance(double lambda, double mu);

/* `inputs` is a run of combine (albedo, normal, stencil are read); diffuse and lit are given. */
void twin_combine(const shade_run *inputs, int x, int y, const double *diffuse, const double *lit,
                  double *color);

/* View position of a pixel's sample for depth 1 (z = -1), and its world direction. */
void twin_ray(const frame_t *f, const camera_t *c, double x, double y, double *view, double *world);

#endif
