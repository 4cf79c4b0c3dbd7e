/* EXR files that are broken, absurd or not there, and memory that runs out: one clear error, nothing left
 * behind. */
#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "tests/exr_make.h"

#define LIMIT ((uint64_t)64 << 20)
enum { W = 37, H = 41 };

static rl_pool *pool;
static uint16_t halves[H * W];
static float floats[H * W];
static uint32_t words[H * W];

static int open_files(void)
{
    int n = 0;
    DIR *dir = opendir("/proc/self/fd");
    while (dir && readdir(dir))
        n++;
    if (dir)
        closedir(dir);
    return n;
}

/* Opens a file and reads all channels of all parts. */
static rl_code read_all(const char *path, rl_error *err)
{
    static float pixels[4][H * W * 2];
    rl_exr *file;
    rl_code code = rl_exr_open(path, LIMIT, &file, err);
    for (int i = 0; !code && i < rl_exr_parts(file); i++) {
        const rl_exr_part *part = rl_exr_part_at(file, i);
        if ((size_t)part->width * (size_t)part->height > H * W * 2 || part->n_channels > 4)
            continue; /* a mutation that is a valid, larger picture */
        rl_exr_plane planes[4];
        for (size_t c = 0; c < part->n_channels; c++)
            planes[c] = (rl_exr_plane){
                .channel = part->channels[c].name, .floats = pixels[c], .stride = (size_t)part->width};
        code = rl_exr_read(file, i, planes, part->n_channels, NULL, pool, err);
        for (size_t a = 0; a < part->n_attrs; a++) {
            rl_str s = {0};
            rl_exr_attr_print(file, i, a, &s);
            rl_str_free(&s);
        }
    }
    rl_exr_close(&file);
    return code;
}

static void expect(const char *path, rl_code code, const char *text)
{
    rl_error err = {0};
    rl_code got = read_all(path, &err);
    if (got != code || !strstr(err.text, text) || !strstr(err.file, path))
        fail_msg("%s: %s: %s (expected %s: …%s…)", rl_code_name(got), err.file, err.text, rl_code_name(code),
                 text);
}

static void make(const char *path, rl_exr_compression compression, int tile)
{
    const made_channel channels[] = {
        {"a", RL_EXR_HALF, 0, halves}, {"b", RL_EXR_FLOAT, 0, floats}, {"c", RL_EXR_UINT, 0, words}};
    const made_part part = {NULL, -3, 5, W, H, compression, tile, false, false, channels, 3, NULL};
    if (compression < RL_EXR_DWAA) {
        made_write(path, &part, 1);
        return;
    }
    static float smooth[H * W];
    for (int i = 0; i < H * W; i++)
        smooth[i] = (float)(i % W) / W;
    const rl_exr_source sources[] = {{"R", RL_EXR_HALF, smooth, NULL, W}, {"c", RL_EXR_UINT, NULL, words, W}};
    const rl_exr_image image = {.data_window = {0, 0, W - 1, H - 1},
                                .display_window = {0, 0, W - 1, H - 1},
                                .channels = sources,
                                .n_channels = 2,
                                .compression = compression};
    rl_error err = {0};
    assert_int_equal(rl_exr_write(path, &image, pool, NULL, &err), RL_OK);
}

static void put(const char *path, const void *data, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    fclose(f);
}

static char *get(const char *path, size_t *size)
{
    char *data;
    rl_error err = {0};
    assert_int_equal(rl_file_read(path, &data, size, &err), RL_OK);
    return data;
}

static void not_files(void **state)
{
    (void)state;
    expect(made_path("missing.exr"), RL_E_IO, "No such file");
    mkdir(made_path("folder.exr"), 0777);
    expect(made_path("folder.exr"), RL_E_IO, "not a regular file");
    rmdir(made_path("folder.exr"));
    put(made_path("empty.exr"), "", 0);
    expect(made_path("empty.exr"), RL_E_FORMAT, "empty");
    put(made_path("text.exr"), "a text", 6);
    expect(made_path("text.exr"), RL_E_FORMAT, "not an OpenEXR file");
    put(made_path("magic.exr"), "\x76\x2f\x31\x01", 4);
    expect(made_path("magic.exr"), RL_E_FORMAT, "header");
}

/* Every length: nothing short of the whole file is good. */
static void truncated(void **state)
{
    (void)state;
    size_t size;
    make(made_path("whole.exr"), RL_EXR_ZIP, 0);
    char *data = get(made_path("whole.exr"), &size);
    for (size_t n = 0; n < size; n += n < 400 ? 1 : 37) {
        rl_error err = {0};
        put(made_path("cut.exr"), data, n);
        assert_int_not_equal(read_all(made_path("cut.exr"), &err), RL_OK);
        assert_true(err.text[0] && strstr(err.file, "cut.exr"));
    }
    rl_free(data);
}

/* The bytes of an attribute's value in a file. */
static char *find_value(char *data, size_t size, const char *name, const char *type)
{
    char key[64];
    int n = snprintf(key, sizeof key, "%s%c%s%c", name, 0, type, 0);
    char *at = memmem(data, size, key, (size_t)n);
    assert_non_null(at);
    return at + n + 4;
}

