/* For tests of configuration: YAML out of strings, errors as whole lines, collected log lines, passes that
 * exist for tests only. */
#ifndef TESTS_CONFIG_HELP_H
#define TESTS_CONFIG_HELP_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include "graph/base/log.h"
#include "graph/model/registry.h"
#include "graph/model/value.h"

/* Emptied by config_teardown. */
extern rl_arena config_arena;
extern rl_error config_error;

/* For cmocka_unit_test_setup_teardown. */
int config_setup(void **state);
int config_teardown(void **state);

/* The tree of a text, whose places read "t.yaml:line:column"; fails the test when it does not parse. */
rl_value *config_parse(const char *text);

/* config_error reads `expected`, whole ("t.yaml:1:2: error: …"); then it is cleared. */
void config_assert_error(const char *expected);
/* config_error is none; prints it otherwise. */
void config_assert_fine(rl_code code);

/* A log that keeps its last line: "severity file:line:column text"; "" when there was none since setup. */
extern const rl_log config_log;
extern char config_logged[1024];

/* "blur" and "tint" (tests/config_help.c): parameters of every type, ports of every role, rows of every
 * group. */
extern const rl_registry config_registry;

#endif
