/* The command line. One table of options drives parsing, `--help` and did-you-mean. */
#ifndef RL_TOOL_OPTIONS_H
#define RL_TOOL_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/text.h"
#include "graph/relit.h"

/* Bits: which commands take an option. */
typedef enum rl_command_bit {
    RL_CMD_RUN = 1,
    RL_CMD_CHECK = 2,
    RL_CMD_PLAN = 4,
    RL_CMD_INIT = 8,
    RL_CMD_INSPECT = 16,
    RL_CMD_PASSES = 32,
    RL_CMD_DEVICES = 64,
    RL_CMD_BENCH = 128,
    RL_CMD_DIFF = 256,
    RL_CMD_AB = 512
} rl_command_bit;

/* A command as the parser and the help see it. */
typedef struct rl_command_info {
    const char *name;
    rl_command_bit bit;
    const char *operand; /* "PIPELINE", "[NAME]" (may be left out), "A B" (two), "PIPELINE..." (one or
                            more), or NULL: takes none */
    const char *help;    /* one line */
    const char *more;    /* paragraphs for `relit NAME --help`, lines under 80 columns, or NULL */
} rl_command_info;

typedef struct rl_commands {
    const rl_command_info *const *rows;
    size_t n;
} rl_commands;

typedef enum rl_plan_word { RL_WORD_TEXT, RL_WORD_DOT, RL_WORD_SVG, RL_WORD_JSON, RL_WORD_HTML } rl_plan_word;

/* What was asked for. Lists live in the arena that rl_arguments_parse was given, strings in argv or there. */
typedef struct rl_arguments {
    const char *operand;         /* or NULL */
    const char *second;          /* of two, or NULL */
    const char *const *operands; /* of one or more, operand the first; else none */
    size_t n_operands;
    rl_options run;         /* handed to rl_session_open as it is, after .pipeline and .log are set */
    const char *trace;      /* or NULL */
    int size[2];            /* bench: width, height; 0 = the capture's */
    int on_missing, format; /* words, as indices of rl_on_missing and rl_plan_word */
    const char *metric, *heatmap;
    const char *const *fail_over; /* "flip.p95=0.05", "0.02" */
    size_t n_fail_over;
    const char *const *vary; /* "graph.sss.taps=8,16" */
    size_t n_vary;
    const char *against, *report_frames; /* or NULL */
    const char *sheet;                   /* NULL: none; "": under its default name */
    int seeds;                           /* 0: as the default */
    bool pairs;
    bool json, markdown, quiet, verbose, help;
} rl_arguments;

/* Reads the words behind the command's name. An error is RL_E_USAGE and names the nearest option. */
rl_code rl_arguments_parse(rl_arena *arena, const rl_commands *commands, const rl_command_info *command,
                           int argc, char **argv, rl_arguments *out, rl_error *err);

/* `relit --help`, `relit NAME --help`. */
void rl_help_overview(const rl_commands *commands, rl_str *out);
void rl_help_command(const rl_command_info *command, rl_str *out);

/* The command of that name, or an error with the nearest. */
rl_code rl_command_find(const rl_commands *commands, const char *name, size_t *out, rl_error *err);

#endif
