/* configs/farm/openjd.yaml against the Open Job Description's template schema of 2023-09, as far as the
 * template goes: keys and types, and that each format string names a variable that exists where it stands. */
#include <ctype.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "graph/model/value.h"

static rl_arena arena;
static const rl_value *job;

static int setup(void **state)
{
    rl_error err = {0};
    rl_value *root = NULL;
    (void)state;
    if (rl_yaml_load(&arena, "configs/farm/openjd.yaml", &root, &err))
        fail_msg("%s", err.text);
    job = root;
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    return 0;
}

/* Every key of the map is one of the words of `keys`, those with a ! in front are there. */
static void has_keys(const rl_value *map, const char *keys)
{
    char word[64];
    int n = 0;
    assert_true(map && map->kind == RL_MAP);
    for (size_t i = 0; i < map->n; i++) {
        bool known = false;
        for (const char *k = keys; sscanf(k, " %63s%n", word, &n) == 1; k += n)
            known |= !strcmp(word + (*word == '!'), map->entries[i].key);
        if (!known)
            fail_msg("line %d: key '%s' is none of: %s", map->entries[i].where.line, map->entries[i].key,
                     keys);
    }
    for (const char *k = keys; sscanf(k, " %63s%n", word, &n) == 1; k += n)
        if (*word == '!' && !rl_value_get(map, word + 1))
            fail_msg("key '%s' is missing", word + 1);
}

static const char *text_of(const rl_value *map, const char *key)
{
    const rl_value *v = rl_value_get(map, key);
    return v ? v->text : "";
}

/* Letters, digits and _, not a digit first, at most 64. */
static void is_identifier(const char *s)
{
    assert_true(strlen(s) > 0 && strlen(s) <= 64 && !isdigit((unsigned char)*s));
    for (; *s; s++)
        assert_true(isalnum((unsigned char)*s) || *s == '_');
}

static const rl_value *named(const char *list, const char *name)
{
    const rl_value *l = rl_value_at(job, list);
    for (size_t i = 0; l && i < l->n; i++) {
        const rl_value *one = l->items[i];
        if (!strcmp(text_of(one, "name"), name))
            return one;
    }
    return NULL;
}

typedef enum scope { AT_SUBMISSION, IN_TASK } scope;

/* Paths are mapped on the worker: before that Param.X of a PATH does not exist, RawParam.X does. */
static bool exists(const char *variable, scope where)
{
    const rl_value *p;
    if (!strncmp(variable, "RawParam.", 9))
        return named("parameterDefinitions", variable + 9);
    if (!strncmp(variable, "Param.", 6)) {
        p = named("parameterDefinitions", variable + 6);
        return p && (where == IN_TASK || strcmp(text_of(p, "type"), "PATH"));
    }
    if (!strncmp(variable, "Task.Param.", 11))
        return where == IN_TASK && named("steps.0.parameterSpace.taskParameterDefinitions", variable + 11);
    if (!strncmp(variable, "Task.File.", 10))
        return where == IN_TASK && named("steps.0.script.embeddedFiles", variable + 10);
    return where == IN_TASK && !strcmp(variable, "Session.WorkingDirectory");
}

static void variables_exist(const char *text, scope where)
{
    int n = 0;
    for (const char *p = text; (p = strstr(p, "{{")); n++) {
        const char *end = strstr(p, "}}");
        char name[128];
        assert_non_null(end);
        assert_int_equal(sscanf(p + 2, " %127[A-Za-z0-9_.]", name), 1);
        if (!exists(name, where))
            fail_msg("{{%s}} does not exist here: %.60s", name, text);
        p = end + 2;
    }
}

static void the_job_is_described(void **state)
{
    (void)state;
    has_keys(job,
             "!specificationVersion !name !steps parameterDefinitions jobEnvironments description $schema "
             "extensions");
    assert_string_equal(text_of(job, "specificationVersion"), "jobtemplate-2023-09");
    assert_in_range(strlen(text_of(job, "name")), 1, 128);
    variables_exist(text_of(job, "name"), AT_SUBMISSION);
    const rl_value *steps = rl_value_get(job, "steps");
    assert_true(steps && steps->kind == RL_LIST && steps->n >= 1 && steps->n <= 100);
}

