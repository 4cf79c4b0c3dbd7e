/* Inside of rl_ab_measure: ab_measure.c, ab_values.c, ab_null.c and ab_against.c. */
#ifndef RL_TOOL_AB_MEASURE_PARTS_H
#define RL_TOOL_AB_MEASURE_PARTS_H

#include "graph/tool/ab.h"

/* Pixels of a frame by material: those of material m are at order[begin[m]] … order[begin[m + 1] - 1]; those
 * of none are left out. */
typedef struct rl_ab_pixels {
    uint32_t *order; /* [room of the measure] */
    size_t *begin;   /* [n_materials + 1]; begin[0] = begin[1] = 0: material 0 is "none" */
    size_t room_materials, n_materials, n_pixels;
} rl_ab_pixels;

/* One that is compared with a group's reference. */
typedef struct rl_ab_test {
    int variant;
    int pair; /* of the plan, or -1: a pair of replicates */
} rl_ab_test;

/* All comparisons with one reference: what depends on it alone is computed once. */
typedef struct rl_ab_group {
    int reference; /* variant, or RL_AB_AGAINST */
    const rl_ab_test *tests;
    size_t n_tests;
} rl_ab_group;

/* ab_values.c: the stencil's materials below `n_materials`; an index at or above it is RL_E_INTERNAL. */
rl_code rl_ab_pixels_sort(rl_ab_pixels *pixels, const rl_experiment_frame *frame, rl_error *err);
/* Statistics of a map for the materials and, last, for all of them: out[n_materials], out[0] unused;
 * counts[n_materials + 1] and stats[n_materials + 1], [0]: all. Two tasks, `part` 0 and 1, that may run at a
 * time: all pixels, and those of each material. RL_E_MEMORY. */
typedef struct rl_ab_sums {
    size_t pixels;
    double stats[RL_STATS];
} rl_ab_sums;
rl_code rl_ab_pixels_stats(const rl_ab_pixels *pixels, rl_metric metric, const float *map, double peak,
                           int part, rl_ab_sums *sums, rl_error *err);

struct rl_ab_measure {
    const rl_ab_plan *plan;
    const rl_experiment *experiment;
    rl_pool *pool;
    rl_arena arena;
    rl_ab_group *groups;
    size_t n_groups;
    size_t most_tests, most_replicates; /* of a group */
    struct rl_ab_against *against;
    rl_compared_image files[RL_COMPARED]; /* of --against */
    /* the frame */
    size_t room;      /* pixels that the buffers hold */
    float *display;   /* [variants][3] planes, clamped */
    float *rounded;   /* [most_tests][3] planes, as a file of integers would hold them; for --against */
    float *maps;      /* [n_pairs][RL_METRICS] */
    float *scratch;   /* [most_replicates] */
    bool *measured;   /* [n_pairs][RL_METRICS] */
    rl_ab_sums *sums; /* [most_tests][room_materials] */
    rl_ab_pixels pixels;
    rl_ab_size *sizes; /* [captures] */
    /* what was measured */
    rl_ab_value *values;
    size_t n_values, room_values;
    /* [captures][materials of the capture][RL_METRICS], material 0 stands for all; and how they were before
     * the frame */
    rl_ab_null *nulls, *nulls_before;
    size_t n_nulls, *first_null;
};

/* ab_measure_images.c: the first value of a variant's images that is not finite is RL_E_DATA; clamps the
 * display image into m->display. */
rl_code rl_ab_measure_check(const rl_ab_measure *m, const rl_experiment_frame *frame, size_t variant,
                            rl_error *err);
/* ab_measure_new.c: frees the buffers of the frame. */
void rl_ab_measure_empty(rl_ab_measure *m);

/* n values to the nearest of 0 … levels, as fractions of it. */
void rl_ab_round(const float *in, size_t n, int levels, float *out);
/* An image of a checked variant, as metrics take it. */
rl_metric_image rl_ab_measure_view(const rl_ab_measure *m, const rl_experiment_frame *frame, int variant,
                                   rl_compared which);
rl_metric_image rl_ab_view(const rl_compared_image *image, bool encoded);

/* ab_null.c: takes a value of a pair of replicates into the bounds. */
void rl_ab_null_add(rl_ab_null *null, const rl_ab_sums *sums);

/* ab_against.c: the files of --against. */
typedef struct rl_ab_against rl_ab_against;
rl_code rl_ab_against_new(const rl_ab_plan *plan, const rl_experiment *experiment, rl_pool *pool,
                          const rl_log *log, rl_ab_against **out, rl_error *err);
void rl_ab_against_free(rl_ab_against **against);
/* Are two variants compared with the same files in this frame? */
rl_code rl_ab_against_same(rl_ab_against *against, const rl_experiment_frame *frame, int a, int b, bool *same,
                           rl_error *err);
/* The reference of a variant at a frame: plane[0] of an image that the files do not give is NULL. Valid until
 * the next call. The display's is rounded to `levels` by rl_ab_round. RL_E_IO: no file; RL_E_DATA: another
 * size or data window, NaN; RL_E_FORMAT. */
rl_code rl_ab_against_read(rl_ab_against *against, const rl_experiment_frame *frame, int variant,
                           rl_compared_image out[RL_COMPARED], int *levels, rl_error *err);

#endif
