/* Which files a run writes: every name of every output, capture and frame, whether one comes twice, and
 * whether one is a file that is read. Names are compared by hash, and spelled again only where hashes agree.
 */
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/leftovers.h"
#include "graph/run/session.h"

enum { INPUT = 1 << 30 }; /* an `output` from here on is a pattern of the capture, which is read */

typedef struct written {
    uint64_t hash;
    int output, sequence, frame;
} written;

typedef struct lister {
    const rl_session *s;
    const char
        *out; /* where outputs go, without links; NULL: not there yet, so nothing that is read can be in it */
    written *list;
    size_t n;
} lister;

static rl_code spell(const lister *l, rl_arena *arena, const written *w, const char **out, rl_error *err)
{
    const rl_manifest *m = l->s->sequences[w->sequence].manifest;
    rl_code code = RL_OK;
    if (w->output >= INPUT) {
        const rl_layer layer = {.pattern = w->output - INPUT};
        const char *path = rl_manifest_path(arena, m, &layer, w->frame);
        *out = path ? rl_path_real(arena, path) : NULL;
    } else {
        code =
            rl_output_path(arena, l->s->outputs[w->output].spec, m->name, w->frame, l->s->variant, out, err);
        if (!code && l->out)
            *out = rl_path_join(arena, l->out, *out);
    }
    return code ? code : *out ? RL_OK : rl_fail_memory(err, 1);
}

/* Bounded memory: the names of a sequence's frames are forgotten a thousand at a time. */
static rl_code list_files(lister *l, int output, int sequence, rl_error *err)
{
    const rl_frames *frames = &l->s->sequences[sequence].frames;
    rl_arena arena = {0};
    rl_code code = RL_OK;
    for (size_t i = 0; i < frames->n && !code; i++) {
        const char *path = NULL;
        written *w = &l->list[l->n++];
        *w = (written){.output = output, .sequence = sequence, .frame = frames->numbers[i]};
        code = spell(l, &arena, w, &path, err);
        if (!code)
            w->hash = XXH3_64bits(path, strlen(path));
        if (i % 1000 == 999)
            rl_arena_free(&arena);
    }
    rl_arena_free(&arena);
    return code;
}

static rl_code collide(const rl_session *s, const written *a, const written *b, const char *path,
                       rl_error *err)
{
    if (b->output >= INPUT)
        return rl_fail(err, RL_E_CONFIG, s->outputs[a->output].spec->file_where,
                       "output '%s': '%s' is read as frame %d of capture '%s' and would be written over; "
                       "choose another --out or 'file'",
                       s->outputs[a->output].spec->name, path, b->frame,
                       s->sequences[b->sequence].manifest->name);
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

/* By hash; then what is written before what is only read; then in the order of the run, so that the same pair
 * is named every time. */
static int by_hash(const void *a, const void *b)
{
    const written *x = a, *y = b;
    int reads = (x->output >= INPUT) - (y->output >= INPUT);
    if (x->hash != y->hash)
        return x->hash < y->hash ? -1 : 1;
    if (reads || x->sequence != y->sequence)
        return reads ? reads : x->sequence - y->sequence;
    if (x->output != y->output)
        return x->output - y->output;
    return x->frame < y->frame ? -1 : x->frame > y->frame;
}

/* Whether both are one file; *path is its name. */
static rl_code same_file(const lister *l, rl_arena *arena, const written *w, const char **path, bool *same,
                         rl_error *err)
{
    const char *second = NULL;
    rl_code code = spell(l, arena, &w[0], path, err);
    if (!code)
        code = spell(l, arena, &w[1], &second, err);
    *same = !code && !strcmp(*path, second);
    return code;
}

/* The first that a run would come to is reported. */
static rl_code compare(const lister *l, rl_error *err)
{
    const written *found = NULL;
    rl_arena arena = {0};
    const char *path = NULL;
    rl_code code = RL_OK;
    for (size_t i = 1; i < l->n && !code; i++) {
        const written *w = &l->list[i - 1];
        bool same = false, earlier = !found || w->sequence < found->sequence ||
                                     (w->sequence == found->sequence && w->frame < found->frame);
        if (w[0].hash != w[1].hash || w[0].output >= INPUT || !earlier)
            continue;
        code = same_file(l, &arena, w, &path, &same, err);
        found = same ? w : found;
    }
    const lister plain = {.s = l->s,
                          .out = l->s->options.out ? l->s->options.out : "out"}; /* as the user wrote it */
    if (!code && found)
        code = spell(&plain, &arena, found, &path, err);
    if (!code && found)
        code = collide(l->s, &found[0], &found[1], path, err);
    rl_arena_free(&arena);
    return code;
}

rl_code rl_session_paths(rl_session *s, rl_error *err)
{
    char *out = realpath(s->options.out ? s->options.out : "out", NULL);
    size_t most = 1;
    for (size_t q = 0; q < s->n_sequences; q++)
        most += s->sequences[q].frames.n * (s->n_outputs + (size_t)s->sequences[q].manifest->n_patterns);
    lister l = {.s = s, .out = out, .list = rl_malloc(most * sizeof *l.list)};
    rl_code code = l.list ? RL_OK : rl_fail_memory(err, most * sizeof *l.list);
    for (int q = 0; q < (int)s->n_sequences; q++) {
        for (int o = 0; o < (int)s->n_outputs && !code; o++)
            code = list_files(&l, o, q, err);
        for (int p = 0; out && p < s->sequences[q].manifest->n_patterns && !code; p++)
            code = list_files(&l, INPUT + p, q, err);
    }
    if (!code) {
        qsort(l.list, l.n, sizeof *l.list, by_hash);
        code = compare(&l, err);
    }
    rl_free(l.list);
    free(out);
    return code;
}

void rl_session_clean(const rl_session *s)
{
    const char *out = s->options.out ? s->options.out : "out";
    rl_arena arena = {0};
    size_t n = 0, most = 0;
    for (size_t q = 0; q < s->n_sequences; q++)
        most += s->sequences[q].frames.n * s->n_outputs;
    const char **paths = rl_arena_array(&arena, most, sizeof *paths);
    for (size_t q = 0; paths && q < s->n_sequences; q++) {
        const rl_sequence *sequence = &s->sequences[q];
        for (size_t i = 0; i < sequence->frames.n * s->n_outputs; i++) {
            const char *name;
            if (rl_output_path(&arena, s->outputs[i % s->n_outputs].spec, sequence->manifest->name,
                               sequence->frames.numbers[i / s->n_outputs], s->variant, &name, NULL))
                continue;
            paths[n] = rl_path_join(&arena, out, name);
            n += paths[n] != NULL;
        }
    }
    if (paths)
        rl_leftovers_remove(paths, n);
    rl_arena_free(&arena);
}
