/* OpenColorIO behind a C interface: open a configuration, look at its names, make a transform, list what the
 * transform consists of, apply it on the CPU. The only place (with shim_ocio.cc) that sees OpenColorIO.
 *
 * Threads: a configuration and a transform are constant once made; every function but _free may be called
 * from several threads at a time. Errors from OpenColorIO are RL_E_COLOR with its own words. */
#ifndef RL_RUN_SHIM_OCIO_H
#define RL_RUN_SHIM_OCIO_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_ocio rl_ocio;                     /* a configuration */
typedef struct rl_ocio_transform rl_ocio_transform; /* a processor made from one; keeps what it needs alive */

/* `path` is a config file. Free with rl_ocio_free. */
rl_code rl_ocio_open(const char *path, rl_ocio **out, rl_error *err);
void rl_ocio_free(rl_ocio **ocio);

/* Consistent as a whole (views name spaces that exist, and so on)? For `relit check` and tests; opening does
 * not ask, so that a config with one broken view can still be used for the others. */
rl_code rl_ocio_validate(const rl_ocio *ocio, rl_error *err);

/* A hash of the configuration's text as a name, the same on every machine. Written to out, at most `size`
 * bytes. */
rl_code rl_ocio_fingerprint(const rl_ocio *ocio, char *out, size_t size, rl_error *err);

/* ---- names ------------------------------------------------------------------------------------------- */

typedef enum rl_ocio_list {
    RL_OCIO_SPACES, /* colour spaces, of scene and display, inactive ones included */
    RL_OCIO_DISPLAYS,
    RL_OCIO_VIEWS, /* of the display `of` */
    RL_OCIO_LOOKS,
    RL_OCIO_ROLES,
} rl_ocio_list;

typedef struct rl_ocio_names {
    const char **names; /* in the arena */
    size_t n;
} rl_ocio_names;

rl_code rl_ocio_list_names(const rl_ocio *ocio, rl_ocio_list what, const char *of, rl_arena *arena,
                           rl_ocio_names *out, rl_error *err);

/* Paths of the files that its transforms read, each once, in a fixed order; without those that are not there.
 */
rl_code rl_ocio_files(const rl_ocio *ocio, rl_arena *arena, rl_ocio_names *out, rl_error *err);

/* The colour space that a name, alias or role stands for; NULL when there is none. Lives as long as the
 * configuration. */
const char *rl_ocio_space(const rl_ocio *ocio, const char *name);

/* The colour space holds numbers that are not colours (`isdata`). */
bool rl_ocio_is_data(const rl_ocio *ocio, const char *space);

/* ---- transforms -------------------------------------------------------------------------------------- */

/* From `from` to the colour space `to`, or to `display` and `view` (then `to` is NULL). `look` may be NULL;
 * it is applied to the source, in front of the view. Names as OpenColorIO takes them: aliases and roles
 * included. */
typedef struct rl_ocio_request {
    const char *from;
    const char *to;
    const char *display, *view;
    const char *look;
} rl_ocio_request;

rl_code rl_ocio_transform_new(const rl_ocio *ocio, const rl_ocio_request *request, rl_ocio_transform **out,
                              rl_error *err);
void rl_ocio_transform_free(rl_ocio_transform **transform);

/* Applies it on the CPU, in place, to n pixels of three planes, with exact log, exp and pow. */
rl_code rl_ocio_apply(const rl_ocio_transform *transform, float *r, float *g, float *b, size_t n,
                      rl_error *err);

/* OpenColorIO's own text for a GPU (GLSL 4.0), for a reader; in the arena. */
rl_code rl_ocio_shader(const rl_ocio_transform *transform, rl_arena *arena, char **out, rl_error *err);

/* ---- what a transform consists of -------------------------------------------------------------------- */

typedef enum rl_op_kind {
    RL_OP_MATRIX,
    RL_OP_RANGE,
    RL_OP_LOG,
    RL_OP_CURVES,
    RL_OP_FIXED,
    RL_OP_POWER,
    RL_OP_MONCURVE,
    RL_OP_CDL,
    RL_OP_CONTRAST,
    RL_OP_PRIMARY,
    RL_OP_LUT1D,
    RL_OP_LUT3D,
    RL_OP_OTHER, /* exists in OpenColorIO, has no description here */
} rl_op_kind;

