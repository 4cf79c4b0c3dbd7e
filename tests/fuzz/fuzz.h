/* Fuzzing without a fuzzing engine: seeds are changed by a deterministic mutator, and every input is known by
 * its target, the run's seed and its number, so that `fuzz TARGET --seed S --only N` does one again. */
#ifndef RL_TESTS_FUZZ_H
#define RL_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"

typedef struct fuzz_bytes {
    uint8_t *data; /* malloc'ed */
    size_t size;
} fuzz_bytes;

typedef struct fuzz_target {
    const char *name;
    const char *what; /* for people */
    bool text;        /* lines and words are moved, too */
    /* Files that every input of the target needs, in `folder`; the seeds. */
    size_t (*begin)(const char *folder, fuzz_bytes *seeds, size_t room);
    /* Feeds one input; ends the process with a message when a promise is broken. Whether relit accepted it.
     */
    bool (*one)(const char *folder, const uint8_t *data, size_t size);
    void (*end)(void); /* may be NULL */
} fuzz_target;

extern const fuzz_target fuzz_targets[];
extern const size_t fuzz_n_targets;

enum { FUZZ_MOST_SEEDS = 32, FUZZ_MOST_BYTES = 1 << 16 };

/* ---- for targets ---- */

/* Ends the process: a promise that relit makes does not hold. */
void fuzz_broken(const char *promise, const rl_error *err);
/* What must hold after any call: an error says what is wrong, and it is the user's, not relit's. */
void fuzz_check(rl_code code, const rl_error *err);
void fuzz_write_input(const char *folder, const char *name, const uint8_t *data, size_t size);
fuzz_bytes fuzz_seed_text(const char *text);

size_t fuzz_begin_ies(const char *folder, fuzz_bytes *seeds, size_t room);
bool fuzz_one_ies(const char *folder, const uint8_t *data, size_t size);

/* The n-th input of a run: a seed, changed one to a dozen times. Returns its size; `out` holds
 * FUZZ_MOST_BYTES. */
size_t fuzz_mutate(const fuzz_target *target, const fuzz_bytes *seeds, size_t n_seeds, uint64_t seed,
                   uint64_t n, uint8_t *out);

/* Inputs from `first` on until `seconds` have passed or `most` have been tried; returns how many, and in
 * *accepted (may be NULL) how many were fine input after all. A broken promise, a crash, or an input that
 * takes over 20 s ends the process and names the input on stderr. */
uint64_t fuzz_run(const fuzz_target *target, uint64_t seed, uint64_t first, uint64_t most, double seconds,
                  uint64_t *accepted);

#endif
