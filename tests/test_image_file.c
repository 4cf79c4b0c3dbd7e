/* Image files through the OpenImageIO module: round trips by the module's own reader, and errors. */
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/image_file.h"

#define WIDTH  37 /* odd, smaller than the stride */
#define HEIGHT 29
#define STRIDE 40

static char folder[] = "/tmp/relit_image_XXXXXX";
static float values[4][HEIGHT * STRIDE];

static int setup(void **state)
{
    (void)state;
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < HEIGHT * STRIDE; i++)
            values[c][i] = (float)((i * 7 + c * 131) % 1009) / 1008.0f;
    return mkdtemp(folder) ? 0 : -1;
}

static int teardown(void **state)
{
    char command[64];
    (void)state;
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static const char *in_folder(const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static rl_image_planes planes(int channels)
{
    rl_image_planes p = {.width = WIDTH, .height = HEIGHT, .channels = channels, .stride = STRIDE};
    for (int c = 0; c < channels; c++)
        p.plane[c] = values[c];
    return p;
}

static double largest_difference(const rl_image_file *file)
{
    double most = 0;
    for (int c = 0; c < file->channels; c++)
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                most = fmax(most, fabs((double)file->planes[(c * HEIGHT + y) * WIDTH + x] -
                                       values[c][y * STRIDE + x]));
    return most;
}

/* ---- round trips
 * -------------------------------------------------------------------------------------------- */

static void test_round_trips(void **state)
{
    static const struct {
        const char *name;
        rl_image_type type;
        int channels;
        double bound;
    } cases[] = {
        {"a.png", RL_IMAGE_U8, 3, 0.5 / 255 + 1e-6},
        {"b.png", RL_IMAGE_U16, 3, 0.5 / 65535 + 1e-6},
        {"c.png", RL_IMAGE_U8, 1, 0.5 / 255 + 1e-6},
        {"d.tif", RL_IMAGE_U8, 3, 0.5 / 255 + 1e-6},
        {"e.tif", RL_IMAGE_U16, 4, 0.5 / 65535 + 1e-6},
        {"f.tiff", RL_IMAGE_HALF, 3, 5e-4},
        {"g.tif", RL_IMAGE_FLOAT, 3, 0},
        {"h.bmp", RL_IMAGE_U8, 3, 0.5 / 255 + 1e-6},
        {"i.jpg", RL_IMAGE_U8, 3, 0.5},
        {"j.PNG", RL_IMAGE_U8, 3, 0.5 / 255 + 1e-6},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        rl_error err = {0};
        rl_image_planes p = planes(cases[i].channels);
        rl_image_options o = {.type = cases[i].type, .quality = 100};
        rl_image_file file;
        if (rl_image_file_write(in_folder(cases[i].name), &p, &o, NULL, NULL, &err) != RL_OK)
            fail_msg("%s: %s", cases[i].name, err.text);
        if (rl_image_file_read(in_folder(cases[i].name), &file, &err) != RL_OK)
            fail_msg("%s: %s", cases[i].name, err.text);
        assert_int_equal(file.width, WIDTH);
        assert_int_equal(file.height, HEIGHT);
        assert_int_equal(file.channels, cases[i].channels);
        assert_int_equal(file.type, cases[i].type);
        if (largest_difference(&file) > cases[i].bound)
            fail_msg("%s: off by %g", cases[i].name, largest_difference(&file));
        rl_image_file_free(&file);
    }
}

static void test_rounds_to_nearest(void **state)
{
    static const float in[] = {
        -1, -0.001f, 0, 0.49f / 255, 0.51f / 255, 0.5f, 254.49f / 255, 254.51f / 255, 1, 2, 1e30f};
    static const int want[] = {0, 0, 0, 0, 1, 128, 254, 255, 255, 255, 255};
    rl_image_planes p = {.width = 12, .height = 1, .channels = 1, .stride = 12};
    rl_image_options o = {.type = RL_IMAGE_U8};
    rl_image_counts counts = {0};
    rl_image_file file;
    float row[12];
    (void)state;
    memcpy(row, in, sizeof in);
    row[11] = nanf("");
    p.plane[0] = row;
    assert_int_equal(rl_image_file_write(in_folder("round.png"), &p, &o, NULL, &counts, NULL), RL_OK);
    assert_int_equal(counts.nan, 1);
    assert_int_equal(counts.clipped, 4);
    assert_int_equal(rl_image_file_read(in_folder("round.png"), &file, NULL), RL_OK);
    for (int i = 0; i < 11; i++)
        assert_int_equal((int)lround(file.planes[i] * 255.0), want[i]);
    assert_true(file.planes[11] == 0);
    rl_image_file_free(&file);
}

static void test_same_bytes_with_threads(void **state)
{
    rl_pool *pool = NULL;
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U16};
    char *a = NULL, *b = NULL;
    size_t na, nb;
    (void)state;
    assert_int_equal(rl_pool_new(2, &pool, NULL), RL_OK);
    assert_int_equal(rl_image_file_write(in_folder("one.png"), &p, &o, NULL, NULL, NULL), RL_OK);
    assert_int_equal(rl_image_file_write(in_folder("two.png"), &p, &o, pool, NULL, NULL), RL_OK);
    assert_int_equal(rl_file_read(in_folder("one.png"), &a, &na, NULL), RL_OK);
    assert_int_equal(rl_file_read(in_folder("two.png"), &b, &nb, NULL), RL_OK);
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    rl_free(a);
    rl_free(b);
    rl_pool_free(&pool);
}

static void test_metadata(void **state)
{
    static const rl_image_note notes[] = {{"Software", "relit 1"}, {"ImageDescription", "skin.yaml 0123"}};
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8, .colorspace = "sRGB / ACES", .notes = notes, .notes_n = 2};
    static const char *const names[] = {"meta.png", "meta.tif", "meta.jpg"};
    char text[64];
    rl_image_file file;
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        assert_int_equal(rl_image_file_write(in_folder(names[i]), &p, &o, NULL, NULL, NULL), RL_OK);
        assert_int_equal(rl_image_file_note(in_folder(names[i]), "Software", text, sizeof text, NULL), RL_OK);
        assert_string_equal(text, "relit 1");
        assert_int_equal(rl_image_file_note(in_folder(names[i]), "ImageDescription", text, sizeof text, NULL),
                         RL_OK);
        assert_string_equal(text, "skin.yaml 0123");
        assert_int_equal(rl_image_file_note(in_folder(names[i]), "Nothing", text, sizeof text, NULL), RL_OK);
        assert_string_equal(text, "");
        assert_int_equal(rl_image_file_note(in_folder(names[i]), "DateTime", text, sizeof text, NULL), RL_OK);
        assert_null(strpbrk(text, "0123456789")); /* the same image is the same file, today and tomorrow */
        assert_int_equal(rl_image_file_read(in_folder(names[i]), &file, NULL), RL_OK);
        assert_string_equal(file.colorspace, "sRGB");
        rl_image_file_free(&file);
    }
}

