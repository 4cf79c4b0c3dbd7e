#include "graph/tool/options.h"

#include <limits.h>
#include <string.h>

/* ---- the table ----------------------------------------------------------------------------------------- */

typedef enum kind {
    FLAG,    /* bool, no argument */
    TEXT,    /* const char * */
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

#define SHARED         (RL_CMD_RUN | RL_CMD_CHECK | RL_CMD_PLAN)
#define TIMED          (SHARED | RL_CMD_BENCH)
#define EVERY          (TIMED | RL_CMD_INIT | RL_CMD_INSPECT | RL_CMD_PASSES | RL_CMD_DEVICES | RL_CMD_DIFF)
#define AT(field)      .at = offsetof(rl_arguments, field)
#define LIST_AT(field) AT(run.field), .count = offsetof(rl_arguments, run.n_##field)

/* clang-format off */
static const option options[] = {
    {"capture", "PATH", TIMED, LIST, LIST_AT(captures),
     .help = "a capture.yaml, a folder that holds one, or an EXR\n"
             "file or pattern; replaces the pipeline's own;\n"
             "may be repeated"},
    {"frames", "SPEC", TIMED, TEXT, AT(run.frames),
     .help = "such as 1-24, 1-24x2, 1,5,9-12 or -10--1;\n"
             "default: all that the capture lists"},
    {"out", "DIR", SHARED, TEXT, AT(run.out),
     .help = "where outputs go (created when missing); default: out"},
    {"set", "PATH=VALUE", TIMED, SETTING, LIST_AT(settings),
     .help = "set a value of the pipeline by its dotted path,\n"
             "such as graph.sss.taps=55; null removes it;\n"
             "may be repeated"},
    {"only", "NAME", TIMED, LIST, LIST_AT(only),
     .help = "make this output and no other; may be repeated"},
    {"dump", "IMAGE", SHARED, LIST, LIST_AT(dump),
     .help = "write this image of the graph as EXR besides;\n"
             "may be repeated"},
    {"crop", "X,Y,W,H", SHARED, REGION, AT(run.crop),
     .help = "a region, in pixels of the display window"},
    {"on-missing", "WORD", SHARED, WORD, AT(on_missing), .words = "error|skip|hold",
     .help = "what to do about an input frame that is missing\n"
             "or broken: error (default), skip it, or hold the\n"
             "frame before it under its number"},
    {"resume", NULL, SHARED, FLAG, AT(run.resume),
     .help = "keep the pictures that are there and whole, and go\n"
             "on from the last checkpoint of their history"},
    {"shard", "I/N", SHARED, SHARD, AT(run.shard),
     .help = "the I-th of N parts: whole captures, or frame ranges\n"
             "that take over history from the part before"},
    {"preroll", "K", SHARED, INTEGER, AT(run.preroll), .min = 1, .max = 1000000,
     .help = "a shard begins with K frames of warm-up instead; not\n"
             "exact: `relit plan --shard` says how far off"},
    {"checkpoint-frames", "N", RL_CMD_RUN, INTEGER, AT(run.checkpoint_frames), .min = 1, .max = 1000000,
     .help = "save history every N frames; default: so often that\n"
             "it takes 2 % of the time"},
    {"ocio", "FILE", TIMED, TEXT, AT(run.ocio),
     .help = "OpenColorIO config; default: the pipeline's, else\n"
             "$OCIO, else relit's own"},
    {"threads", "N", TIMED | RL_CMD_DIFF, INTEGER, AT(run.threads), .min = 1, .max = 1024,
     .help = "how many to use; default: one a processor"},
    {"device", "N|cpu|gpu", TIMED | RL_CMD_DEVICES, TEXT, AT(run.device),
     .help = "OpenCL device, by number (see `relit devices`) or\n"
             "kind; default: a CPU device if there is one"},
    {"memory-limit", "SIZE", TIMED, BYTES, AT(run.memory_limit),
     .help = "most that relit may allocate, such as 512M or 4G;\n"
             "default: no limit"},
    {"format", "WORD", RL_CMD_PLAN, WORD, AT(format), .words = "text|dot|svg|json",
     .help = "text (default), dot, svg or json"},
    {"json", NULL, TIMED | RL_CMD_PASSES | RL_CMD_DEVICES | RL_CMD_DIFF, FLAG, AT(json),
     .help = "print JSON on stdout (run: an object a frame, each\n"
             "on its line)"},
    {"markdown", NULL, RL_CMD_PASSES, FLAG, AT(markdown),
     .help = "print Markdown tables, as in passes/README.md"},
    {"size", "WxH", RL_CMD_BENCH, SIZE, AT(size),
     .help = "time frames of that size: the capture's pixels\n"
             "repeated or left out; default: as they are"},
    {"metric", "NAME", RL_CMD_DIFF, TEXT, AT(metric),
     .help = "flip, hdrflip, psnr, ssim, rmse or max; default:\n"
             "flip for 8-bit files, hdrflip for float"},
    {"heatmap", "F.png", RL_CMD_DIFF, TEXT, AT(heatmap),
     .help = "write the metric of every pixel as a picture"},
    {"fail-over", "[METRIC.STAT=]X", RL_CMD_DIFF, LIST, AT(fail_over),
     .count = offsetof(rl_arguments, n_fail_over),
     .help = "exit with 3 when the mean, or flip.p95 or such, is\n"
             "over X (psnr and ssim: under X); may be repeated"},
    {"trace", "F.json", RL_CMD_RUN, TEXT, AT(trace),
     .help = "write what ran when, for ui.perfetto.dev or\n"
             "chrome://tracing"},
    {"quiet", NULL, EVERY, FLAG, AT(quiet),
     .help = "print errors and warnings only: no notes, no progress"},
    {"verbose", NULL, EVERY, FLAG, AT(verbose),
     .help = "print more notes"},
    {"help", NULL, EVERY, FLAG, AT(help),
     .help = "print this help"},
};
/* clang-format on */

enum { N_OPTIONS = sizeof options / sizeof *options };

/* ---- parsing ------------------------------------------------------------------------------------------- */

typedef struct parser {
    rl_arena *arena;
    const rl_commands *commands;
    const rl_command_info *command;
    char place[64]; /* "relit run": what errors give as their place */
    rl_arguments *out;
    rl_error *err;
} parser;

static rl_code wrong(const parser *p, const option *o, const char *expected, const char *found)
{
    return rl_fail_file(p->err, RL_E_USAGE, p->place, "option '--%s' takes %s, found '%s'", o->name, expected,
                        found);
}

/* Appends to a list in the arena: doubling would waste little and copying costs nothing at this size. */
static void *append(const parser *p, const option *o, size_t size)
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

static rl_code take_setting(const parser *p, const option *o, const char *value)
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

static rl_code take_region(const parser *p, const option *o, const char *value, int out[4])
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

static rl_code take_shard(const parser *p, const option *o, const char *value, int out[2])
{
    size_t n = strcspn(value, "/");
    long long part, parts;
    char *head = rl_arena_strndup(p->arena, value, n);
    if (!head)
        return rl_fail_memory(p->err, n);
    if (value[n] != '/' || !rl_parse_int(head, &part) || !rl_parse_int(value + n + 1, &parts) || parts < 1 ||
        parts > 1000000 || part < 1 || part > parts)
        return wrong(p, o, "I/N with I from 1 to N, such as 2/8", value);
    out[0] = (int)part;
    out[1] = (int)parts;
    return RL_OK;
}

static rl_code take_size(const parser *p, const option *o, const char *value, int out[2])
{
    size_t n = strcspn(value, "x");
    long long width, height;
    char *head = rl_arena_strndup(p->arena, value, n);
    if (!head)
        return rl_fail_memory(p->err, n);
    if (value[n] != 'x' || !rl_parse_int(head, &width) || !rl_parse_int(value + n + 1, &height) ||
        width < 1 || height < 1 || width > 65536 || height > 65536)
        return wrong(p, o, "WxH in pixels, such as 1920x1080", value);
    out[0] = (int)width;
    out[1] = (int)height;
    return RL_OK;
}

static rl_code take_word(const parser *p, const option *o, const char *value, int *out)
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

static rl_code take_integer(const parser *p, const option *o, const char *value, int *out)
{
    long long number;
    if (!rl_parse_int(value, &number) || number < o->min || number > o->max)
        return rl_fail_file(p->err, RL_E_USAGE, p->place,
                            "option '--%s' takes an integer from %lld to %lld, found '%s'", o->name, o->min,
                            o->max, value);
    *out = (int)number;
    return RL_OK;
}

static rl_code take(const parser *p, const option *o, const char *value)
{
    void *at = (char *)p->out + o->at;
    unsigned long long bytes;
    const char **item;
    switch (o->kind) {
    case FLAG:
        *(bool *)at = true;
        return RL_OK;
    case TEXT:
        if (!*value)
            return wrong(p, o, o->argument, value);
        *(const char **)at = value;
        return RL_OK;
    case LIST:
        if (!*value)
            return wrong(p, o, o->argument, value);
        item = append(p, o, sizeof *item);
        if (!item)
            return rl_fail_memory(p->err, sizeof *item);
        *item = value;
        return RL_OK;
    case SETTING:
        return take_setting(p, o, value);
    case INTEGER:
        return take_integer(p, o, value, at);
    case BYTES:
        if (!rl_parse_bytes(value, &bytes))
            return wrong(p, o, "a size such as 512M or 4G", value);
        *(uint64_t *)at = bytes;
        return RL_OK;
    case REGION:
        return take_region(p, o, value, at);
    case SIZE:
        return take_size(p, o, value, at);
    case SHARD:
        return take_shard(p, o, value, at);
    default:
        return take_word(p, o, value, at);
    }
}

static rl_code unknown_option(const parser *p, const char *name)
{
    const char *known[N_OPTIONS];
    size_t n = 0;
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (options[i].commands & p->command->bit)
            known[n++] = options[i].name;
    rl_str text = {0};
    rl_suggest(&text, name, known, n, "known");
    rl_fail_file(p->err, RL_E_USAGE, p->place, "there is no option '--%s'%s", name, rl_str_text(&text));
    rl_str_free(&text);
    return RL_E_USAGE;
}

/* The option exists, but not for this command: say for which. */
static rl_code foreign_option(const parser *p, const option *o)
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

static const option *find_option(const char *name, size_t length)
{
    for (size_t i = 0; i < N_OPTIONS; i++)
        if (strlen(options[i].name) == length && !strncmp(options[i].name, name, length))
            return &options[i];
    return NULL;
}

/* One option at argv[*i], which starts with "--"; moves *i to its last word. A value may start with one dash
 * ("--frames -10--1"), but not with two: that is an option whose value was forgotten. */
static rl_code parse_option(const parser *p, int argc, char **argv, int *i)
{
    const char *name = argv[*i] + 2, *equals = strchr(name, '=');
    size_t length = equals ? (size_t)(equals - name) : strlen(name);
    const option *o = find_option(name, length);
    if (!o) {
        char *copy = rl_arena_strndup(p->arena, name, length);
        return copy ? unknown_option(p, copy) : rl_fail_memory(p->err, length);
    }
    if (!(o->commands & p->command->bit))
        return foreign_option(p, o);
    if (!o->argument)
        return equals ? wrong(p, o, "no value", equals + 1) : take(p, o, NULL);
    if (equals)
        return take(p, o, equals + 1);
    if (*i + 1 >= argc || !strncmp(argv[*i + 1], "--", 2))
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "option '--%s' needs %s behind it", o->name,
                            o->argument);
    return take(p, o, argv[++*i]);
}

