/* Inside of rl_ab_sheet: ab_sheet.c and ab_sheet_draw.c. */
#ifndef RL_TOOL_AB_SHEET_PARTS_H
#define RL_TOOL_AB_SHEET_PARTS_H

#include "graph/tool/ab_sheet.h"

/* Pixels. A cell is a tile, its label below it, and the gap to the next ones. */
typedef struct rl_ab_layout {
    int columns, rows;
    int tile_width, tile_height; /* of the shrunken image; never enlarged */
    int cell_width, cell_height;
    int width, height; /* of the sheet */
    int text;          /* height of a line of the labels */
} rl_ab_layout;

typedef struct rl_ab_tile {
    float *pixels;         /* three planes of tile_width · tile_height, encoded, 0 … 1; owned */
    double flip[RL_STATS]; /* against the last variant; not of the last one itself */
} rl_ab_tile;

struct rl_ab_sheet {
    const rl_ab_plan *plan;
    size_t index;
    const char *title;
    rl_pool *pool;
    bool taken;
    long long frame;
    rl_ab_layout layout;
    rl_ab_tile *tiles; /* [n_listed] */
};

/* As near to 16:10 as the number of tiles allows, within RL_AB_SHEET_MOST. */
void rl_ab_layout_make(size_t n, int width, int height, rl_ab_layout *out);

/* The mean of the light that each pixel of the tile covers; the display is taken for an sRGB one. */
rl_code rl_ab_tile_shrink(const rl_metric_image *image, const rl_ab_layout *layout, rl_pool *pool,
                          rl_ab_tile *out, rl_error *err);

/* Fills planes of layout.width · layout.height. */
rl_code rl_ab_sheet_draw(const rl_ab_sheet *sheet, float *const plane[3], rl_error *err);

#endif
