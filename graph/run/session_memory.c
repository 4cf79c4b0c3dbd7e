/* What a run will allocate, told before it allocates. */
#include <jansson.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/run/session_state.h"

/* Tables, programs' texts, names, paths: measured at 0.6 MB, and 0.3 MB a thread of a compressor. */
enum { FIXED = 1 << 20, A_THREAD = 512 << 10 };

static size_t add(size_t a, size_t b)
{
    return a > SIZE_MAX - b ? SIZE_MAX : a + b;
}

static int output_channels(const rl_sequence *q, size_t output)
{
    int n = 0;
    const rl_graph_output *o = &q->graph->outputs[q->first_output + output];
    for (size_t i = 0; i < o->n_images; i++) {
        const rl_image *image = &q->graph->images[o->images[i]];
        n += image->planes + (image->format == RL_RGB); /* and coverage */
    }
    return n;
}

/* Chunks of an EXR (coded, packed, and what waits to be written, a thread), or all samples of an image in
 * another format. Outputs are written one after the other. */
static size_t encode_bytes(const rl_session *s, const rl_sequence *q)
{
    static const size_t type_bytes[] = {
        [RL_HALF] = 2, [RL_FLOAT] = 4, [RL_UINT8] = 1, [RL_UINT16] = 2, [RL_UINT32] = 4};
    size_t pixels = (size_t)q->geometry.width * (size_t)q->geometry.height, most = 0;
    for (size_t i = 0; i < s->n_outputs; i++) {
        const rl_output *o = s->outputs[i].spec;
        size_t channels = (size_t)output_channels(q, i), bytes = type_bytes[o->type];
        size_t whole = channels * bytes * pixels, lines = 16;
        if (o->compression && !strcmp(o->compression, "piz"))
            lines = 32;
        else if (o->compression && !strncmp(o->compression, "dwab", 4))
            lines = 256;
        size_t chunks = 4 * channels * bytes * lines * (size_t)q->geometry.width * (size_t)s->threads;
        size_t one = strcmp(rl_path_extension(o->file), ".exr") ? whole : chunks;
        most = one > most ? one : most;
    }
    return most;
}

void rl_session_need(const rl_session *s, const rl_sequence *q, int in_flight, rl_memory_need *out)
{
    *out = (rl_memory_need){0};
    if (!q->geometry.columns)
        return;
    size_t pixels = (size_t)q->geometry.width * (size_t)q->geometry.height;
    /* tables of lights are kept on the host, too */
    out->plan = add(rl_plan_bytes(q->plan, &q->geometry, in_flight),
                    2 * sizeof(float) * (q->setup.n_profiles + q->setup.n_sky));
    out->decode = add((size_t)q->decode_bytes,
                      rl_session_keeps_ids(s) ? pixels * sizeof(uint32_t) * (size_t)in_flight : 0);
    out->encode = add(encode_bytes(s, q), FIXED + (size_t)s->threads * A_THREAD);
    for (size_t i = 0; i < q->plan->n_buffers; i++) /* one copy on its way to the disk */
        if (q->plan->buffers[i].kind == RL_BUFFER_HISTORY)
            out->checkpoint = add(out->checkpoint, rl_buffer_bytes(&q->plan->buffers[i], &q->geometry));
    out->total = add(add(out->plan, out->decode), add(out->encode, out->checkpoint));
}

int rl_session_in_flight(const rl_session *s, const rl_sequence *q)
{
    rl_memory_need need;
    int n = RL_MOST_IN_FLIGHT;
    for (; n > 1; n--) {
        rl_session_need(s, q, n, &need);
        if (!s->options.memory_limit || need.total <= s->options.memory_limit)
            break;
    }
    return n;
}

rl_code rl_session_check_memory(const rl_session *s, rl_error *err)
{
    for (size_t i = 0; i < s->n_sequences; i++) {
        const rl_sequence *q = &s->sequences[i];
        rl_code code = q->geometry.columns ? rl_plan_fits(q->plan, &q->geometry, err) : RL_OK;
        if (code)
            return code;
        rl_memory_need one;
        char need[32], limit[32];
        rl_session_need(s, q, 1, &one);
        if (s->options.memory_limit && one.total > s->options.memory_limit)
            return rl_fail(err, RL_E_MEMORY, q->manifest->where,
                           "one frame of %d x %d needs %s, more than --memory-limit %s", q->geometry.width,
                           q->geometry.height, rl_format_bytes(one.total, need),
                           rl_format_bytes(s->options.memory_limit, limit));
    }
    return RL_OK;
}

static rl_code add_json(const rl_memory_need *n, int in_flight, rl_str *text, rl_error *err)
{
    json_t *root = json_loads(rl_str_text(text), 0, NULL);
    json_t *peak =
        json_pack("{s:i, s:I, s:I, s:I, s:I, s:I}", "in_flight", in_flight, "buffers", (json_int_t)n->plan,
                  "reading", (json_int_t)n->decode, "writing", (json_int_t)n->encode, "checkpoint",
                  (json_int_t)n->checkpoint, "total", (json_int_t)n->total);
    bool good = root && peak && !json_object_set_new(root, "peak", peak);
    char *whole = good ? json_dumps(root, JSON_COMPACT) : NULL;
    text->length = 0;
    if (whole)
        rl_str_add(text, whole);
    free(whole);
    json_decref(root);
    return whole ? RL_OK : rl_fail_memory(err, 1);
}

rl_code rl_session_print_need(const rl_session *s, const rl_sequence *q, bool json, rl_str *text,
                              rl_error *err)
{
    rl_memory_need n;
    char plan[32], decode[32], encode[32], checkpoint[32], total[32];
    int in_flight = rl_session_in_flight(s, q);
    rl_session_need(s, q, in_flight, &n);
    if (!n.total || text->failed)
        return RL_OK;
    if (json)
        return add_json(&n, in_flight, text, err);
    rl_str_printf(text,
                  "\npeak memory of a run with %d %s in flight\n  %s: buffers %s, reading %s, writing %s, a "
                  "checkpoint %s\n",
                  in_flight, in_flight == 1 ? "frame" : "frames", rl_format_bytes(n.total, total),
                  rl_format_bytes(n.plan, plan), rl_format_bytes(n.decode, decode),
                  rl_format_bytes(n.encode, encode), rl_format_bytes(n.checkpoint, checkpoint));
    return RL_OK;
}
