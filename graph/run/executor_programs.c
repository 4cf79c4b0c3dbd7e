/* The programs of an executor: their texts, and building them. */
#include <stdio.h>
#include <string.h>

#include "graph/base/pool.h"
#include "graph/run/executor_parts.h"
#include "graph/run/kernel_source.h"

/* Programs are built by several threads; each has its own error. Equal texts are one program. */
typedef struct build_job {
    rl_executor *x;
    rl_str *texts;    /* one a program: live nodes, then the conversions */
    size_t *same;     /* the first one with that text */
    rl_error *errors; /* as many */
    size_t n;
} build_job;

static rl_program **program_of(const build_job *job, size_t i)
{
    rl_executor *x = job->x;
    return i < x->plan->n_nodes ? &x->nodes[x->plan->nodes[i].node].program : &x->convert;
}

static rl_code write_texts(build_job *job, rl_error *err)
{
    rl_executor *x = job->x;
    rl_arena arena = {0};
    rl_code code = RL_OK;
    for (size_t i = 0; i < job->n && !code; i++) {
        const rl_plan_node *n = i < x->plan->n_nodes ? &x->plan->nodes[i] : NULL;
        if (n)
            code = rl_kernel_text(&arena, x->plan, n,
                                  x->scenes[x->plan->graph->nodes[n->node].scene].scene.lights.kinds,
                                  &job->texts[i], err);
        else
            code = rl_kernel_convert_text(&arena, &job->texts[i], err);
        job->same[i] = 0;
        while (!code && strcmp(rl_str_text(&job->texts[job->same[i]]), rl_str_text(&job->texts[i])))
            job->same[i]++;
    }
    rl_arena_free(&arena);
    return code;
}

static void build_one(void *ctx, int index)
{
    build_job *job = ctx;
    rl_executor *x = job->x;
    size_t i = (size_t)index;
    rl_error *err = &job->errors[i];
    if (job->same[i] != i)
        return;
    const char *text = rl_str_text(&job->texts[i]);
    if (i == x->plan->n_nodes) {
        rl_program_build(x->device, "convert", text, true, program_of(job, i), err);
        return;
    }
    const rl_graph_node *g = &x->plan->graph->nodes[x->plan->nodes[i].node];
    rl_program_build(x->device, g->name, text, false, program_of(job, i), err);
    if (err->code == RL_E_BUILD && !err->file[0])
        rl_fail(err, RL_E_BUILD, g->where, "pass '%s' (%s) does not build", g->name, g->pass->name);
}

static rl_code build_texts(build_job *job, int threads, rl_error *err)
{
    rl_pool *pool = NULL;
    rl_code code = rl_pool_new((size_t)threads < job->n ? threads : (int)job->n, &pool, err);
    if (code)
        return code;
    rl_pool_for(pool, (int)job->n, build_one, job);
    rl_pool_free(&pool);
    for (size_t i = 0; i < job->n && !code; i++) {
        code = job->errors[i].code;
        if (code && err)
            *err = job->errors[i];
        if (job->same[i] != i)
            *program_of(job, i) = rl_program_share(*program_of(job, job->same[i]));
    }
    return code;
}

/* Names of kernels come from pipelines, too; a wrong one is not the fault of a frame. */
static rl_code check_kernels(rl_executor *x, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < x->plan->n_steps && !code; i++) {
        const rl_plan_step *s = &x->plan->steps[i];
        if (s->kind != RL_STEP_KERNEL)
            continue;
        const rl_graph_node *g = &x->plan->graph->nodes[s->node];
        char what[256];
        snprintf(what, sizeof what, "pass '%s' (%s)", g->name, g->pass->name);
        code = rl_program_check(x->nodes[s->node].program, g->pass->steps.rows[s->step].entry, what, g->where,
                                err);
    }
    return code;
}

rl_code rl_executor_build(rl_executor *x, int threads, rl_error *err)
{
    bool converts = false;
    for (size_t i = 0; i < x->plan->n_steps; i++)
        converts |= x->plan->steps[i].kind == RL_STEP_CONVERT;
    build_job job = {.x = x, .n = x->plan->n_nodes + converts};
    job.errors = rl_arena_array(&x->arena, job.n + 1, sizeof *job.errors);
    job.texts = rl_arena_array(&x->arena, job.n + 1, sizeof *job.texts);
    job.same = rl_arena_array(&x->arena, job.n + 1, sizeof *job.same);
    if (!job.errors || !job.texts || !job.same)
        return rl_fail_memory(err, job.n * sizeof *job.errors);
    rl_code code = write_texts(&job, err);
    if (!code && job.n)
        code = build_texts(&job, threads, err);
    if (!code)
        code = check_kernels(x, err);
    for (size_t i = 0; i < job.n; i++)
        rl_str_free(&job.texts[i]);
    return code;
}
