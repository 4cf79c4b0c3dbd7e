#include "graph/tool/ab_open.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/run/session.h"

static const char set[] = "--set ";

/* A session knows settings only: --set. */
static bool is_varied(const rl_ab_plan *plan, const char *setting)
{
    for (size_t v = 0; v < plan->n_variants; v++)
        for (size_t i = 0; i < plan->variants[v].n_settings; i++) {
            const rl_setting *s = &plan->variants[v].settings[i];
            size_t n = strlen(s->path);
            if (!strncmp(setting, s->path, n) && setting[n] == '=' && !strcmp(setting + n + 1, s->value))
                return true;
        }
    return false;
}

/* ---- one file, two variants ---------------------------------------------------------------------------- */

/* A picture of a capture's first frame. */
typedef struct target {
    const char *path;
    size_t variant;
    const rl_output *output;
} target;

/* "a/./b/../c" becomes "a/c", in place: a variant's own folder need not be there yet, and is no link. */
static void shorten(char *path)
{
    char *to = path + (*path == '/'), *from = to, *begin = to;
    int depth = 0; /* folders that ".." can leave */
    for (bool last = !*from; !last;) {
        size_t n = strcspn(from, "/");
        bool up = n == 2 && !strncmp(from, "..", 2), here = n == 0 || (n == 1 && *from == '.');
        last = !from[n]; /* asked before a '/' may stand there */
        if (up && depth) {
            for (to--; to > begin && to[-1] != '/';)
                to--;
            depth--;
        } else if (!here) {
            memmove(to, from, n);
            to += n;
            *to++ = '/';
            depth += !up;
        }
        from += n + !last;
    }
    to[to > begin ? -1 : 0] = 0;
}

static rl_code list_targets(rl_arena *arena, const rl_experiment *e, const rl_ab_plan *plan, target *list,
                            size_t *n, rl_error *err)
{
    for (size_t v = 0; v < plan->n_listed; v++) {
        const rl_session *s = rl_experiment_session(e, v);
        for (size_t o = 0; o < s->n_outputs; o++)
            for (size_t c = 0; c < s->n_sequences; c++) {
                const char *name;
                if (rl_output_path(arena, s->outputs[o].spec, s->sequences[c].manifest->name,
                                   rl_session_frame(s, c, 0), plan->variants[v].name, &name, err))
                    return err->code;
                char *path = rl_path_join(arena, s->options.out, name);
                char *own = path ? rl_arena_strdup(arena, path) : NULL;
                if (!own)
                    return rl_fail_memory(err, strlen(name));
                shorten(own);
                list[(*n)++] = (target){own, v, s->outputs[o].spec};
            }
    }
    return RL_OK;
}

static int by_path(const void *a, const void *b)
{
    const target *x = a, *y = b;
    int order = strcmp(x->path, y->path);
    return order ? order : x->variant < y->variant ? -1 : x->variant > y->variant;
}

/* Each variant's files are below a folder of its name, unless `file` leads out of it. */
static rl_code check_files(const rl_experiment *e, const rl_ab_plan *plan, rl_error *err)
{
    rl_arena arena = {0};
    size_t most = 1, n = 0;
    for (size_t v = 0; v < plan->n_listed; v++) {
        const rl_session *s = rl_experiment_session(e, v);
        most += s->n_outputs * s->n_sequences;
    }
    target *list = rl_arena_array(&arena, most, sizeof *list);
    rl_code code =
        list ? list_targets(&arena, e, plan, list, &n, err) : rl_fail_memory(err, most * sizeof *list);
    if (!code)
        qsort(list, n, sizeof *list, by_path);
    for (size_t i = 1; i < n && !code; i++)
        if (list[i].variant != list[i - 1].variant && !strcmp(list[i].path, list[i - 1].path))
            code = rl_fail(err, RL_E_CONFIG, list[i].output->file_where,
                           "output '%s': variants '%s' and '%s' would both write '%s'; put {variant} into "
                           "'file'",
                           list[i].output->name, plan->variants[list[i - 1].variant].name,
                           plan->variants[list[i].variant].name, list[i].path);
    rl_arena_free(&arena);
    return code;
}

rl_code rl_ab_open(const rl_ab_plan *plan, const rl_options *options, rl_experiment **out, rl_error *err)
{
    rl_code code = rl_experiment_open(options, plan->variants, plan->n_variants, out, err);
    if (code && !strncmp(err->file, set, sizeof set - 1) && is_varied(plan, err->file + sizeof set - 1)) {
        char place[sizeof err->file];
        snprintf(place, sizeof place, "--vary %.*s", (int)sizeof place - 8, err->file + sizeof set - 1);
        memcpy(err->file, place, sizeof place);
        err->line = err->column = 0; /* the value alone is there, not the option as it was written */
    }
    if (!code && (code = check_files(*out, plan, err)))
        rl_experiment_close(out);
    return code;
}
