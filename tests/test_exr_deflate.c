/* A chunk is coded to the same bytes wherever the coder's memory lies. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/run/exr_core.h"

#define WIDTH  8
#define HEIGHT 16
#define CHUNKS 20000

static unsigned random_state = 1;

static uint32_t random_word(void)
{
    uint32_t word = 0;
    for (int i = 0; i < 4; i++) {
        random_state = random_state * 1664525u + 1013904223u;
        word = word << 8 | random_state >> 24;
    }
    return word;
}

/* Ids whose bytes, behind ZIP's predictor, begin with 16 that come again 32 later and have no other like
 * them: coding the second time depends on how the first byte of all was remembered. ISA-L 2.30 remembers it
 * by 13 bits, made of bits of an address when it is not kept from it (see exr_deflate.c), and by the right
 * ones with one address in 8192. */
static void fill(uint32_t *ids)
{
    for (int i = 0; i < 2 * WIDTH; i++)
        ids[i] = random_word();
    /* Differences begin with the first byte less 128: so must they on the third row. */
    ids[2 * WIDTH - 1] = (ids[2 * WIDTH - 1] & 0xff00ffffu) | 128u << 16;
    memcpy(ids + 2 * WIDTH, ids, WIDTH * sizeof *ids);
    for (int i = 3 * WIDTH; i < HEIGHT * WIDTH; i++)
        ids[i] = ids[3 * WIDTH - 1]; /* so that the whole gets smaller */
}

static void bytes_do_not_depend_on_addresses(void **state)
{
    (void)state;
    uint32_t ids[WIDTH * HEIGHT];
    const rl_exr_source channel = {.name = "id", .type = RL_EXR_UINT, .ids = ids, .stride = WIDTH};
    const rl_exr_image image = {.data_window = {0, 0, WIDTH - 1, HEIGHT - 1},
                                .display_window = {0, 0, WIDTH - 1, HEIGHT - 1},
                                .channels = &channel,
                                .n_channels = 1,
                                .compression = RL_EXR_ZIP};
    const exr_chunk_info_t chunk = {.width = WIDTH, .height = HEIGHT, .unpacked_size = sizeof ids};
    rl_exr_deflater *one, *other;
    rl_error err = {0};
    size_t differ = 0;
    assert_int_equal(rl_exr_deflater_new(NULL, "none", &image, &channel, &one, &err), RL_OK);
    assert_int_equal(rl_exr_deflater_new(NULL, "none", &image, &channel, &other, &err), RL_OK);
    for (int i = 0; i < CHUNKS; i++) {
        const uint8_t *data[2];
        size_t size[2];
        uint64_t clamped = 0;
        fill(ids);
        assert_int_equal(rl_exr_deflate(one, &chunk, &data[0], &size[0], &clamped, &err), RL_OK);
        assert_int_equal(rl_exr_deflate(other, &chunk, &data[1], &size[1], &clamped, &err), RL_OK);
        assert_true(size[0] < sizeof ids); /* coded, not plain */
        differ += size[0] != size[1] || memcmp(data[0], data[1], size[0]) != 0;
    }
    assert_int_equal(differ, 0);
    rl_exr_deflater_free(&one);
    rl_exr_deflater_free(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(bytes_do_not_depend_on_addresses)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
