/* Burley's normalized diffusion, on the host in double, and the rows that every pass reads which filters with
 * it.
 *
 *     R(r) = s (e^{-sr} + e^{-sr/3}) / (8 pi r),  s = 1/d,   integral of 2 pi r R over r >= 0 is 1   [1/m²]
 *
 * Source: Christensen and Burley, "Approximate reflectance profiles for efficient subsurface scattering",
 * 2015; Golubev, "Efficient screen-space subsurface scattering using Burley's normalized diffusion", SIGGRAPH
 * 2018. Lengths are in any unit, the same for all arguments of a call. Pure functions. */
#ifndef RL_PASSES_BURLEY_H
#define RL_PASSES_BURLEY_H

#include <stddef.h>

#include "graph/model/pass.h"
#include "passes/shading_rows.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Where the filters end: the radius in units of d within which 0.997 of the light comes out. */
#define RL_BURLEY_REACH  0.997
#define RL_BURLEY_RADIUS 16.5644

/* Density an area at distance r > 0, d > 0. */
double rl_burley_profile(double r, double d);

/* The share of light that comes out within r >= 0: 1 - e^{-sr}/4 - 3/4 e^{-sr/3}. No cancellation near 0. */
double rl_burley_cdf(double r, double d);

/* r/d with rl_burley_cdf(r, d) = xi, xi in [0, 1); relative error below 1e-12 for xi in [1e-9, 1 - 1e-9].
 * xi = 1 gives infinity. */
double rl_burley_inverse(double xi);

/* n taps on the golden spiral, importance-sampled, in units of d: tap i lies at (x[i], y[i]), its radius has
 * CDF 0.997 (i + offset)/n, 0 < offset < 1, and weight[i] is 1/density, up to a factor that is the same for
 * all taps. With ½ each tap is in the middle of its share; other offsets fill the gaps between those. */
void rl_burley_taps(size_t n, double offset, float *x, float *y, float *weight);

/* The same for a material whose channels have different d[0…2] > 0, in units of the largest. Taps that are
 * placed for the widest channel alone hardly ever come near the middle of one that is thirty times narrower.
 * So they are placed by the mixture of the channels' profiles: RL_BURLEY_NARROW of it for each channel that
 * is narrower than the widest, the rest for the widest; i's radius has (i + offset)/n of what the mixture has
 * within RL_BURLEY_RADIUS. weight[i] is 1/density of the mixture, up to a factor that is the same for all
 * taps and offsets, so R times it is the balance heuristic (Veach 1997). No channel's is more than 1/0.02 in
 * the middle, however narrow.
 * sum[c] is what the n weights of channel c add up to on a plane that faces the camera, in the same units for
 * all offsets. */
#define RL_BURLEY_NARROW 0.02
void rl_burley_mixture_taps(size_t n, double offset, const double d[3], float *x, float *y, float *weight,
                            double sum[3]);

/* s(A), A in 0 … 1 the reflectance of the surface, in d = l/s: fits to Monte Carlo renderings of a flat half
 * space with index-matched, isotropic scattering. */
typedef enum rl_burley_fit {
    RL_BURLEY_SEARCHLIGHT, /* eq. 5: l the mean free path, a beam along the normal; 5.5 % off on average */
    RL_BURLEY_DIFFUSE,     /* eq. 6: l the mean free path, light that a rough surface lets in; 3.9 % */
    RL_BURLEY_DMFP,        /* eq. 8: l the diffuse mean free path, a beam along the normal; 7.7 % */
} rl_burley_fit;
double rl_burley_scale(rl_burley_fit fit, double albedo);

/* Ports of the passes that filter with a disk of pixels (kernels/scatter.cl), and the rows that they share:
 * identical rows in several passes are one field of the material table. */
#define RL_SCATTER_PORTS 14
/* Those before the ledger's, for passes with more. */
#define RL_ROWS_SCATTER_PORTS                                                                                \
    {"diffuse", RL_READ, RL_RGB, .help = "radiance below the surface", .layout = RL_PHASE4},                 \
        {"lit", RL_READ, RL_RGB, .help = "radiance that does not scatter"},                                  \
        {"albedo", RL_READ, RL_RGB, .help = "0..1"},                                                         \
        {"normal", RL_READ, RL_NORMAL, .help = "shading normal, for the way out"},                           \
        {"depth", RL_READ, RL_SCALAR, .help = "planar, metres", .layout = RL_PHASE4},                        \
        {"stencil", RL_READ, RL_ID, .help = "material", .layout = RL_PHASE4},                                \
        {"area", RL_SCRATCH, RL_SCALAR, .help = "surface that a pixel sees", .layout = RL_PHASE4},           \
        {"filtered", RL_SCRATCH, RL_RGB, .help = "scattered radiance below the surface",                     \
         .layout = RL_PHASE4},                                                                               \
    {                                                                                                        \
        "color", RL_WRITE, RL_RGB, .help = "radiance, scene-linear"                                          \
    }
#define RL_SCATTER_PROFILE_ROWS 8
#define RL_SCATTER_SHADING_ROWS 2
extern const rl_port rl_scatter_ports[RL_SCATTER_PORTS];
extern const rl_param
    rl_scatter_profile_rows[RL_SCATTER_PROFILE_ROWS]; /* scatter_distance_mm texturing border, and what the
                                                         first may be derived from */
extern const rl_param rl_scatter_shading_rows[RL_SCATTER_SHADING_ROWS]; /* diffuse exit_transmission */

/* Rows of their parameters. */
#define RL_ROW_ORIENTATION(struct_)                                                                          \
    P_ENUM(struct_, orientation, "screen|tangent", 0,                                                        \
           "the disk is parallel to the screen, or to the tangent plane that the depth gives",               \
           .structural = true)
#define RL_ROW_WEIGHTING(struct_)                                                                            \
    P_ENUM(struct_, weighting, "area|plain|surface", 0,                                                      \
           "a sample stands for the area that its pixel sees, its pixel, or area over the tangent plane's",  \
           .structural = true)

#ifdef __cplusplus
}
#endif
#endif