/* TIFF and JPEG know no names of ours. */
static void test_provenance(void **state)
{
    static const rl_image_note notes[] = {{"Software", "relit 1"}, {"relit:pipeline", "skin 0123"}};
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8, .colorspace = "sRGB / ACES", .notes = notes, .notes_n = 2};
    static const char *const names[] = {"made.tif", "made.jpg"};
    char text[128];
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(rl_image_file_write(in_folder(names[i]), &p, &o, NULL, NULL, NULL), RL_OK);
        assert_int_equal(rl_image_file_note(in_folder(names[i]), "ImageDescription", text, sizeof text, NULL),
                         RL_OK);
        assert_string_equal(text, "relit:pipeline = skin 0123; relit:colorspace = sRGB / ACES");
    }
}

static void test_png_text(void **state)
{
    static const rl_image_note notes[] = {{"relit:pipeline", "skin 0123"}};
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8, .colorspace = "Rec.709 / ACES", .notes = notes, .notes_n = 1};
    static const char *const names[] = {"relit:pipeline", "relit:colorspace", "jpeg:subsampling", "DateTime"};
    static const char *const want[] = {"skin 0123", "Rec.709 / ACES", "", ""};
    char text[64];
    (void)state;
    assert_int_equal(rl_image_file_write(in_folder("text2.png"), &p, &o, NULL, NULL, NULL), RL_OK);
    for (size_t i = 0; i < 4; i++) {
        assert_int_equal(rl_image_file_note(in_folder("text2.png"), names[i], text, sizeof text, NULL),
                         RL_OK);
        assert_string_equal(text, want[i]);
    }
}

