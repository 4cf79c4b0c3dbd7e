/* fuzz [TARGET…] [--seconds S] [--seed N] [--only N]: `make fuzz` runs it under the sanitizers, every target,
 * 60 s each. */
#include "tests/fuzz/fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int usage(void)
{
    fprintf(stderr, "fuzz [TARGET...] [--seconds S] [--seed N] [--only N]\n");
    for (size_t i = 0; i < fuzz_n_targets; i++)
        fprintf(stderr, "  %-10s %s\n", fuzz_targets[i].name, fuzz_targets[i].what);
    return 2;
}

int main(int argc, char **argv)
{
    double seconds = 60;
    uint64_t seed = 1, only = UINT64_MAX;
    bool chosen[16] = {0}, any = false;
    for (int i = 1; i < argc; i++) {
        bool known = false, value = i + 1 < argc;
        for (size_t t = 0; t < fuzz_n_targets; t++)
            if (!strcmp(argv[i], fuzz_targets[t].name))
                known = any = chosen[t] = true;
        if (known)
            continue;
        if (value && !strcmp(argv[i], "--seconds"))
            seconds = strtod(argv[++i], NULL);
        else if (value && !strcmp(argv[i], "--seed"))
            seed = strtoull(argv[++i], NULL, 10);
        else if (value && !strcmp(argv[i], "--only"))
            only = strtoull(argv[++i], NULL, 10);
        else
            return usage();
    }
    for (size_t t = 0; t < fuzz_n_targets; t++) {
        if (any && !chosen[t])
            continue;
        uint64_t fine = 0;
        uint64_t n = only == UINT64_MAX ? fuzz_run(&fuzz_targets[t], seed, 0, UINT64_MAX, seconds, &fine)
                                        : fuzz_run(&fuzz_targets[t], seed, only, 1, 3600, &fine);
        printf("%-10s %llu inputs, %llu of them fine, seed %llu: every promise held\n", fuzz_targets[t].name,
               (unsigned long long)n, (unsigned long long)fine, (unsigned long long)seed);
        fflush(stdout);
    }
    return 0;
}
