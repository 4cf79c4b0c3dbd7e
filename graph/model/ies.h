/* Photometric files, IES(NA) LM-63-1991 to 2019: how bright a lamp is in each direction.
 *
 * Type C photometry, TILT=NONE, one or more lamps. Vertical angles are 0 … 90, 90 … 180 or 0 … 180 degrees (0
 * is down); horizontal ones 0 alone (the same all around), 0 … 90 (four equal quarters), 0 … 180 or 90 … 270
 * (two equal halves), 0 … 360. Candela are multiplied by the file's multiplier, ballast factor and (before
 * 2002; 2019 has how the file was made in its place) ballast-lamp factor. What the file does not cover is
 * dark. */
#ifndef RL_MODEL_IES_H
#define RL_MODEL_IES_H

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RL_IES_MOST_ANGLES = 2048 }; /* of a kind, in a file */

/* A regular table, bilinear between its entries. Its steps are the smallest ones of the file (at least half a
 * degree down, 2.5 degrees around), so that a file with even steps is met exactly. Constant; in the arena. */
typedef struct rl_ies {
    int vertical;   /* rows: row i is for pi i/(vertical - 1) off straight down */
    int horizontal; /* columns: column j for 2 pi j/(horizontal - 1), the last as the first; 1: all equal */
    const float *value; /* [vertical * horizontal], of the largest: 0 … 1 */
    double candela;     /* the largest, > 0 */
} rl_ies;

/* `name` is what errors call the file: "lamp.ies:12: …", RL_E_FORMAT. */
rl_code rl_ies_parse(rl_arena *arena, const char *text, const char *name, const rl_ies **out, rl_error *err);
rl_code rl_ies_load(rl_arena *arena, const char *path, const rl_ies **out, rl_error *err);

/* The integral of the table over the directions up to `angle` (radians) off straight down, sr. */
double rl_ies_integral(const rl_ies *ies, double angle);

#ifdef __cplusplus
}
#endif
#endif
