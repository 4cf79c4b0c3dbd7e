/* The nodes of an experiment, what they cost, and what the whole costs against one variant alone. */
#include <string.h>
#include <strings.h>

#include "graph/base/file.h"
#include "graph/run/experiment_parts.h"

/* In reads or writes of a plane: `relit bench configs/skin.yaml --size 1920x1080`, ratios to the conversions
 * between layouts. */
enum { DECODE_CHANNEL = 21, ENCODE_EXR_CHANNEL = 42, ENCODE_IMAGE_CHANNEL = 84 };

static double step_weight(const rl_plan *plan, const rl_plan_step *step)
{
    double sum = 0;
    for (int i = 0; i < step->n_buffers; i++)
        if (step->buffers[i] >= 0)
            sum += plan->buffers[step->buffers[i]].planes;
    return sum;
}

static double node_weight(const rl_group *g, int node)
{
    const rl_graph_node *n = &g->merged->graph->nodes[node];
    double sum = n->pass->cost ? n->pass->cost(n->params) : 0;
    for (size_t i = 0; i < g->plan->n_steps; i++)
        if (g->plan->steps[i].node == node)
            sum += step_weight(g->plan, &g->plan->steps[i]);
    return sum;
}

/* A variant may have made a node twice: its preview, and the image that is compared. */
static size_t count_used(const bool *used, size_t n)
{
    size_t count = 0;
    for (size_t v = 0; v < n; v++)
        count += used[v];
    return count;
}

bool rl_experiment_node(const rl_experiment *x, size_t capture, size_t i, rl_merged_node *out)
{
    if (capture >= x->n_captures)
        return false;
    const rl_experiment_capture *c = &x->captures[capture];
    for (size_t k = 0; k < c->n_groups; k++) {
        const rl_group *g = &c->groups[k];
        if (i >= g->plan->n_nodes) {
            i -= g->plan->n_nodes;
            continue;
        }
        int node = g->plan->nodes[i].node;
        const rl_graph_node *n = &g->merged->graph->nodes[node];
        *out = (rl_merged_node){.group = k,
                                .node = node,
                                .name = n->name,
                                .pass = n->pass,
                                .used = g->used[node],
                                .n_used = count_used(g->used[node], x->n),
                                .hash = g->merged->nodes[node].content.low,
                                .ms = g->frames ? 1e-6 * g->node_ns[node] / (double)g->frames : -1,
                                .weight = node_weight(g, node)};
        return true;
    }
    return false;
}

/* ---- the whole ------------------------------------------------------------------------------------------
 */

static double node_cost(const rl_group *g, size_t node, bool measured)
{
    return measured ? g->node_ns[node] / (double)g->frames : node_weight(g, (int)node);
}

static double read_cost(const rl_group *g, bool measured)
{
    double planes = 0, steps = 0;
    for (size_t i = 0; i < g->plan->n_buffers; i++)
        planes += g->plan->buffers[i].kind == RL_BUFFER_SOURCE ? g->plan->buffers[i].planes : 0;
    for (size_t i = 0; i < g->plan->n_steps; i++)
        steps += g->plan->steps[i].node < 0 ? step_weight(g->plan, &g->plan->steps[i]) : 0;
    return measured ? (g->load_ns + g->step_ns) / (double)g->frames : DECODE_CHANNEL * planes + steps;
}

static double write_cost(const rl_experiment *x, size_t capture, size_t variant, bool measured)
{
    const rl_session *s = x->sessions[variant];
    const rl_sequence *q = &s->sequences[capture];
    double sum = 0;
    if (!x->variants[variant].files)
        return 0;
    if (measured)
        return x->captures[capture].write_ns[variant] / (double)x->captures[capture].write_frames;
    for (size_t o = 0; o < s->n_outputs; o++) {
        const rl_graph_output *out = &q->graph->outputs[q->first_output + o];
        bool exr = !strcasecmp(rl_path_extension(s->outputs[o].spec->file), ".exr");
        for (size_t i = 0; i < out->n_images; i++) {
            const rl_image *image = &q->graph->images[out->images[i]];
            sum += exr ? ENCODE_EXR_CHANNEL * (image->planes + (image->format == RL_RGB))
                       : ENCODE_IMAGE_CHANNEL * image->planes;
        }
    }
    return sum;
}

/* Of one capture, weighted by its frames: `all` together, `one` of variant 0, `sum` of each alone. */
static void add_capture(const rl_experiment *x, size_t capture, bool measured, double *all, double *one,
                        double *sum)
{
    const rl_experiment_capture *c = &x->captures[capture];
    const double frames = (double)rl_experiment_sequence(x, 0, capture)->frames.n;
    for (size_t k = 0; k < c->n_groups; k++) {
        const rl_group *g = &c->groups[k];
        const double read = read_cost(g, measured);
        *all += frames * read;
        for (size_t i = 0; i < g->merged->graph->n_nodes; i++) {
            bool any = false;
            double cost = frames * node_cost(g, i, measured);
            for (size_t v = 0; v < x->n; v++) {
                any |= g->wanted[i][v];
                *sum += g->wanted[i][v] ? cost : 0;
            }
            *one += g->wanted[i][0] ? cost : 0;
            *all += any ? cost : 0;
        }
        for (size_t m = 0; m < g->n; m++) {
            double write = frames * write_cost(x, capture, g->members[m], measured);
            *all += write;
            *sum += write + frames * read;
            *one += g->members[m] == 0 ? write + frames * read : 0;
        }
    }
}

void rl_experiment_cost_of(const rl_experiment *x, rl_experiment_cost *out)
{
    double all = 0, one = 0, sum = 0;
    bool measured = x->n_captures > 0;
    for (size_t k = 0; k < x->n_captures; k++)
        for (size_t g = 0; g < x->captures[k].n_groups; g++)
            measured &= x->captures[k].groups[g].frames > 0 && x->captures[k].write_frames > 0;
    for (size_t k = 0; k < x->n_captures; k++)
        add_capture(x, k, measured, &all, &one, &sum);
    *out = (rl_experiment_cost){
        .factor = one > 0 ? all / one : 0, .sum = one > 0 ? sum / one : 0, .measured = measured};
}
