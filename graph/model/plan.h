/* The plan: what runs, in which order, in which memory. Made from a graph alone: no OpenCL, no pixel, no
 * size; the same graph gives the same plan. Constant once made. */
#ifndef RL_MODEL_PLAN_H
#define RL_MODEL_PLAN_H

#include "graph/model/graph.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Sizes that follow from a frame's data window; see kernels/shared.h. */
typedef struct rl_geometry {
    int x, y, width, height; /* data window, display-window pixels */
    int columns, rows;       /* of the buffers: multiples of 64 and 4 */
    int origin_x, origin_y;  /* display-window pixel of buffer pixel (0, 0): multiples of 64 and 4 */
    int stride, plane;       /* floats */
    int stride4, plane4;
} rl_geometry;

/* RL_E_MEMORY when the sizes do not fit an int, RL_E_FORMAT when the window is empty. */
rl_code rl_geometry_make(int x, int y, int width, int height, rl_geometry *out, rl_error *err);

typedef enum rl_buffer_class {
    RL_BUFFER_SOURCE,    /* filled by the frame's source; one per frame in flight */
    RL_BUFFER_TRANSIENT, /* shares a slot with others whose lives do not overlap; one for the device */
    RL_BUFFER_SINK,      /* read by the writer after the frame's kernels; one per frame in flight */
    RL_BUFFER_HISTORY,   /* a pair that swaps after the frame: an image whose past somebody reads */
} rl_buffer_class;

/* A buffer: one image in one layout. */
typedef struct rl_buffer {
    int image;        /* of the graph, or -1: scratch of a node */
    const char *name; /* the image's, or "sss.filtered" for a scratch port */
    rl_layout layout;
    int planes; /* 0: RL_SUMS */
    rl_buffer_class kind;
    int slot;        /* TRANSIENT: the slot that it lives in; else -1 */
    int first, last; /* steps, inclusive, during which it holds something; SOURCE: first = -1; SINK, and a
                        SOURCE that the writer reads: last = n_steps; HISTORY: both */
} rl_buffer;

typedef enum rl_step_kind {
    RL_STEP_KERNEL,  /* a step of a pass */
    RL_STEP_CONVERT, /* layout to layout: arguments are source and destination */
    RL_STEP_COPY,    /* buffer to buffer of the same shape: keeps history of a capture layer, feeds a sink */
} rl_step_kind;

typedef struct rl_plan_step {
    rl_step_kind kind;
    int node;           /* KERNEL: of the graph; else -1 */
    int step;           /* KERNEL: index into the pass's steps */
    const int *buffers; /* KERNEL: one a port, -1 = NULL; CONVERT and COPY: {source, destination} */
    int n_buffers;
} rl_plan_step;

/* What a node's program depends on besides its source. */
typedef struct rl_plan_node {
    int node;
    const int *buffers; /* a port: the buffer, or -1 */
} rl_plan_node;

/* A HISTORY port's buffer in `buffers` is the pair's; the executor binds its older half. Every other use of
 * such a buffer (ports that read or write it, CONVERT, COPY) means the younger half. An image of a node whose
 * past is read, by that node or by another, lives in the pair itself. A capture layer's past is a pair of its
 * own, whose younger half is filled by a COPY step at the end of the plan, or by a CONVERT step when the past
 * is wanted in another layout. */
typedef struct rl_plan {
    const rl_graph *graph;
    const rl_buffer *buffers;
    size_t n_buffers;
    const rl_plan_step *steps;
    size_t n_steps;
    const rl_plan_node *nodes; /* live nodes, in order of execution */
    size_t n_nodes;
    const int *slot_planes; /* [n_slots]: planes of the largest buffer in the slot */
    size_t n_slots;
    const int *const
        *outputs;      /* [graph->n_outputs][n_images]: the buffer that the writer reads (SOURCE or SINK) */
    const int *culled; /* nodes that no output needs */
    size_t n_culled;
} rl_plan;

/* Only memory can fail. */
rl_code rl_plan_make(rl_arena *arena, const rl_graph *graph, const rl_plan **out, rl_error *err);

/* RL_E_MEMORY when a buffer has more samples than the kernels' int can index: many shadow planes at a large
 * size. */
rl_code rl_plan_fits(const rl_plan *plan, const rl_geometry *g, rl_error *err);

/* Bytes of one copy of a buffer, guards included. */
size_t rl_buffer_bytes(const rl_buffer *buffer, const rl_geometry *g);
/* How many copies exist at once: a SOURCE or SINK for each frame in flight, both halves of a pair, else 1. */
size_t rl_buffer_copies(const rl_buffer *buffer, int in_flight);
/* Bytes of a slot: the largest buffer that lives in it. */
size_t rl_slot_bytes(const rl_plan *plan, int slot, const rl_geometry *g);
/* These saturate at SIZE_MAX. Device memory for `in_flight` frames, and what it would be if no buffer shared
 * a slot. */
size_t rl_plan_bytes(const rl_plan *plan, const rl_geometry *g, int in_flight);
size_t rl_plan_bytes_unshared(const rl_plan *plan, const rl_geometry *g, int in_flight);

/* `relit plan` (plan_print.c, plan_dot.c): text for people, graphviz, JSON. g may be NULL: no bytes. */
struct rl_str;                                          /* graph/base/text.h */
const char *rl_layout_name(rl_layout layout);           /* "linear", "phase4" */
const char *rl_buffer_class_name(rl_buffer_class kind); /* "source", "transient", "sink", "history" */
void rl_plan_print_text(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out);
void rl_plan_print_dot(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out);
rl_code rl_plan_print_json(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out,
                           rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
