/* The ledger of energy: what goes into a node of the graph, what comes out of it, and what becomes of the
 * rest, a material and a channel at a time. A pass keeps it in a REDUCTION port named "energy"
 * (graph/model/pass.h, kernels/energy.cl), and only where an output of the graph names that: "sss.energy".
 * Images have the same bits with it and without.
 *
 * All values are sums over the pixels of a material (or over all pixels) of scene-linear radiance in the
 * working space: what the camera gets, up to the area of a pixel.
 *
 * The scattering filters and combine: the light that goes through the filter, without `lit`. All values are
 * times exit(albedo) F_out of their pixel: what would leave the surface.
 *
 * - in: diffuse, before the filter.
 *
 * - out: behind the filter; combine has none: its color less lit.
 *
 * - border: in, times the share of the filter's weights that lies on pixels of other materials or of none.
 *
 * - off_screen: in, times the share of the weights that lies outside of the image.
 *
 * - clamped: what clamps took from the result; negative: what they gave to it.
 *
 * - redistributed: out before clamps, less the same sum divided by all weights, rejected ones included: what
 * dividing by the weights that are left puts in the place of what is lost; 0 with border: occlude. With
 * weighting: surface also what dividing by the plane's weights changes.
 *
 * A sample of another material weighs what it would on a plane parallel to the screen (weighting: surface: on
 * the tangent plane), as in the divisor of border: occlude. A sample of the same material at another depth is
 * not rejected: it weighs what its distance says, and nothing is lost by that. sss_gaussian loses in each of
 * its steps; what the columns lose is of the light that the rows have moved.
 *
 * taa: in is this frame's color, out the result; clamped is what the clip to the neighbours' colours takes
 * from the history, less what keeps a resampled history from going below its darkest sample gives to it, and
 * redistributed what the history adds before that, history less color; both times the history's weight.
 * Nothing is lost at borders or off screen: where there is no history, the frame stays as it is.
 *
 * lighting: in is emission, out diffuse and lit: what the lights give is the difference. `diffuse` has not
 * gone through exit(albedo) and F_out there.
 *
 * The ledger closes when out = in - border - off_screen - clamped + redistributed. In combine and taa every
 * pixel closes, and so does every evenly lit pixel of a filter. Otherwise a filter closes in the sum over a
 * material where two pixels weigh the same for each other: on a plane parallel to the screen, weighting:
 * plain, one albedo, taps that are the same turned by 180 degrees. What is open elsewhere (rl_energy_open) is
 * light that went to pixels of another albedo, area or angle, and the noise of a few taps. */
#ifndef RL_RUN_ENERGY_H
#define RL_RUN_ENERGY_H

#include <stddef.h>

#include "graph/base/error.h"
#include "graph/model/plan.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_energy {
    double in[3], out[3], border[3], off_screen[3], clamped[3], redistributed[3];
    double pixels;
} rl_energy;

/* What the sums of a frame (RL_SUM_FLOATS of kernels/shared.h) say of a material, a dense index below the
 * frame's number of materials. The same bits for every number of threads. */
void rl_energy_read(const float *sums, size_t material, rl_energy *out);
void rl_energy_add(rl_energy *to, const rl_energy *what);

/* |in - out| / in, of the channel where it is largest; 0 where nothing goes in and nothing comes out,
 * infinite where only something comes out. */
double rl_energy_imbalance(const rl_energy *e);
/* |out - (in - border - off_screen - clamped + redistributed)| / in, likewise. */
double rl_energy_open(const rl_energy *e);

/* ---- the ledger of a run ---- */

enum { RL_ENERGY_ALL = -1 }; /* as a material: all pixels */

typedef struct rl_energy_row {
    size_t capture, variant;
    const char *node;    /* of the graph; lives as long as that */
    const rl_pass *pass; /* .conserves: out should be what goes in */
    long long frame;
    int material; /* dense index, or RL_ENERGY_ALL */
    rl_energy energy;
} rl_energy_row;

/* Rows in the order in which they came; zero is empty. */
typedef struct rl_energy_ledger {
    rl_energy_row *rows;
    size_t n, room;
} rl_energy_ledger;

void rl_energy_ledger_free(rl_energy_ledger *ledger);
/* Rows for what the sums of one node hold: RL_ENERGY_ALL first, then each of `n_materials` that has any
 * value. `row` gives the rest. RL_E_MEMORY leaves the ledger as it was. */
rl_code rl_energy_ledger_add(rl_energy_ledger *ledger, const rl_energy_row *row, const float *sums,
                             size_t n_materials, rl_error *err);

/* A copy of one row. RL_E_MEMORY leaves the ledger as it was. */
rl_code rl_energy_ledger_push(rl_energy_ledger *ledger, const rl_energy_row *row, rl_error *err);

/* The image "NODE.energy" of a graph's node, or -1: the pass keeps no ledger. */
int rl_energy_image(const rl_graph *graph, size_t node);

#ifdef __cplusplus
}
#endif
#endif
