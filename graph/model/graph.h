/* The graph: nodes and images, every name resolved to an index, formats checked, cycles found. Constant once
 * made. */
#ifndef RL_MODEL_GRAPH_H
#define RL_MODEL_GRAPH_H

#include "graph/base/log.h"
#include "graph/model/materials.h"
#include "graph/model/pipeline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A layer that the capture can give, after conversion (DESIGN 2). "shadow" and "shadow_thickness" stand for a
 * plane per light (RL_LIGHTS, planes = number of active lights with such a layer, absent when 0); besides
 * there is one RL_SCALAR layer for each light of the capture, "shadow.key". */
typedef struct rl_layer_info {
    const char *name;
    rl_format format;
    int planes;
} rl_layer_info;

typedef struct rl_image {
    const char *name; /* "sss.color", "capture.albedo" */
    rl_format format;
    int planes;
    int node; /* producer, or -1: a capture layer */
    int port; /* index into the producer's ports, or into the layers that were given */
} rl_image;

typedef struct rl_graph_node {
    const char *name;
    rl_where where;
    const rl_pass *pass;
    const void *params;
    const int *images; /* a port: the image that it reads or writes, or whose past it reads; -1: absent, or
                          scratch */
    int scene; /* whose materials, lights and ambient light it reads: 0, or of a merged graph's variant
                  (graph_merge.h) */
} rl_graph_node;

typedef struct rl_graph_output {
    const char *name;
    const int *images; /* an image a layer, in the order of the pipeline's output */
    size_t n_images;
} rl_graph_output;

typedef struct rl_graph {
    const rl_image *images;
    size_t n_images;
    const rl_graph_node *nodes; /* the pipeline's in its order, then those that were added */
    size_t n_nodes;
    const rl_graph_output *outputs; /* what is wanted, in order */
    size_t n_outputs;
} rl_graph;

/* An output that the graph must make: `layers[i]` names an image; `convert[i]` (may be NULL) is a pass with
 * one READ and one WRITE port, such as a colour transform, that is put between that image and the output as a
 * node of its own, "output.NAME" or, with several layers, "output.NAME.LAYER". An image of another format
 * than that port's stays as it is beside others in one file (data is not colour), and is an error on its own.
 */
typedef struct rl_wanted {
    const char *name;
    rl_where where;
    const rl_output_layer *layers;
    const rl_pass *const *convert;
    const void *const *convert_params;
    size_t n_layers;
} rl_wanted;

/* Binds ports: a named input to its image; an unnamed one to the capture layer of the port's name; an
 * optional one without such a layer stays absent, and one whose image is named "none"; else an error that
 * names node, pass, port and layer.
 * Errors: unknown image, node, port (nearest name), a wrong format ("port 'depth' takes a scalar,
 * 'light.diffuse' is rgb"), an input given twice, a cycle (printed whole: "sss -> aa -> sss"; history makes
 * no edge). */
rl_code rl_graph_build(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_layer_info *layers,
                       size_t n_layers, const rl_wanted *wanted, size_t n_wanted, const rl_graph **out,
                       rl_error *err);

/* Fails where a material needs an optional port (rl_port.needed_by), a key of its profile
 * (rl_param.needed_by) or a pass (rl_pass.fulfils) that is absent: the error names pass, material, and port
 * and layer, or key. */
rl_code rl_graph_check_needs(rl_arena *arena, const rl_graph *graph, const rl_materials *materials,
                             rl_error *err);

/* The image of that name, "aa.color" or "capture.depth", or -1. */
int rl_graph_find(const rl_graph *graph, const char *name);
const char *rl_format_name(rl_format format); /* "rgb", "normal", "vec2", "scalar", "id", "lights" */

#ifdef __cplusplus
}
#endif
#endif