static void test_windows(void **state)
{
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U16, .x = 5, .y = 3, .display = {0, 0, 64, 48}};
    rl_image_file file;
    (void)state;
    assert_int_equal(rl_image_file_write(in_folder("window.tif"), &p, &o, NULL, NULL, NULL), RL_OK);
    assert_int_equal(rl_image_file_read(in_folder("window.tif"), &file, NULL), RL_OK);
    assert_int_equal(file.x, 5);
    assert_int_equal(file.y, 3);
    assert_int_equal(file.display[2], 64);
    assert_int_equal(file.display[3], 48);
    rl_image_file_free(&file);
}

/* ---- errors
 * ------------------------------------------------------------------------------------------------- */

static void test_unknown_extension(void **state)
{
    static const rl_where where = {"p.yaml", 9, 4};
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8};
    rl_error err = {0};
    (void)state;
    assert_int_equal(rl_image_file_check("out.pgn", where, &err), RL_E_USAGE);
    assert_non_null(strstr(err.text, "'.pgn'"));
    assert_non_null(strstr(err.text, "png"));
    assert_int_equal(err.line, 9);
    assert_int_equal(rl_image_file_check("out", where, NULL), RL_E_USAGE);
    assert_int_equal(rl_image_file_check("out.webp", where, NULL), RL_OK);
    assert_int_equal(rl_image_file_write(in_folder("a.xyz"), &p, &o, NULL, NULL, NULL), RL_E_USAGE);
    assert_false(rl_path_exists(in_folder("a.xyz")));
}

static int files_in_folder(void)
{
    char command[128];
    int n = -1;
    snprintf(command, sizeof command, "ls -A %s | wc -l", folder);
    FILE *f = popen(command, "r");
    assert_non_null(f);
    assert_int_equal(fscanf(f, "%d", &n), 1);
    pclose(f);
    return n;
}

static void test_unwritable(void **state)
{
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8};
    rl_error err = {0};
    int before = files_in_folder();
    (void)state;
    assert_int_equal(rl_image_file_write(in_folder("no/such/a.png"), &p, &o, NULL, NULL, &err), RL_E_IO);
    assert_string_equal(err.file, in_folder("no/such/a.png"));
    assert_null(strstr(err.text, ".tmp"));
    /* A folder in the way: the image is written and cannot be renamed. */
    assert_int_equal(mkdir(in_folder("folder.png"), 0777), 0);
    assert_int_equal(rl_image_file_write(in_folder("folder.png"), &p, &o, NULL, NULL, NULL), RL_E_IO);
    p.width = 0;
    assert_int_equal(rl_image_file_write(in_folder("c.png"), &p, &o, NULL, NULL, NULL), RL_E_USAGE);
    assert_int_equal(rmdir(in_folder("folder.png")), 0);
    assert_int_equal(files_in_folder(), before);
}

/* A file that cannot grow is an error for every format, wherever it stops, and leaves nothing; JPEG's library
 * would end the process. Not TIFF, which is made in memory, where the limit holds, too, but the disk does
 * not. */