/* What happens to negative input of POWER and MONCURVE; LINEAR is MONCURVE's own line, extended. */
typedef enum rl_op_negative {
    RL_NEGATIVE_CLAMP,
    RL_NEGATIVE_MIRROR,
    RL_NEGATIVE_PASS,
    RL_NEGATIVE_LINEAR
} rl_op_negative;

typedef enum rl_op_fixed {
    RL_FIXED_RED_MOD_03,
    RL_FIXED_RED_MOD_10,
    RL_FIXED_GLOW_03,
    RL_FIXED_GLOW_10,
    RL_FIXED_DARK_TO_DIM_10,
    RL_FIXED_GAMUT_COMP_13,
    RL_FIXED_REC2100_SURROUND,
    RL_FIXED_HSV,
    RL_FIXED_XYY,
    RL_FIXED_UVY,
    RL_FIXED_LUV,
} rl_op_fixed;

/* One quadratic B-spline: n knots, n-1 pieces a·t² + b·t + c with t = x - knot; lines beyond both ends. n =
 * 0: the identity. */
typedef struct rl_op_spline {
    size_t n;
    const float *knots, *a, *b, *c;
} rl_op_spline;

/* One operation. `inverse` turns LOG, CURVES, FIXED, POWER, MONCURVE, CDL, CONTRAST and the tables around;
 * matrices and ranges are given in the direction in which they are applied. */
typedef struct rl_op {
    rl_op_kind kind;
    bool inverse;
    const char *name; /* for people */
    union {
        struct { /* out = m·in + offset, rows listed */
            double m[9], offset[3];
        } matrix;
        struct { /* out = clamp(in·scale + offset); low and high are limits of the output */
            bool has_low, has_high;
            double low, high, scale, offset;
        } range;
        struct { /* log_slope · log_base(lin_slope·x + lin_offset) + log_offset, below lin_break a line */
            double base, log_slope[3], log_offset[3], lin_slope[3], lin_offset[3];
            bool has_break, has_line;
            double lin_break[3], line_slope[3]; /* has_line: the slope of the line, else the curve's own */
        } log;
        struct { /* red, green, blue, then master; lin: between a log2-like curve and its inverse */
            rl_op_spline spline[4];
            bool lin;
        } curves;
        struct {
            rl_op_fixed style;
            double params[8];
        } fixed;
        struct {
            double gamma[3];
            rl_op_negative negative;
        } power;
        struct {
            double gamma[3], offset[3];
            rl_op_negative negative;
        } moncurve;
        struct {
            double slope[3], offset[3], power[3], saturation;
            bool clamp;
        } cdl;
        struct {
            int style; /* 0 linear, 1 video, 2 logarithmic */
            double exposure, contrast, gamma, pivot, log_step, log_grey;
        } contrast;
        struct { /* x + offset; (x - pivot)·slope + pivot; a power of (x - black)/range that keeps the sign,
                    times range,
                    + black; saturation; clamp */
            double offset[3], slope[3], pivot, power[3], black, range, saturation, low, high;
        } primary;
        struct { /* n entries of RGB; domain 0..1, or every half-float bit pattern (n = 65536) */
            size_t n;
            const float *rgb;
            bool half_domain, hue_adjust;
        } lut1d;
        struct { /* n³ entries of RGB, blue fastest */
            size_t n;
            const float *rgb;
            bool tetrahedral;
        } lut3d;
    } u;
} rl_op;

/* The optimized list, in the arena. Empty: the transform changes nothing. */
rl_code rl_ocio_ops(const rl_ocio_transform *transform, rl_arena *arena, rl_op **ops, size_t *n,
                    rl_error *err);

/* Through the role aces_interchange: *linear is true when `space` is linear RGB, and then m (rows listed,
 * column vectors) takes it to ACES2065-1. False too when the config has no such role or the space is data. */
rl_code rl_ocio_to_aces(const rl_ocio *ocio, const char *space, bool *linear, double m[9], rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
