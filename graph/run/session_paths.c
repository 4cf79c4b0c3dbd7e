/* Which files a run writes: every name of every output, capture and frame, and whether one comes twice. Names
 * are compared by hash, and spelled again only where hashes agree. */
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/run/session.h"

typedef struct written {
    uint64_t hash;
    unsigned output, sequence;
    int frame;
} written;

static rl_code spell(const rl_session *s, rl_arena *arena, const written *w, const char **out, rl_error *err)
{
    return rl_output_path(arena, s->outputs[w->output].spec, s->sequences[w->sequence].manifest->name,
                          w->frame, NULL, out, err);
}

/* Bounded memory: the names of a sequence's frames are forgotten a thousand at a time. */
static rl_code list_sequence(const rl_session *s, unsigned output, unsigned sequence, written *list,
                             rl_error *err)
{
    const rl_frames *frames = &s->sequences[sequence].frames;
    rl_arena arena = {0};
    rl_code code = RL_OK;
    for (size_t i = 0; i < frames->n && !code; i++) {
        const char *path = NULL;
        list[i] = (written){.output = output, .sequence = sequence, .frame = frames->numbers[i]};
        code = spell(s, &arena, &list[i], &path, err);
        if (!code)
            list[i].hash = XXH3_64bits(path, strlen(path));
        if (i % 1000 == 999)
            rl_arena_free(&arena);
    }
    rl_arena_free(&arena);
    return code;
}

/* By hash; then in the order of the run, so that the same pair is named every time. */
static int by_hash(const void *a, const void *b)
{
    const written *x = a, *y = b;
    if (x->hash != y->hash)
        return x->hash < y->hash ? -1 : 1;
    if (x->sequence != y->sequence)
        return x->sequence < y->sequence ? -1 : 1;
    if (x->output != y->output)
        return x->output < y->output ? -1 : 1;
    return x->frame < y->frame ? -1 : x->frame > y->frame;
}

static rl_code collide(const rl_session *s, const written *a, const written *b, const char *path,
                       rl_error *err)
{
    const rl_output *first = s->outputs[a->output].spec, *second = s->outputs[b->output].spec;
    const char *x = s->sequences[a->sequence].manifest->name, *y = s->sequences[b->sequence].manifest->name;
    if (a->output != b->output)
        return rl_fail(err, RL_E_CONFIG, second->file_where.file ? second->file_where : first->file_where,
                       "outputs '%s' and '%s' would both write '%s'", first->name, second->name, path);
    if (a->sequence == b->sequence)
        return rl_fail(
            err, RL_E_CONFIG, first->file_where,
            "output '%s': frames %d and %d would both be written to '%s'; put {frame:04} into 'file'",
            first->name, a->frame, b->frame, path);
    return rl_fail(err, RL_E_CONFIG, first->file_where,
                   "output '%s': captures '%s' and '%s' would both be written to '%s'; %s", first->name, x, y,
                   path,
                   strcmp(x, y) ? "put {capture} into 'file'" : "give one another 'name' in its manifest");
}

static rl_code compare(const rl_session *s, const written *list, size_t n, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 1; i < n && !code; i++) {
        rl_arena arena = {0};
        const char *a = NULL, *b = NULL;
        if (list[i].hash != list[i - 1].hash)
            continue;
        code = spell(s, &arena, &list[i - 1], &a, err);
        if (!code)
            code = spell(s, &arena, &list[i], &b, err);
        if (!code && !strcmp(a, b))
            code = collide(s, &list[i - 1], &list[i], a, err);
        rl_arena_free(&arena);
    }
    return code;
}

rl_code rl_session_paths(rl_session *s, rl_error *err)
{
    size_t n = 0, most = 0;
    for (size_t q = 0; q < s->n_sequences; q++)
        most += s->sequences[q].frames.n * s->n_outputs;
    written *list = rl_malloc((most + 1) * sizeof *list);
    rl_code code = list ? RL_OK : rl_fail_memory(err, most * sizeof *list);
    for (unsigned o = 0; o < s->n_outputs && !code; o++) {
        for (unsigned q = 0; q < s->n_sequences && !code; q++) {
            code = list_sequence(s, o, q, list + n, err);
            n += s->sequences[q].frames.n;
        }
    }
    if (!code) {
        qsort(list, n, sizeof *list, by_hash);
        code = compare(s, list, n, err);
    }
    rl_free(list);
    return code;
}
