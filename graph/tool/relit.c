/* The program: everything is in rl_tool_main, which tests call too. */
#include <signal.h>

#include "graph/tool/tool.h"

int main(int argc, char **argv)
{
    signal(SIGXFSZ, SIG_IGN); /* `ulimit -f`: a write that fails, as on a full disk, and not the end */
    int status = rl_tool_main(argc, argv, stdout, stderr);
    if (status <= 128)
        return status;
    /* A run that a signal stopped ends by that signal, so that a shell's loop around it stops too. */
    signal(status - 128, SIG_DFL);
    raise(status - 128);
    return status;
}
