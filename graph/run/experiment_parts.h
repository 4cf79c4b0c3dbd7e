/* What experiment*.c share. */
#ifndef RL_RUN_EXPERIMENT_PARTS_H
#define RL_RUN_EXPERIMENT_PARTS_H

#include "graph/model/graph_merge.h"
#include "graph/run/batch.h"
#include "graph/run/experiment.h"
#include "graph/run/session.h"

enum {
    RL_HIDDEN_REQUIRED, /* behind a session's outputs: depth and stencil */
    RL_HIDDEN_COMPARED  /* then the images of rl_compared */
};

/* Variants that read frames alike. The first member leads: its sequence has the group's reader and executor.
 */
typedef struct rl_group {
    size_t *members; /* variants, ascending */
    size_t n;
    const char *reason; /* why it is not in a group before it */
    const rl_merged *merged;
    const rl_plan *plan;
    bool **used;     /* [nodes][variants] */
    bool **wanted;   /* the same, for outputs that are files alone */
    double *node_ns; /* [nodes]: on the device, of all frames that ran */
    double step_ns;  /* of conversions and copies */
    double load_ns;  /* reading */
    size_t frames;   /* that ran and are in these sums: the first only until there is a second, since it has
                        programs to compile and files to find */
    bool warm;       /* the first is left out */
} rl_group;

typedef struct rl_experiment_capture {
    rl_group *groups;
    size_t n_groups;
    int in_flight;
    double *write_ns; /* [variants]: of write_frames frames, the first left out in the same way */
    size_t write_frames;
    bool write_warm;
} rl_experiment_capture;

struct rl_experiment {
    rl_arena arena;
    rl_options options;
    const rl_log *log;
    const rl_variant *variants;
    rl_session **sessions; /* [n] */
    size_t n;
    rl_experiment_capture *captures;
    size_t n_captures;
    rl_device *device;
};

static inline rl_sequence *rl_experiment_sequence(const rl_experiment *x, size_t variant, size_t capture)
{
    return &x->sessions[variant]->sequences[capture];
}

/* experiment_energy.c: an output behind all others of the group's merged graph, the sums of all nodes that
 * keep a ledger. *out is the graph itself when that is not wanted. */
rl_code rl_experiment_want_energy(rl_experiment *experiment, const rl_group *group, const rl_graph **out,
                                  rl_error *err);
/* What they hold of a frame that ran, a row for each variant that needs the node. */
rl_code rl_experiment_read_energy(const rl_experiment *experiment, size_t capture, size_t group,
                                  const rl_frame *frame, rl_energy_ledger *out, rl_error *err);

/* experiment_groups.c: groups, merged graphs and plans of a capture, in the sessions' sequences too. */
rl_code rl_experiment_merge(rl_experiment *experiment, size_t capture, rl_error *err);

/* A frame on its way through reading, kernels and writing, of all groups. */
typedef struct rl_run_slot {
    rl_frame *frames;  /* [groups] */
    rl_loaded *loaded; /* [groups] */
    rl_error error;    /* of any group */
    bool skipped;
} rl_run_slot;

/* The run of one capture. */
typedef struct rl_capture_run {
    rl_experiment *x;
    size_t capture;
    rl_experiment_capture *c;
    const rl_experiment_hooks *hooks;
    rl_run_hooks notes; /* its stage and span, as sessions take them */
    rl_run_summary *summary;
    rl_run_slot slots[RL_MOST_IN_FLIGHT];
    rl_span **spans;          /* [groups][steps] */
    rl_scene_values **scenes; /* [groups][members] */
    size_t done, total;
    rl_arena arena;
} rl_capture_run;

/* experiment_write.c: the end of a frame, on the writing thread: its files are written, the hook gets files,
 * images and energy of all variants or the frame's error (the hook's own becomes the frame's), the summary
 * counts it. Releases the slot's frames. */
void rl_experiment_write(rl_capture_run *run, size_t item, rl_run_slot *slot);

#endif
