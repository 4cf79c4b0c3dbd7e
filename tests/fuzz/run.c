#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/fuzz/fuzz.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "tests/tool_run.h"

/* Of the input that runs, for the last words. */
static char line[160];

static void say_input(void)
{
    ssize_t ignored = write(2, line, strlen(line));
    (void)ignored;
}

static void on_signal(int number)
{
    say_input();
    signal(number, SIG_DFL);
    raise(number);
}

/* The sanitizers' own, where they are linked in. */
extern void __sanitizer_set_death_callback(void (*callback)(void)) __attribute__((weak));

static void catch_all(void)
{
    static const int numbers[] = {SIGALRM, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
    bool sanitized = __sanitizer_set_death_callback != NULL;
    if (sanitized)
        __sanitizer_set_death_callback(say_input);
    for (size_t i = 0; i < (sanitized ? 2 : sizeof numbers / sizeof *numbers); i++)
        signal(numbers[i], on_signal);
}

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

uint64_t fuzz_run(const fuzz_target *target, uint64_t seed, uint64_t first, uint64_t most, double seconds,
                  uint64_t *accepted)
{
    fuzz_bytes seeds[FUZZ_MOST_SEEDS] = {0};
    char *folder = folder_new();
    uint8_t *input = malloc(FUZZ_MOST_BYTES);
    if (!input)
        abort();
    size_t n_seeds = target->begin(folder, seeds, FUZZ_MOST_SEEDS);
    uint64_t n = 0, fine = 0;
    catch_all();
    for (double end = now_s() + seconds; n < most && now_s() < end; n++) {
        snprintf(line, sizeof line, "\ninput: %s --seed %llu --only %llu\n", target->name,
                 (unsigned long long)seed, (unsigned long long)(first + n));
        size_t size = fuzz_mutate(target, seeds, n_seeds, seed, first + n, input);
        alarm(20);
        fine += target->one(folder, input, size);
    }
    alarm(0);
    if (target->end)
        target->end();
    for (size_t i = 0; i < n_seeds; i++)
        free(seeds[i].data);
    free(input);
    folder_remove(folder);
    if (accepted)
        *accepted = fine;
    return n;
}
