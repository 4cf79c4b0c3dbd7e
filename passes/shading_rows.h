/* Rows of the material table that more than one pass reads. A row is the same wherever it is declared. */
#ifndef RL_PASSES_SHADING_ROWS_H
#define RL_PASSES_SHADING_ROWS_H

#include "graph/model/pass.h"

#define RL_ROW_TEXTURING                                                                                     \
    M_ENUM(texturing, "post|pre_post", 0, "where albedo is applied: at the exit, or its root at both ends",  \
           .source = "d'Eon 2007, Golubev 2018")
#define RL_ROW_SCATTER_DISTANCE                                                                              \
    M(RL_RGBF, scatter_distance_mm, 1e-3, 1e3, 1, "mm", "scattering distance d = 1/s of Burley's profile",   \
      .source = "Burley 2015", .required = true)
#define RL_ROW_DIFFUSE                                                                                       \
    M_ENUM(diffuse, "disney|lambert", 0, "diffuse transmission through the surface: Disney's F_dt, or one",  \
           .source = "Golubev 2018, without the retro-reflection f_rr")
#define RL_ROW_EXIT_TRANSMISSION                                                                             \
    M_ENUM(exit_transmission, "sss|lighting", 0, "where F_dt(n.v) is applied: after the filter, or before",  \
           .source = "Golubev 2018")

/* Words of the rows, in their order; the kernels have the same numbers. */
enum { TEXTURING_POST = 0, TEXTURING_PRE_POST = 1 };
enum { DIFFUSE_DISNEY = 0, DIFFUSE_LAMBERT = 1 };
enum { EXIT_IN_SSS = 0, EXIT_IN_LIGHTING = 1 };

#endif
