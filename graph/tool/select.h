/* The k-th smallest of many values, without sorting them all. */
#ifndef RL_TOOL_SELECT_H
#define RL_TOOL_SELECT_H

#include <stddef.h>

/* k counts from 0, k < n. Reorders the values: those before k are not above the result, those behind it not
 * below. No NaN. */
float rl_select(float *values, size_t n, size_t k);

#endif
