/* Rows of the material table that more than one pass reads. A row is the same wherever it is declared, but
 * for what makes it required: that is the pass's own. */
#ifndef RL_PASSES_SHADING_ROWS_H
#define RL_PASSES_SHADING_ROWS_H

#include "graph/model/pass.h"

/* The words of `param`, burley.c. */
#define RL_SCATTER_FORMS 5
extern const rl_form rl_scatter_forms[RL_SCATTER_FORMS];

/* RL_ROW_SCATTER_DISTANCE(.required = true) */
#define RL_ROW_SCATTER_DISTANCE(...)                                                                         \
    M(RL_RGBF, scatter_distance_mm, 1e-4, 1e4, 0, "mm",                                                      \
      "scattering distance d = 1/s a channel, for Burley's profile",                                         \
      .source = "Christensen and Burley 2015", .no_default = true, .form_row = "param",                      \
      .forms = {rl_scatter_forms, RL_SCATTER_FORMS}, __VA_ARGS__)
/* What the forms of scatter_distance_mm are computed from (burley.c). */
#define RL_ROWS_SCATTER_PARAM                                                                                \
    M_ENUM(param, "scatter_distance|mean_free_path|mean_free_path_diffuse|cycles_radius|unreal_dmfp", 0,     \
           "in which numbers the profile's width is given, see scatter_distance_mm"),                        \
        M(RL_RGBF, mean_free_path_mm, 1e-6, 1e6, 0, "mm", "mean free path l in the volume, a channel",       \
          .no_default = true),                                                                               \
        M(RL_RGBF, cycles_radius_mm, 1e-6, 1e6, 0, "mm",                                                     \
          "radius times scale of a Cycles material, a channel",                                              \
          .source = "Blender, Subsurface Scattering node, Christensen-Burley", .no_default = true),          \
        M(RL_RGBF, diffuse_mean_free_path_mm, 1e-6, 1e6, 0, "mm",                                            \
          "diffuse mean free path l_d, a channel; in Unreal the product of its colour, distance and world "  \
          "unit scale",                                                                                      \
          .no_default = true),                                                                               \
        M(RL_RGBF, albedo, 0, 1, 0, "ratio",                                                                 \
          "reflectance A of the surface that the other renderer was told; only for the formulas of param",   \
          .no_default = true)
#define RL_ROW_TEXTURING                                                                                     \
    M_ENUM(texturing, "post|pre_post", 0, "albedo on the way out, or its square root on both ways",          \
           .source = "d'Eon 2007")
#define RL_ROW_BORDER                                                                                        \
    M_ENUM(border, "renormalize|occlude", 0,                                                                 \
           "samples of other materials and outside of the image: not counted, or black")
#define RL_ROW_DIFFUSE                                                                                       \
    M_ENUM(                                                                                                  \
        diffuse, "disney|lambert|sg", 0,                                                                     \
        "how light crosses the surface, in and out; sg: as lambert, and profiles scatter in the lighting",   \
        .source = "Burley 2015; MJP")
#define RL_ROW_EXIT_TRANSMISSION                                                                             \
    M_ENUM(exit_transmission, "sss|lighting", 0,                                                             \
           "where the way out is applied: behind the filter, or before it as in the talk",                   \
           .source = "Golubev 2018")
#define RL_ROW_TRANSMISSION                                                                                  \
    M_ENUM(transmission, "none|thin|thick|beer_lambert|gather", 0,                                           \
           "light from the back face: guessed in the lighting, or gathered by pass translucency",            \
           .source = "Golubev 2018; Helix")
#define RL_ROW_TRANSMIT                                                                                      \
    M(RL_BOOL, transmission, 0, 1, 1, "", "false switches off the transmission that profiles ask for")
#define RL_ROW_METALLIC                                                                                      \
    M(RL_F32, metallic, 0, 1, -1, "ratio",                                                                   \
      "1: albedo is the specular colour and nothing is diffuse; not given: the metallic layer, else 0",      \
      .no_default = true)

/* The ports that scattering filters have for the ledger of energy; layout_ is that of what they filter. */
#define RL_SCATTER_LEDGER(layout_)                                                                           \
    {"border",                                                                                               \
     RL_SCRATCH,                                                                                             \
     RL_RGB,                                                                                                 \
     .help = "light lost to what is of another material",                                                    \
     .layout = (layout_),                                                                                    \
     .with = "energy"},                                                                                      \
        {"off_screen",        RL_SCRATCH,      RL_RGB, .help = "light lost beyond the image",                \
         .layout = (layout_), .with = "energy"},                                                             \
        {"clamped",           RL_SCRATCH,      RL_RGB, .help = "light that clamps cut off",                  \
         .layout = (layout_), .with = "energy"},                                                             \
        {"redistributed",     RL_SCRATCH,      RL_RGB, .help = "light given back for what is lost",          \
         .layout = (layout_), .with = "energy"},                                                             \
        RL_PORT_ENERGY
#define RL_PORT_ENERGY                                                                                       \
    {                                                                                                        \
        "energy", RL_REDUCTION, RL_SUMS, .help = "the ledger: sums of each material"                         \
    }

#endif
