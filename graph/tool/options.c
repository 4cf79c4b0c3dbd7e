#include "graph/tool/options.h"

#include <limits.h>
#include <string.h>

#include "graph/tool/options_table.h"

typedef struct parser {
    rl_arena *arena;
    const rl_commands *commands;
    const rl_command_info *command;
    char place[64]; /* "relit run": what errors give as their place */
    rl_arguments *out;
    rl_error *err;
} parser;

static rl_code wrong(const parser *p, const rl_option *o, const char *expected, const char *found)
{
    return rl_fail_file(p->err, RL_E_USAGE, p->place, "option '--%s' takes %s, found '%s'", o->name, expected,
                        found);
}

/* Appends to a list in the arena: doubling would waste little and copying costs nothing at this size. */
static void *append(const parser *p, const rl_option *o, size_t size)
{
    void **list = (void **)((char *)p->out + o->at);
    size_t *n = (size_t *)((char *)p->out + o->count);
    char *grown = rl_arena_array(p->arena, *n + 1, size);
    if (!grown)
        return NULL;
    if (*n)
        memcpy(grown, *list, *n * size);
    *list = grown;
    return grown + size * (*n)++;
}

static rl_code take_setting(const parser *p, const rl_option *o, const char *value)
{
    const char *equals = strchr(value, '=');
    if (!equals || equals == value)
        return wrong(p, o, "PATH=VALUE, such as graph.sss.taps=55", value);
    rl_setting *s = append(p, o, sizeof *s);
    char *path = s ? rl_arena_strndup(p->arena, value, (size_t)(equals - value)) : NULL;
    if (!path)
        return rl_fail_memory(p->err, strlen(value));
    *s = (rl_setting){path, equals + 1};
    return RL_OK;
}

static rl_code take_region(const parser *p, const rl_option *o, const char *value, int out[4])
{
    const char *expected = "X,Y,W,H: four integers, width and height at least 1";
    const char *at = value;
    for (int i = 0; i < 4; i++) {
        size_t n = strcspn(at, ",");
        char *part = rl_arena_strndup(p->arena, at, n);
        long long number;
        if (!part)
            return rl_fail_memory(p->err, n);
        if (!rl_parse_int(part, &number) || number < (i < 2 ? INT_MIN : 1) || number > INT_MAX ||
            (at[n] == ',') != (i < 3))
            return wrong(p, o, expected, value);
        out[i] = (int)number;
        at += n + (i < 3);
    }
    return RL_OK;
}

/* "2/8" at the '/', "64x48" at the 'x': two integers from 1 to `most`. */
static rl_code take_pair(const parser *p, const rl_option *o, const char *value, char mark, int most,
                         const char *expected, int out[2])
{
    size_t n = strcspn(value, (const char[]){mark, 0});
    long long first, second;
    char *head = rl_arena_strndup(p->arena, value, n);
    if (!head)
        return rl_fail_memory(p->err, n);
    if (value[n] != mark || !rl_parse_int(head, &first) || !rl_parse_int(value + n + 1, &second) ||
        first < 1 || second < 1 || first > most || second > most)
        return wrong(p, o, expected, value);
    out[0] = (int)first;
    out[1] = (int)second;
    return RL_OK;
}

static rl_code take_shard(const parser *p, const rl_option *o, const char *value, int out[2])
{
    const char *expected = "I/N with I from 1 to N, such as 2/8";
    rl_code code = take_pair(p, o, value, '/', 1000000, expected, out);
    return !code && out[0] > out[1] ? wrong(p, o, expected, value) : code;
}

static rl_code take_word(const parser *p, const rl_option *o, const char *value, int *out)
{
    int index = 0;
    for (const char *at = o->words; *at; index++) {
        size_t n = strcspn(at, "|");
        if (strlen(value) == n && !strncmp(at, value, n)) {
            *out = index;
            return RL_OK;
        }
        at += n + (at[n] == '|');
    }
    return wrong(p, o, o->words, value);
}

