/* Photometric files: an error or a table that lights can use. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/fuzz/fuzz.h"

#include <stdlib.h>

#include "graph/base/alloc.h"
#include "graph/model/ies.h"
#include "tests/tool_run.h"

size_t fuzz_begin_ies(const char *folder, fuzz_bytes *seeds, size_t room)
{
    static const char *const texts[] = {
        "IESNA:LM-63-1995\r\n[TEST] made\r\n[MANUFAC] L\xe4mp\r\nTILT=NONE\r\n1 1000 2.0 4 3 1 2 0.1 0.2 "
        "0\r\n"
        "0.5 1 40\r\n0 30 60 90\r\n0 45 90\r\n100, 80 40 0\r\n100 120 70 10\r\n100 160 90 20\r\n",
        "IESNA91\nTILT=NONE\n1 -1 1 2 5 1 1 0 0 0\n1 1 9\n0 180\n0 90 180 270 360\n1 2 3 4 5 6 7 8 1 2\n",
        "IES:LM-63-2019\n[TEST] x\nTILT=NONE\n1 -1 1e-3 3 1 1 1 0 0 0\n1 1.1 9\n90 135.5 180\n0\n1e3 2.5 0\n",
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 3 1 1 0 0 0 1 1 9 0 180 90 180 270 1 2 3 4 5 6",
    };
    size_t n = 0;
    (void)folder;
    for (; n < sizeof texts / sizeof *texts && n < room; n++)
        seeds[n] = fuzz_seed_text(texts[n]);
    return n;
}

bool fuzz_one_ies(const char *folder, const uint8_t *data, size_t size)
{
    rl_error err = {0};
    rl_arena arena = {0};
    const rl_ies *ies = NULL;
    char *path = path_in(folder, "lamp.ies");
    size_t before = rl_alloc_live();
    fuzz_write_input(folder, "lamp.ies", data, size);
    rl_code code = rl_ies_load(&arena, path, &ies, &err);
    fuzz_check(code, &err);
    if (!code != (ies != NULL))
        fuzz_broken("a profile or an error", &err);
    if (ies) {
        double all = rl_ies_integral(ies, 3.2);
        for (int i = 0; i < ies->vertical * ies->horizontal; i++) {
            if (!(ies->value[i] >= 0 && ies->value[i] <= 1.000001f))
                fuzz_broken("the table's values are shares of the largest", &err);
        }
        if (!(ies->candela > 0 && ies->candela <= 1e30 && all >= 0 && all < 12.57))
            fuzz_broken("a profile's amounts are usable", &err);
    }
    rl_arena_free(&arena);
    free(path);
    if (rl_alloc_live() != before)
        fuzz_broken("nothing is left behind", &err);
    return !code;
}
