/* The commands. Each is a function of its own file; main.c has the table of them. */
#ifndef RL_TOOL_TOOL_H
#define RL_TOOL_TOOL_H

#include <stdio.h>

#include "graph/tool/options.h"
#include "graph/tool/report.h"

/* What a command works with. */
typedef struct rl_tool {
    rl_arguments args;
    rl_reporter *report;
    rl_arena *arena;     /* lives as long as the command */
    const char *command; /* the command line, quoted as for a shell: for reports */
} rl_tool;

/* Exit statuses; a signal that stopped a run is 128 + its number. */
enum { RL_EXIT_DONE = 0, RL_EXIT_FRAME = 1, RL_EXIT_WRONG = 2, RL_EXIT_OVER = 3 /* a threshold */ };

/* `relit argv[1] …`: `out` gets results, `err` complaints and progress. Returns the exit status. Not for two
 * threads at a time: signals are the process's. */
int rl_tool_main(int argc, char **argv, FILE *out, FILE *err);

/* A command returns its exit status; or it fills err and returns RL_EXIT_WRONG or RL_EXIT_OVER, then its
 * caller prints err. */
typedef int (*rl_command_function)(rl_tool *tool, rl_error *err);
int rl_cmd_run(rl_tool *tool, rl_error *err);
int rl_cmd_check(rl_tool *tool, rl_error *err);
int rl_cmd_plan(rl_tool *tool, rl_error *err);
int rl_cmd_init(rl_tool *tool, rl_error *err);
int rl_cmd_inspect(rl_tool *tool, rl_error *err);
int rl_cmd_passes(rl_tool *tool, rl_error *err);
int rl_cmd_devices(rl_tool *tool, rl_error *err);
int rl_cmd_ab(rl_tool *tool, rl_error *err);
int rl_cmd_diff(rl_tool *tool, rl_error *err);
int rl_cmd_bench(rl_tool *tool, rl_error *err);

/* Prints s on stdout and frees it; the exit status. */
int rl_tool_print(rl_tool *tool, rl_str *s, rl_error *err);

#endif