static rl_code take_integer(const parser *p, const rl_option *o, const char *value, int *out)
{
    long long number;
    if (!rl_parse_int(value, &number) || number < o->min || number > o->max)
        return rl_fail_file(p->err, RL_E_USAGE, p->place,
                            "option '--%s' takes an integer from %lld to %lld, found '%s'", o->name, o->min,
                            o->max, value);
    *out = (int)number;
    return RL_OK;
}

static rl_code take(const parser *p, const rl_option *o, const char *value)
{
    void *at = (char *)p->out + o->at;
    unsigned long long bytes;
    const char **item;
    switch (o->kind) {
    case RL_TAKES_FLAG:
        *(bool *)at = true;
        return RL_OK;
    case RL_TAKES_TEXT:
        if (!*value)
            return wrong(p, o, o->argument, value);
        *(const char **)at = value;
        return RL_OK;
    case RL_TAKES_MAYBE:
        if (value && !*value)
            return wrong(p, o, o->argument, value);
        *(const char **)at = value ? value : "";
        return RL_OK;
    case RL_TAKES_LIST:
        if (!*value)
            return wrong(p, o, o->argument, value);
        item = append(p, o, sizeof *item);
        if (!item)
            return rl_fail_memory(p->err, sizeof *item);
        *item = value;
        return RL_OK;
    case RL_TAKES_SETTING:
        return take_setting(p, o, value);
    case RL_TAKES_INTEGER:
        return take_integer(p, o, value, at);
    case RL_TAKES_BYTES:
        if (!rl_parse_bytes(value, &bytes))
            return wrong(p, o, "a size such as 512M or 4G", value);
        *(uint64_t *)at = bytes;
        return RL_OK;
    case RL_TAKES_REGION:
        return take_region(p, o, value, at);
    case RL_TAKES_SIZE:
        return take_pair(p, o, value, 'x', 65536, "WxH in pixels, such as 1920x1080", at);
    case RL_TAKES_SHARD:
        return take_shard(p, o, value, at);
    default:
        return take_word(p, o, value, at);
    }
}

static rl_code unknown_option(const parser *p, const char *name)
{
    const char *known[RL_MOST_OPTIONS];
    size_t n = 0;
    for (size_t i = 0; i < rl_options_n; i++)
        if (rl_options_table[i].commands & p->command->bit)
            known[n++] = rl_options_table[i].name;
    rl_str text = {0};
    rl_suggest(&text, name, known, n, "known");
    rl_fail_file(p->err, RL_E_USAGE, p->place, "there is no option '--%s'%s", name, rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

/* The option exists, but not for this command: say for which. */
static rl_code foreign_option(const parser *p, const rl_option *o)
{
    rl_str text = {0};
    for (size_t i = 0; i < p->commands->n; i++)
        if (p->commands->rows[i]->bit & o->commands)
            rl_str_printf(&text, "%s%s", text.length ? ", " : "", p->commands->rows[i]->name);
    rl_fail_file(p->err, RL_E_USAGE, p->place, "option '--%s' does nothing here; it is for %s", o->name,
                 rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

static const rl_option *find_option(const char *name, size_t length)
{
    for (size_t i = 0; i < rl_options_n; i++)
        if (strlen(rl_options_table[i].name) == length && !strncmp(rl_options_table[i].name, name, length))
            return &rl_options_table[i];
    return NULL;
}

/* One option at argv[*i], which starts with "--"; moves *i to its last word. A value may start with one dash
 * ("--frames -10--1"), but not with two: that is an option whose value was forgotten. */
static rl_code parse_option(const parser *p, int argc, char **argv, int *i)
{
    const char *name = argv[*i] + 2, *equals = strchr(name, '=');
    size_t length = equals ? (size_t)(equals - name) : strlen(name);
    const rl_option *o = find_option(name, length);
    if (!o) {
        char *copy = rl_arena_strndup(p->arena, name, length);
        return copy ? unknown_option(p, copy) : rl_fail_memory(p->err, length);
    }
    if (!(o->commands & p->command->bit))
        return foreign_option(p, o);
    if (!o->argument)
        return equals ? wrong(p, o, "no value", equals + 1) : take(p, o, NULL);
    if (equals || o->kind == RL_TAKES_MAYBE)
        return take(p, o, equals ? equals + 1 : NULL);
    if (*i + 1 >= argc || !strncmp(argv[*i + 1], "--", 2))
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "option '--%s' needs %s behind it", o->name,
                            o->argument);
    return take(p, o, argv[++*i]);
}

/* "PIPELINE...": one or more. */
static bool takes_several(const rl_command_info *command)
{
    return strstr(command->operand, "...") != NULL;
}

static rl_code add_operand(const parser *p, const char *word)
{
    static const rl_option operands = {.at = offsetof(rl_arguments, operands),
                                       .count = offsetof(rl_arguments, n_operands)};
    const char **item = append(p, &operands, sizeof *item);
    if (!item)
        return rl_fail_memory(p->err, sizeof *item);
    *item = word;
    p->out->operand = p->out->operands[0];
    return RL_OK;
}

static rl_code parse_operand(const parser *p, const char *word)
{
    if (word[0] == '-' && word[1])
        return rl_fail_file(p->err, RL_E_USAGE, p->place,
                            "there is no option '%s'; options start with two dashes, see `relit %s --help`",
                            word, p->command->name);
    if (!p->command->operand)
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "takes no argument, found '%s'", word);
    if (takes_several(p->command))
        return add_operand(p, word);
    bool two = strchr(p->command->operand, ' ');
    if (two && p->out->second)
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "takes two files, found a third, '%s'", word);
    if (!two && p->out->operand)
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "takes one %s, found '%s' and '%s'",
                            p->command->operand, p->out->operand, word);
    *(p->out->operand ? &p->out->second : &p->out->operand) = word;
    return RL_OK;
}

