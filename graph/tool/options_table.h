/* The table of options: what each takes, where it is kept, which commands have it. Not for the commands. */
#ifndef RL_TOOL_OPTIONS_TABLE_H
#define RL_TOOL_OPTIONS_TABLE_H

#include <stddef.h>

#include "graph/tool/options.h"

typedef enum kind {
    FLAG,    /* bool, no argument */
    TEXT,    /* const char * */
    MAYBE,   /* const char *, "" when nothing is given; a value only behind '=' */
    LIST,    /* const char *const *, and its count at `count` */
    SETTING, /* rl_setting, "path=value", the same */
    INTEGER, /* int, min … max */
    BYTES,   /* uint64_t */
    REGION,  /* int[4]: x, y, width, height */
    SHARD,   /* int[2]: "I/N" */
    SIZE,    /* int[2]: "WxH" */
    WORD     /* int, index into words */
} kind;

typedef struct option {
    const char *name, *argument;
    unsigned commands; /* rl_command_bit */
    kind kind;
    size_t at, count; /* offsets in rl_arguments */
    long long min, max;
    const char *words;
    const char *help; /* newlines continue below */
} option;

enum { RL_MOST_OPTIONS = 64 };
extern const option rl_options_table[];
extern const size_t rl_options_n;

#endif
