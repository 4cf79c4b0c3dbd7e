/* Rows of the material table that more than one pass reads. A row is the same wherever it is declared, but for what
 * makes it required: that is the pass's own. */
#ifndef RL_PASSES_SHADING_ROWS_H
#define RL_PASSES_SHADING_ROWS_H

#include "graph/model/pass.h"

/* RL_ROW_SCATTER_DISTANCE(.required = true) */
#define RL_ROW_SCATTER_DISTANCE(...)                                                                         \
    M(RL_RGBF, scatter_distance_mm, 1e-4, 1e4, 0, "mm",                                                      \
      "scattering distance d = 1/s a channel, for Burley's profile",                                         \
      .source = "Christensen and Burley 2015", .no_default = true, __VA_ARGS__)
#define RL_ROW_TEXTURING                                                                                     \
    M_ENUM(texturing, "post|pre_post", 0, "albedo on the way out, or its square root on both ways",          \
           .source = "d'Eon 2007")
#define RL_ROW_BORDER                                                                                        \
    M_ENUM(border, "renormalize|occlude", 0,                                                                 \
           "samples of other materials and outside of the image: not counted, or black")
#define RL_ROW_DIFFUSE                                                                                       \
    M_ENUM(diffuse, "disney|lambert|sg", 0,                                                                  \
           "how light crosses the surface, in and out; sg: as lambert, and profiles scatter in the lighting",  \
           .source = "Burley 2015; MJP")
#define RL_ROW_EXIT_TRANSMISSION                                                                             \
    M_ENUM(exit_transmission, "sss|lighting", 0,                                                             \
           "where the way out is applied: behind the filter, or before it as in the talk",                   \
           .source = "Golubev 2018")

#endif
