/* From a list of colour operations to OpenCL text. Internal to graph/run/color*.c. */
#ifndef RL_RUN_COLOR_EMIT_H
#define RL_RUN_COLOR_EMIT_H

#include "graph/base/text.h"
#include "graph/run/shim_ocio.h"

/* A program under construction. The body works on three floatv variables r, g, b. */
typedef struct rl_color_text {
    rl_str body;
    rl_arena *arena;
    float *table; /* what the program reads as `tables`; in the arena */
    size_t table_n;
    bool no_memory;
} rl_color_text;

/* The vector functions that bodies call, in front of every program, and behind them those that read tables.
 * Pieces of text, NULL behind the last. */
extern const char *const rl_color_prelude[], *const rl_color_tables[];

/* In front of them, in programs without tables: makes floatv two vectors where that is faster, and defines
 * COLOR_VECTORS, color_load and color_store then. */
extern const char *const rl_color_wide;

/* Appends one operation; false when there is no generator for it (then nothing was appended). */
bool rl_color_emit(rl_color_text *t, const rl_op *op);
bool rl_color_emit_fixed(rl_color_text *t, const rl_op *op);
bool rl_color_emit_cdl(rl_color_text *t, const rl_op *op);
bool rl_color_emit_contrast(rl_color_text *t, const rl_op *op);
bool rl_color_emit_primary(rl_color_text *t, const rl_op *op);
bool rl_color_emit_curves(rl_color_text *t, const rl_op *op);
bool rl_color_emit_lut1d(rl_color_text *t, const rl_op *op);
bool rl_color_emit_lut3d(rl_color_text *t, const rl_op *op);

/* Adds n floats to the table and says where they start; sets no_memory when it cannot. */
size_t rl_color_table_add(rl_color_text *t, const float *values, size_t n);

/* A number as an OpenCL float literal, exact as a float: rl_lit(0.1).text is "0.1f". */
typedef struct rl_lit_text {
    char text[40];
} rl_lit_text;
rl_lit_text rl_lit(double value);

#define RL_LIT(value) (rl_lit(value).text)

#endif