rl_code rl_arguments_parse(rl_arena *arena, const rl_commands *commands, const rl_command_info *command,
                           int argc, char **argv, rl_arguments *out, rl_error *err)
{
    parser p = {arena, commands, command, "relit ", out, err};
    strncat(p.place, command->name, sizeof p.place - strlen(p.place) - 1);
    rl_code code = RL_OK;
    bool only_operands = false;
    *out = (rl_arguments){0};
    for (int i = 0; i < argc && !code; i++) {
        if (!only_operands && !strcmp(argv[i], "--"))
            only_operands = true;
        else if (!only_operands && !strcmp(argv[i], "-h"))
            out->help = true;
        else if (!only_operands && !strncmp(argv[i], "--", 2))
            code = parse_option(&p, argc, argv, &i);
        else
            code = parse_operand(&p, argv[i]);
    }
    out->run.on_missing = (rl_on_missing)out->on_missing;
    if (!code && !out->help && !out->operand && command->operand && command->operand[0] != '[' &&
        !strchr(command->operand, ' '))
        code = rl_fail_file(err, RL_E_USAGE, p.place, "needs a %.*s, see `relit %s --help`",
                            (int)strcspn(command->operand, "."), command->operand, command->name);
    if (!code && out->run.preroll && !out->run.shard[1])
        code = rl_fail_file(err, RL_E_USAGE, p.place,
                            "--preroll is the warm-up of a shard: give --shard I/N too");
    if (!code && !out->help && command->operand && strchr(command->operand, ' ') && !out->second)
        code = rl_fail_file(err, RL_E_USAGE, p.place, "needs two files, %s, see `relit %s --help`",
                            command->operand, command->name);
    if (!code && out->quiet && out->verbose)
        code = rl_fail_file(err, RL_E_USAGE, p.place, "--quiet and --verbose exclude each other");
    return code;
}

rl_code rl_command_find(const rl_commands *commands, const char *name, size_t *out, rl_error *err)
{
    const char *known[32];
    size_t n = 0;
    for (size_t i = 0; i < commands->n && n < sizeof known / sizeof *known; i++) {
        known[n++] = commands->rows[i]->name;
        if (!strcmp(name, commands->rows[i]->name)) {
            *out = i;
            return RL_OK;
        }
    }
    rl_str text = {0};
    rl_suggest(&text, name, known, n, "known");
    rl_fail_file(err, RL_E_USAGE, "relit", "there is no command '%s'%s", name, rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}
