/* Opening and closing a session, and looking at it. */
#include "graph/run/session.h"

#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

static rl_code apply_settings(rl_session *s, rl_value **root, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < s->options.n_settings && !code; i++) {
        const rl_setting *set = &s->options.settings[i];
        const char *name = rl_arena_printf(&s->arena, "--set %s=%s", set->path, set->value);
        rl_value *v = NULL;
        if (!name)
            return rl_fail_memory(err, strlen(set->path));
        code = rl_yaml_parse(&s->arena, set->value, strlen(set->value), name, &v, err);
        if (!code)
            code = rl_pipeline_set(&s->arena, root, set->path, v, s->log, err);
    }
    return code;
}

static rl_code read_pipeline(rl_session *s, rl_error *err)
{
    const rl_options *o = &s->options;
    rl_value *root = NULL;
    rl_code code;
    if (o->pipeline_text)
        code = rl_yaml_parse(&s->arena, o->pipeline_text, strlen(o->pipeline_text), "pipeline", &root, err);
    else if (o->pipeline &&
             (rl_path_is_folder(o->pipeline) || !strcasecmp(rl_path_extension(o->pipeline), ".exr")))
        code = rl_fail_file(err, RL_E_CONFIG, o->pipeline,
                            "this is a capture, not a pipeline: `relit init %s` writes a pipeline for it",
                            o->pipeline);
    else if (o->pipeline)
        code = rl_config_load(&s->arena, o->pipeline, &root, err);
    else
        code = rl_fail(err, RL_E_USAGE, RL_NOWHERE, "no pipeline was given");
    if (!code)
        code = apply_settings(s, &root, err);
    return code ? code
                : rl_pipeline_parse(&s->arena, o->pipeline ? o->pipeline : "pipeline", root, s->log,
                                    &s->pipeline, err);
}

rl_code rl_session_open(const rl_options *options, rl_session **out, rl_error *err)
{
    return rl_session_open_variant(options, NULL, out, err);
}

rl_code rl_session_open_variant(const rl_options *options, const char *variant, rl_session **out,
                                rl_error *err)
{
    rl_error local = {0};
    err = err ? err : &local;
    *out = NULL;
    rl_session *s = rl_calloc(1, sizeof *s);
    if (!s)
        return rl_fail_memory(err, sizeof *s);
    s->options = *options;
    s->log = options->log;
    s->variant = variant;
    long cpus = sysconf(_SC_NPROCESSORS_ONLN);
    s->threads = options->threads > 0 ? options->threads : cpus > 0 ? (int)cpus : 1;
    rl_code code = rl_pool_new(s->threads, &s->pool, err);
    if (!code)
        code = read_pipeline(s, err);
    if (!code)
        code = rl_session_colors(s, err);
    if (!code && variant)
        code = rl_session_compared(s, err);
    if (!code)
        code = rl_session_ambient(s, err);
    if (!code)
        code = rl_session_sequences(s, err);
    if (!code)
        code = rl_session_content(s, err);
    if (!code)
        code = rl_session_paths(s, err);
    if (!code)
        code = rl_session_count(s, err);
    if (!code)
        code = rl_session_check_memory(s, err);
    if (code)
        rl_session_close(&s);
    *out = s;
    return code;
}

void rl_session_close(rl_session **session)
{
    rl_session *s = *session;
    *session = NULL;
    if (!s)
        return;
    rl_session_end_views(s);
    rl_frame_free(&s->frame);
    for (size_t i = 0; i < s->n_sequences; i++)
        rl_sequence_close(&s->sequences[i]);
    rl_device_close(&s->device);
    rl_ocio_free(&s->ocio);
    rl_pool_free(&s->pool);
    rl_free(s->sky);
    rl_arena_free(&s->arena);
    rl_free(s);
}

static rl_code prepare_sequence(rl_session *s, rl_sequence *q, rl_error *err)
{
    rl_scene scene = {q->materials, q->setup};
    return rl_executor_new(s->device, q->plan, &scene, 1, s->threads, s->log, &q->executor, err);
}

rl_code rl_session_prepare(rl_session *s, rl_error *err)
{
    rl_code code =
        s->device ? RL_OK : rl_device_open(s->options.device, s->options.threads, s->log, &s->device, err);
    for (size_t i = 0; i < s->n_sequences && !code; i++)
        if (!s->sequences[i].executor)
            code = prepare_sequence(s, &s->sequences[i], err);
    return code;
}

size_t rl_session_captures(const rl_session *s)
{
    return s->n_sequences;
}

const char *rl_session_capture_name(const rl_session *s, size_t capture)
{
    return capture < s->n_sequences ? s->sequences[capture].manifest->name : NULL;
}

size_t rl_session_frames(const rl_session *s, size_t capture)
{
    return capture < s->n_sequences ? s->sequences[capture].frames.n : 0;
}

long long rl_session_frame(const rl_session *s, size_t capture, size_t i)
{
    return i < rl_session_frames(s, capture) ? s->sequences[capture].frames.numbers[i] : 0;
}

rl_code rl_session_plan(const rl_session *s, size_t capture, rl_plan_format format, char **text,
                        rl_error *err)
{
    *text = NULL;
    if (capture >= s->n_sequences)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "there is no capture %zu", capture);
    const rl_sequence *q = &s->sequences[capture];
    const rl_geometry *g = q->geometry.columns ? &q->geometry : NULL;
    int in_flight = rl_session_in_flight(s, q);
    rl_str out = {0};
    rl_code code = RL_OK;
    if (format == RL_PLAN_TEXT)
        rl_plan_print_text(q->plan, g, in_flight, &out);
    else if (format == RL_PLAN_DOT)
        rl_plan_print_dot(q->plan, g, in_flight, &out);
    else
        code = rl_plan_print_json(q->plan, g, in_flight, &out, err);
    if (!code && format != RL_PLAN_DOT)
        code = rl_session_print_need(s, q, format == RL_PLAN_JSON, &out, err);
    if (!code && out.failed)
        code = rl_fail_memory(err, out.length);
    if (code)
        rl_str_free(&out);
    *text = out.text;
    return code;
}

void rl_text_free(char *text)
{
    rl_free(text);
}