static rl_code parse_operand(const parser *p, const char *word)
{
    if (word[0] == '-' && word[1])
        return rl_fail_file(p->err, RL_E_USAGE, p->place,
                            "there is no option '%s'; options start with two dashes, see `relit %s --help`",
                            word, p->command->name);
    if (!p->command->operand)
        return rl_fail_file(p->err, RL_E_USAGE, p->place, "takes no argument, found '%s'", word);
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
        code = rl_fail_file(err, RL_E_USAGE, p.place, "needs a %s, see `relit %s --help`", command->operand,
                            command->name);
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

/* ---- help ---------------------------------------------------------------------------------------------- */

enum { COMMAND_COLUMN = 20, OPTION_COLUMN = 26 };

/* "  --frames SPEC           1-24, …", continued at the same column. */
static void add_row(rl_str *s, int column, const char *left, const char *help)
{
    rl_str_printf(s, "  %-*s", column - 2, left);
    if (strlen(left) > (size_t)column - 4)
        rl_str_printf(s, "\n%*s", column, "");
    for (const char *at = help; at; at = strchr(at, '\n') ? strchr(at, '\n') + 1 : NULL)
        rl_str_printf(s, "%*s%.*s\n", at == help ? 0 : column, "", (int)strcspn(at, "\n"), at);
}

void rl_help_overview(const rl_commands *commands, rl_str *out)
{
    rl_str_add(out, "relit " RL_VERSION ": re-lights recorded G-buffers\n\n"
                    "usage: relit COMMAND [argument] [options]\n\n");
    for (size_t i = 0; i < commands->n; i++) {
        const rl_command_info *c = commands->rows[i];
        char left[64];
        rl_str line = {0};
        rl_str_printf(&line, "%s %s", c->name, c->operand ? c->operand : "");
        strncpy(left, rl_str_text(&line), sizeof left - 1);
        left[sizeof left - 1] = 0;
        rl_str_free(&line);
        add_row(out, COMMAND_COLUMN, left, c->help);
    }
    rl_str_add(out, "\n`relit COMMAND --help` lists a command's options, `relit --version` the version.\n\n"
                    "exit status:\n"
                    "  0  all done\n"
                    "  1  a frame failed; the others were written\n"
                    "  2  the command line, the pipeline or the capture is wrong; nothing was written\n"
                    "  3  images differ by more than --fail-over allows\n"
                    "  SIGINT and SIGTERM stop a run by that signal, after the frames in flight\n");
}

void rl_help_command(const rl_command_info *command, rl_str *out)
{
    rl_str_printf(out, "usage: relit %s%s%s [options]\n\n%s\n", command->name, command->operand ? " " : "",
                  command->operand ? command->operand : "", command->help);
    if (command->more)
        rl_str_printf(out, "\n%s", command->more);
    rl_str_add(out, "\noptions:\n");
    for (size_t i = 0; i < N_OPTIONS; i++) {
        const option *o = &options[i];
        char left[64];
        if (!(o->commands & command->bit))
            continue;
        strcpy(left, "--");
        strncat(left, o->name, 30);
        if (o->argument) {
            strcat(left, " ");
            strncat(left, o->argument, 28);
        }
        add_row(out, OPTION_COLUMN, left, o->help);
    }
}
