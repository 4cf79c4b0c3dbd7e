/* The table of options: what each takes, where it is kept, which commands have it. Not for the commands. */
#ifndef RL_TOOL_OPTIONS_TABLE_H
#define RL_TOOL_OPTIONS_TABLE_H

#include <stddef.h>

#include "graph/tool/options.h"

typedef enum rl_takes {
    RL_TAKES_FLAG,    /* bool, no argument */
    RL_TAKES_TEXT,    /* const char * */
    RL_TAKES_MAYBE,   /* const char *, "" when nothing is given; a value only behind '=' */
    RL_TAKES_LIST,    /* const char *const *, and its count at `count` */
    RL_TAKES_SETTING, /* rl_setting, "path=value", the same */
    RL_TAKES_INTEGER, /* int, min … max */
    RL_TAKES_BYTES,   /* uint64_t */
    RL_TAKES_REGION,  /* int[4]: x, y, width, height */
    RL_TAKES_SHARD,   /* int[2]: "I/N" */
    RL_TAKES_SIZE,    /* int[2]: "WxH" */
    RL_TAKES_WORD     /* int, index into words */
} rl_takes;

typedef struct rl_option {
    const char *name, *argument;
    unsigned commands; /* rl_command_bit */
    rl_takes kind;
    size_t at, count; /* offsets in rl_arguments */
    long long min, max;
    const char *words;
    const char *help; /* newlines continue below */
} rl_option;

enum { RL_MOST_OPTIONS = 64 };
extern const rl_option rl_options_table[];
extern const size_t rl_options_n;

#endif