static void absurd_size(void **state)
{
    (void)state;
    const int32_t windows[][4] = {{0, 0, 999999, 999999},
                                  {0, 0, 1000000000, 3},
                                  {-1073741000, 0, 1073741000, 0},
                                  {5, 5, 4, 4},
                                  {INT32_MIN, INT32_MIN, INT32_MAX, INT32_MAX}};
    size_t size;
    make(made_path("whole.exr"), RL_EXR_ZIP, 0);
    char *data = get(made_path("whole.exr"), &size);
    for (size_t i = 0; i < 5; i++) {
        memcpy(find_value(data, size, "dataWindow", "box2i"), windows[i], 16);
        put(made_path("absurd.exr"), data, size);
        expect(made_path("absurd.exr"), i < 3 ? RL_E_MEMORY : RL_E_FORMAT, i < 3 ? "limit is 64" : "header");
    }
    rl_free(data);
}

static void holes_in_the_table(void **state)
{
    (void)state;
    size_t size;
    make(made_path("whole.exr"), RL_EXR_ZIP, 0);
    char *data = get(made_path("whole.exr"), &size);
    char *first = data + 8; /* behind the attributes: the table of three offsets */
    while (*first) {
        int32_t bytes;
        first += strlen(first) + 1;
        first += strlen(first) + 1;
        memcpy(&bytes, first, 4);
        first += 4 + bytes;
    }
    first++;
    memset(first + 8, 0, 8);
    put(made_path("holes.exr"), data, size);
    expect(made_path("holes.exr"), RL_E_FORMAT, "broken or incomplete");
    rl_free(data);
}

static void cannot_be_read(void **state)
{
    (void)state;
    const made_channel channels[] = {{"RY", RL_EXR_HALF, 2, halves}, {"Y", RL_EXR_HALF, 0, halves}};
    const made_part sampled = {NULL, 0, 0, 16, 16, RL_EXR_ZIP, 0, false, false, channels, 2, NULL};
    made_write(made_path("sampled.exr"), &sampled, 1);
    expect(made_path("sampled.exr"), RL_E_FORMAT, "'RY' is subsampled");
    rl_exr *file; /* the other channel can be read, with the subsampled one stepped over */
    rl_error err = {0};
    float out[16 * 16];
    assert_int_equal(rl_exr_open(made_path("sampled.exr"), 0, &file, &err), RL_OK);
    rl_exr_plane plane = {.channel = "Y", .floats = out, .stride = 16};
    assert_int_equal(rl_exr_read(file, 0, &plane, 1, NULL, pool, &err), RL_OK);
    for (int i = 0; i < 256; i++)
        assert_int_equal(made_half(out[i]), halves[i]);
    plane.channel = "Z";
    assert_int_equal(rl_exr_read(file, 0, &plane, 1, NULL, pool, &err), RL_E_FORMAT);
    assert_non_null(strstr(err.text, "no channel 'Z'"));
    rl_exr_close(&file);

    const made_part deep = {NULL, 0, 0, 16, 16, RL_EXR_ZIPS, 0, false, true, &channels[1], 1, NULL};
    made_write(made_path("deep.exr"), &deep, 1);
    expect(made_path("deep.exr"), RL_E_FORMAT, "deep");
}

/* Bytes are changed in a few thousand ways that are the same in every run: success or one error, never a
 * crash. */
static void mutations(void **state)
{
    (void)state;
    uint32_t seed = 2026;
    int done = 0, failed = 0;
    const char *rounds = getenv("RELIT_FUZZ_ROUNDS");
    for (int round = 0; round < (rounds ? atoi(rounds) : 4); round++) {
        for (int kind = 0; kind < RL_EXR_COMPRESSIONS + 2; kind++) {
            size_t size;
            rl_exr_compression c = (rl_exr_compression)(kind < RL_EXR_COMPRESSIONS ? kind
                                                        : kind % 2                 ? RL_EXR_ZIP
                                                                                   : RL_EXR_RLE);
            make(made_path("base.exr"), c, kind < RL_EXR_COMPRESSIONS ? 0 : 16);
            char *data = get(made_path("base.exr"), &size);
            char *copy = malloc(size);
            for (int i = 0; i < 60; i++) {
                memcpy(copy, data, size);
                size_t keep = made_random(&seed) % 8 ? size : made_random(&seed) % size;
                size_t reach = i % 2 && size > 500 ? 500 : size; /* every other one in the header */
                for (uint32_t k = 0; k <= made_random(&seed) % 6; k++)
                    copy[8 + made_random(&seed) % (reach - 8)] = (char)(made_random(&seed) >> 7);
                put(made_path("mutant.exr"), copy, keep);
                rl_error err = {0};
                rl_code code = read_all(made_path("mutant.exr"), &err);
                done++;
                failed += code != RL_OK;
                if (code && (!err.text[0] || err.code != code || strchr(err.text, '\n') ||
                             !strstr(err.file, "mutant.exr")))
                    fail_msg("%s: %s: %s", rl_code_name(code), err.file, err.text);
            }
            free(copy);
            rl_free(data);
        }
    }
    assert_true(done >= 500 && failed > done / 3); /* the mutations bite */
}

