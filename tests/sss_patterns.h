/* The patterns of sss_burley's taps, and what their weights add up to, summed again. */
#ifndef RL_TESTS_SSS_PATTERNS_H
#define RL_TESTS_SSS_PATTERNS_H

/* The patterns of n taps for channels of these proportions. */
enum { MOST_PATTERNS = 15, PATTERN_TAPS = 4096 };
typedef struct patterns_t {
    int n, count;
    double d[3];
    float x[PATTERN_TAPS], y[PATTERN_TAPS], weight[PATTERN_TAPS]; /* n of the first pattern, of the next, … */
    double share[MOST_PATTERNS][3]; /* weights on a plane that faces the camera, beside all patterns' mean */
} patterns_t;

/* n >= 1 taps, d in units of the largest. Those of the last few calls are kept, as there are many pixels:
 * valid until eight others were asked for. Single-threaded. */
const patterns_t *patterns_for(int n, const double d[3]);

#endif
