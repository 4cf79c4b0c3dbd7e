/* `make temporal`: shows what temporal anti-aliasing does. Sequences whose box-filtered truth is known, as a table of
 * errors and as strips (sample | result | truth) in out/temporal. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/image_file.h"
#include "tests/temporal_run.h"

int main(int argc, char **argv)
{
    static const temporal_scene scenes[] = {
        {.width = 192, .height = 108},
        {.width = 192, .height = 108, .camera_moves = true},
        {.width = 192, .height = 108, .object_moves = true},
        {.width = 192, .height = 108, .camera_moves = true, .object_moves = true},
        {.width = 192, .height = 108, .object_moves = true, .plain = true},
    };
    for (int i = argc > 2 ? atoi(argv[2]) : 0; i < (argc > 2 ? atoi(argv[2])+1 : 5); i++)
        for (int m = 1; m >= (argc > 3); m--) {
            temporal_session t;
            temporal_report r;
            if (!temporal_open(&t, m, argc > 1 ? argv[1] : "", NULL, NULL) ||
                !temporal_sequence(&t, &scenes[i], 16, 2, 8, &r)) {
                fprintf(stderr, "%s\n", t.err.text);
                return 1;
            }
            printf("cam %d obj %d plain %d motion %d: raw %.2f taa %.2f dB p95 %.4f disocc %ld %.4f behind %.4f  ahead "
                   "%.4f\n",
                   scenes[i].camera_moves, scenes[i].object_moves, scenes[i].plain, m, r.raw_psnr, r.psnr, r.p95, r.disoccluded,
                   r.disoccluded_difference, r.behind, r.ahead);
            fflush(stdout);
            temporal_report_free(&r);
            temporal_close(&t);
        }
    (void)argc;
    (void)argv;
    return 0;
}