/* ---- writing ---- */

static rl_exr_image image_of(const rl_exr_source *sources, size_t n)
{
    return (rl_exr_image){.data_window = {0, 0, W - 1, H - 1},
                          .display_window = {0, 0, W - 1, H - 1},
                          .channels = sources,
                          .n_channels = n,
                          .compression = RL_EXR_ZIP};
}

static void bad_images(void **state)
{
    (void)state;
    const rl_exr_source twice[] = {{"R", RL_EXR_HALF, floats, NULL, W}, {"R", RL_EXR_FLOAT, floats, NULL, W}};
    const rl_exr_source wrong[] = {{"R", RL_EXR_UINT, floats, NULL, W}};
    const rl_exr_attribute attr = {"dataWindow", {RL_EXR_T_BOX2I, {0, 0, 1, 1}, NULL}};
    rl_exr_image images[6];
    for (int i = 0; i < 6; i++)
        images[i] = image_of(twice, 1);
    images[0] = image_of(twice, 2);
    images[1] = image_of(wrong, 1);
    images[2].n_channels = 0;
    images[3].data_window.x1 = -1;
    images[4].level = 13;
    images[5].attrs = &attr;
    images[5].n_attrs = 1;
    int before = made_count(), files = open_files();
    for (int i = 0; i < 6; i++) {
        rl_error err = {0};
        assert_int_equal(rl_exr_write(made_path("bad.exr"), &images[i], pool, NULL, &err), RL_E_USAGE);
        assert_true(err.text[0] && strstr(err.file, "bad.exr"));
    }
    rl_error err = {0};
    assert_int_equal(rl_exr_write(made_path("no/such/folder.exr"), &images[5], pool, NULL, &err), RL_E_IO);
    assert_int_equal(made_count(), before);
    assert_int_equal(open_files(), files);
}

/* /dev/full takes no byte: what a full disk does. */
static void full_disk(void **state)
{
    (void)state;
    const rl_exr_source source = {"R", RL_EXR_HALF, floats, NULL, W};
    const rl_exr_image image = image_of(&source, 1);
    rl_error err = {0};
    struct stat st;
    if (stat("/dev/full", &st))
        skip();
    assert_int_equal(rl_exr_write("/dev/full/x.exr", &image, pool, NULL, &err), RL_E_IO);
}

/* ---- memory ---- */

static void allocations_fail(void **state)
{
    (void)state;
    const rl_exr_source sources[] = {{"R", RL_EXR_HALF, floats, NULL, W},
                                     {"c", RL_EXR_UINT, NULL, words, W},
                                     {"d", RL_EXR_FLOAT, floats, NULL, W}};
    for (int kind = 0; kind < 2 * RL_EXR_COMPRESSIONS; kind++) {
        rl_exr_image image = image_of(sources, 3);
        image.compression = (rl_exr_compression)(kind % RL_EXR_COMPRESSIONS);
        bool reading = kind >= RL_EXR_COMPRESSIONS;
        const char *path = made_path("memory.exr");
        rl_error err = {0};
        assert_int_equal(rl_exr_write(path, &image, pool, NULL, &err), RL_OK);
        size_t live = rl_alloc_live();
        int count = made_count(), files = open_files();
        rl_code code = RL_E_MEMORY;
        for (unsigned long n = 1; code; n++) {
            err = (rl_error){0};
            rl_alloc_fail_at(n, n % 2 == 0);
            code = reading ? read_all(path, &err) : rl_exr_write(path, &image, pool, NULL, &err);
            rl_alloc_fail_at(0, 0);
            if (code && (!err.text[0] || code == RL_E_INTERNAL))
                fail_msg("allocation %lu: %s: %s", n, rl_code_name(code), err.text);
            assert_true(n < 2000);
            if (rl_alloc_live() != live)
                fail_msg("%s %s, allocation %lu: %zu bytes leaked", reading ? "reading" : "writing",
                         rl_exr_compression_name(image.compression), n, rl_alloc_live() - live);
            assert_int_equal(made_count(), count);
            assert_int_equal(open_files(), files);
        }
    }
}

static int setup(void **state)
{
    (void)state;
    uint32_t seed = 5;
    rl_error err = {0};
    for (int i = 0; i < H * W; i++) {
        halves[i] = made_half((float)(i % W) * 0.25f);
        floats[i] = (float)(i / W) + 0.1f;
        words[i] = i % 9 ? (uint32_t)(i / 50) : made_random(&seed) >> 8;
    }
    return rl_pool_new(2, &pool, &err) != RL_OK;
}

static int teardown(void **state)
{
    (void)state;
    rl_pool_free(&pool);
    made_clean();
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(not_files),        cmocka_unit_test(truncated),
        cmocka_unit_test(absurd_size),      cmocka_unit_test(holes_in_the_table),
        cmocka_unit_test(cannot_be_read),   cmocka_unit_test(mutations),
        cmocka_unit_test(bad_images),       cmocka_unit_test(full_disk),
        cmocka_unit_test(allocations_fail),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
