/* `relit --help`, `relit NAME --help`. */
#include <string.h>

#include "graph/tool/options.h"
#include "graph/tool/options_table.h"

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
    for (size_t i = 0; i < rl_options_n; i++) {
        const rl_option *o = &rl_options_table[i];
        char left[64];
        if (!(o->commands & command->bit))
            continue;
        strcpy(left, "--");
        strncat(left, o->name, 30);
        if (o->argument) {
            if (o->kind != RL_TAKES_MAYBE) /* "--sheet[=FILE]" */
                strcat(left, " ");
            strncat(left, o->argument, 28);
        }
        add_row(out, OPTION_COLUMN, left, o->help);
    }
}