static void test_full(void **state)
{
    static const char *const names[] = {"f.png", "f.jpg", "f.bmp", "f.tga", "f.dpx", "f.webp"};
    rl_image_planes p = planes(3);
    struct rlimit limit;
    (void)state;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        rl_image_options o = {.type = RL_IMAGE_U8};
        struct stat st;
        assert_int_equal(rl_image_file_write(in_folder(names[i]), &p, &o, NULL, NULL, NULL), RL_OK);
        assert_int_equal(stat(in_folder(names[i]), &st), 0);
        assert_int_equal(unlink(in_folder(names[i])), 0);
        int before = files_in_folder();
        for (rlim_t part = 0; part < 4; part++) {
            struct rlimit small = limit;
            rl_error err = {0};
            small.rlim_cur = part < 3 ? (rlim_t)st.st_size * part / 3 : (rlim_t)st.st_size - 1;
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
            rl_code code = rl_image_file_write(in_folder(names[i]), &p, &o, NULL, NULL, &err);
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
            if (code != RL_E_IO)
                print_error("%s up to byte %d of %d: %d\n", names[i], (int)small.rlim_cur, (int)st.st_size,
                            code);
            assert_int_equal(code, RL_E_IO);
            assert_non_null(strstr(err.text, "cannot be written"));
            assert_int_equal(files_in_folder(), before);
        }
    }
}

static void test_unreadable(void **state)
{
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U16};
    rl_image_file file;
    rl_error err = {0};
    char *data = NULL;
    size_t size;
    (void)state;
    assert_int_equal(rl_image_file_read(in_folder("none.png"), &file, &err), RL_E_IO);
    assert_non_null(strstr(err.text, "No such file"));
    assert_int_equal(rl_file_write(in_folder("text.png"), "not a picture", 13, NULL), RL_OK);
    assert_int_equal(rl_image_file_read(in_folder("text.png"), &file, NULL), RL_E_FORMAT);
    assert_int_equal(rl_file_write(in_folder("empty.tif"), "", 0, NULL), RL_OK);
    assert_int_equal(rl_image_file_read(in_folder("empty.tif"), &file, NULL), RL_E_FORMAT);
    assert_int_equal(rl_image_file_write(in_folder("whole.png"), &p, &o, NULL, NULL, NULL), RL_OK);
    assert_int_equal(rl_file_read(in_folder("whole.png"), &data, &size, NULL), RL_OK);
    assert_int_equal(rl_file_write(in_folder("half.png"), data, size / 2, NULL), RL_OK);
    assert_int_equal(rl_image_file_read(in_folder("half.png"), &file, NULL), RL_E_FORMAT);
    assert_null(file.planes);
    rl_free(data);
}

static void test_out_of_memory(void **state)
{
    rl_image_planes p = planes(3);
    rl_image_options o = {.type = RL_IMAGE_U8};
    (void)state;
    for (unsigned long n = 1; n <= 3; n++) {
        rl_error err = {0};
        rl_alloc_fail_at(n, 1);
        rl_code code = rl_image_file_write(in_folder("memory.png"), &p, &o, NULL, NULL, &err);
        rl_alloc_fail_at(0, 0);
        assert_int_equal(code, RL_E_MEMORY);
        assert_false(rl_path_exists(in_folder("memory.png")));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trips),
        cmocka_unit_test(test_rounds_to_nearest),
        cmocka_unit_test(test_same_bytes_with_threads),
        cmocka_unit_test(test_metadata),
        cmocka_unit_test(test_provenance),
        cmocka_unit_test(test_png_text),
        cmocka_unit_test(test_windows),
        cmocka_unit_test(test_unknown_extension),
        cmocka_unit_test(test_unwritable),
        cmocka_unit_test(test_full),
        cmocka_unit_test(test_unreadable),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests_name("image_file", tests, setup, teardown);
}
