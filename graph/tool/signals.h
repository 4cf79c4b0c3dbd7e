/* SIGINT and SIGTERM: the first asks the run to stop after the frames in flight, a second one stops at once.
 */
#ifndef RL_TOOL_SIGNALS_H
#define RL_TOOL_SIGNALS_H

/* From here on signals are caught, until rl_signals_end puts back what was there. `fd`: where the first one
 * says what happens (-1: nowhere). One pair at a time in a process. */
void rl_signals_begin(int fd);
void rl_signals_end(void);

/* The signal that was caught since rl_signals_begin, or 0. */
int rl_signals_caught(void);

#endif
