/* See sss_patterns.h. */
#include "tests/sss_patterns.h"

#include <math.h>
#include <string.h>

#include "passes/burley.h"

/* An odd number, at most 15, of patterns that are padded to 64 taps and have 4096 together. */
static int patterns_of(int n)
{
    int most = 4096 / ((n + 63) / 64 * 64);
    if (most > 15)
        most = 15;
    return most % 2 ? most : most - 1;
}

const patterns_t *patterns_for(int n, const double d[3])
{
    enum { KEPT = 32 }; /* callers hold one while they ask for others */
    static patterns_t kept[KEPT];
    static int next;
    for (int i = 0; i < KEPT; i++)
        if (kept[i].n == n && !memcmp(kept[i].d, d, sizeof kept[i].d))
            return &kept[i];
    patterns_t *p = &kept[next++ % KEPT];
    double mean[3] = {0}, unused[3];
    memset(p, 0, sizeof *p);
    p->n = n;
    p->count = patterns_of(n);
    memcpy(p->d, d, sizeof p->d);
    for (int j = 0; j < p->count; j++) {
        float *x = p->x + j * n, *y = p->y + j * n, *weight = p->weight + j * n;
        rl_burley_mixture_taps((size_t)n, (j + 0.5) / p->count, d, x, y, weight, unused);
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < n; i++)
                p->share[j][c] += rl_burley_profile(hypot(x[i], y[i]), d[c]) * weight[i];
            mean[c] += p->share[j][c] / p->count;
        }
    }
    for (int j = 0; j < p->count; j++)
        for (int c = 0; c < 3; c++)
            p->share[j][c] /= mean[c];
    return p;
}
