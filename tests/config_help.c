#include "tests/config_help.h"

#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"

rl_arena config_arena;
rl_error config_error;
char config_logged[1024];

int config_setup(void **state)
{
    (void)state;
    config_error = (rl_error){0};
    config_logged[0] = 0;
    return 0;
}

int config_teardown(void **state)
{
    (void)state;
    rl_alloc_fail_at(0, 0);
    rl_arena_free(&config_arena);
    return 0;
}

rl_value *config_parse(const char *text)
{
    rl_value *v = NULL;
    config_assert_fine(rl_yaml_parse(&config_arena, text, strlen(text), "t.yaml", &v, &config_error));
    return v;
}

void config_assert_error(const char *expected)
{
    char message[2300];
    rl_error_format(&config_error, message, sizeof message);
    assert_string_equal(message, expected);
    assert_int_not_equal(config_error.code, RL_OK);
    config_error = (rl_error){0};
}

void config_assert_fine(rl_code code)
{
    char message[2300];
    rl_error_format(&config_error, message, sizeof message);
    if (code || config_error.code)
        fail_msg("%s", message);
}

static void keep(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)ctx;
    static const char *const names[] = {"note", "warning", "verbose"};
    snprintf(config_logged, sizeof config_logged, "%s %s:%d:%d %s", names[severity], where.file, where.line,
             where.column, text);
}

const rl_log config_log = {.sink = keep};

/* ---- passes ----------------------------------------------------------------------------------------------
 */

typedef struct blur_params {
    float radius;
    int32_t taps;
    int32_t shape;
    int32_t wrap;
    float tint[3];
} blur_params;

static const rl_param blur_rows[] = {
    P(blur_params, RL_F32, radius, 0, 8, 1.5, "mm", "half width"),
    {.name = "taps",
     .type = RL_I32,
     .offset = offsetof(blur_params, taps),
     .min = 1,
     .max = 4096,
     .def = {-1},
     .words = "auto|most",
     .unit = "",
     .help = "samples"},
    P_ENUM(blur_params, shape, "disk|square", 0, "of the window"),
    P(blur_params, RL_BOOL, wrap, 0, 1, 0, "", "at the edges"),
    P(blur_params, RL_RGBF, tint, 0, 1, 1, "ratio", "a factor"),
};
RL_PARAMS_MATCH(blur_params, 7);

static const rl_port blur_ports[] = {
    {"color", RL_READ, RL_RGB, .help = "what is blurred"},
    {"depth", RL_READ, RL_SCALAR, .help = "metres", .optional = true},
    {"last", RL_HISTORY, RL_RGB, .help = "the past", .of = "color"},
    {"rows", RL_SCRATCH, RL_RGB, .help = "between the steps"},
    {"color", RL_WRITE, RL_RGB, .help = "blurred"},
};

static const rl_step blur_steps[] = {{"blur", .domain = RL_EVERY_PIXEL}};

static const rl_param blur_profile[] = {
    M(RL_RGBF, distance_mm, 1e-3, 1e3, 1, "mm", "how far", .required = true),
    M_ENUM(border, "renormalize|occlude", 0, "at borders"),
};

static const rl_pass blur = {
    .name = "blur",
    .help = "for tests",
    .params = RL_ARRAY(blur_rows),
    .params_size = sizeof(blur_params),
    .profile_keys = RL_ARRAY(blur_profile),
    .ports = RL_ARRAY(blur_ports),
    .steps = RL_ARRAY(blur_steps),
};

static const rl_param tint_profile[] = {
    M_ENUM(border, "renormalize|occlude", 0, "at borders"),
    M(RL_F32, strength, 0, 1, 0.25, "ratio", "how much"),
};
static const rl_param tint_material[] = {
    M(RL_F32, roughness, 0, 1, -1, "ratio", "of the surface", .no_default = true),
    M(RL_F32, specular, 0, 1, 0.04, "ratio", "reflectance"),
};
static const rl_param tint_shading[] = {
    M_ENUM(specular, "ggx|none", 0, "the lobe"),
    M(RL_BOOL, transmission, 0, 1, 1, "", "through the surface"),
};
static const rl_port tint_ports[] = {
    {"color", RL_READ, RL_RGB, .help = "in"},
    {"out", RL_WRITE, RL_RGB, .help = "out"},
};

static const rl_pass tint = {
    .name = "tint",
    .help = "for tests, without parameters",
    .profile_keys = RL_ARRAY(tint_profile),
    .material_keys = RL_ARRAY(tint_material),
    .shading_keys = RL_ARRAY(tint_shading),
    .ports = RL_ARRAY(tint_ports),
    .steps = RL_ARRAY(blur_steps),
};

static const rl_pass *const passes[] = {&blur, &tint};
const rl_registry config_registry = {passes, RL_ARRAY_LENGTH(passes)};
