#include "graph/tool/signals.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t caught;
static int message_fd = -1;
static struct sigaction before_int, before_term;

/* Only what POSIX allows in a handler. The action is one-shot (SA_RESETHAND), so that the second signal of a
 * kind does what it does by default: it ends the process. */
static void on_signal(int number)
{
    static const char text[] = "\nstopping after the frames in flight; once more stops at once\n";
    int saved = errno;
    caught = number;
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    if (message_fd >= 0) {
        ssize_t ignored = write(message_fd, text, sizeof text - 1);
        (void)ignored;
    }
    errno = saved;
}

void rl_signals_begin(int fd)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART | (int)SA_RESETHAND;
    sigemptyset(&action.sa_mask);
    caught = 0;
    message_fd = fd;
    sigaction(SIGINT, &action, &before_int);
    sigaction(SIGTERM, &action, &before_term);
}

void rl_signals_end(void)
{
    sigaction(SIGINT, &before_int, NULL);
    sigaction(SIGTERM, &before_term, NULL);
    message_fd = -1;
}

int rl_signals_caught(void)
{
    return caught;
}