static void parameters_have_their_types(void **state)
{
    static const char *const more[][2] = {
        {"STRING", "minLength maxLength allowedValues"},
        {"PATH", "minLength maxLength allowedValues objectType dataFlow"},
        {"INT", "minValue maxValue allowedValues"},
        {"FLOAT", "minValue maxValue allowedValues"},
    };
    const rl_value *list = rl_value_get(job, "parameterDefinitions");
    (void)state;
    assert_true(list && list->kind == RL_LIST && list->n >= 1 && list->n <= 50);
    for (size_t i = 0; i < list->n; i++) {
        const rl_value *p = list->items[i];
        const char *keys = NULL;
        char all[256];
        is_identifier(text_of(p, "name"));
        assert_ptr_equal(named("parameterDefinitions", text_of(p, "name")), p); /* once */
        for (size_t k = 0; k < 4; k++)
            keys = strcmp(text_of(p, "type"), more[k][0]) ? keys : more[k][1];
        assert_non_null(keys);
        snprintf(all, sizeof all, "!name !type description default userInterface %s", keys);
        has_keys(p, all);
        const rl_value *def = rl_value_get(p, "default"), *least = rl_value_get(p, "minValue");
        const rl_value *most = rl_value_get(p, "maxValue");
        bool integer = !strcmp(text_of(p, "type"), "INT");
        assert_true(!def || (integer ? def->integral : def->kind == RL_TEXT));
        assert_true(!least || !def || def->integer >= least->integer);
        assert_true(!most || !def || def->integer <= most->integer);
        assert_true(strstr(" FILE DIRECTORY ", text_of(p, "objectType")));
        assert_true(strstr(" NONE IN OUT INOUT ", text_of(p, "dataFlow")));
    }
}

static void a_task_runs_a_shard(void **state)
{
    const rl_value *step = rl_value_at(job, "steps.0"), *script = rl_value_get(step, "script");
    (void)state;
    has_keys(step, "!name !script description dependencies stepEnvironments hostRequirements parameterSpace");
    assert_in_range(strlen(text_of(step, "name")), 1, 64);
    has_keys(rl_value_get(step, "parameterSpace"), "!taskParameterDefinitions combination");
    const rl_value *shard = rl_value_at(step, "parameterSpace.taskParameterDefinitions.0");
    has_keys(shard, "!name !type !range");
    is_identifier(text_of(shard, "name"));
    assert_string_equal(text_of(shard, "type"), "INT");
    assert_string_equal(text_of(shard, "range"),
                        "1-{{Param.Shards}}"); /* an int range expression, filled in */
    variables_exist(text_of(shard, "range"), AT_SUBMISSION);
    has_keys(script, "!actions embeddedFiles");
    const rl_value *file = rl_value_at(script, "embeddedFiles.0");
    has_keys(file, "!name !type !data filename runnable");
    is_identifier(text_of(file, "name"));
    assert_string_equal(text_of(file, "type"), "TEXT");
    assert_null(strchr(text_of(file, "filename"), '/'));
    assert_true(strlen(text_of(file, "data")) > 0);
    variables_exist(text_of(file, "data"), IN_TASK);
    has_keys(rl_value_get(script, "actions"), "!onRun");
    const rl_value *run = rl_value_at(script, "actions.onRun"), *cancel = rl_value_get(run, "cancelation");
    has_keys(run, "!command args timeout cancelation");
    variables_exist(text_of(run, "command"), IN_TASK);
    const rl_value *args = rl_value_get(run, "args");
    for (size_t i = 0; args && i < args->n; i++)
        variables_exist(args->items[i]->text, IN_TASK);
    has_keys(cancel, "!mode notifyPeriodInSeconds");
    assert_string_equal(text_of(cancel, "mode"), "NOTIFY_THEN_TERMINATE");
    assert_in_range(rl_value_get(cancel, "notifyPeriodInSeconds")->integer, 1, 600);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_job_is_described),
        cmocka_unit_test(parameters_have_their_types),
        cmocka_unit_test(a_task_runs_a_shard),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
