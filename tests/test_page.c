/* report.html: what is packed, which frames are held, what is left behind. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <libdeflate.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/shim_ocio.h"
#include "graph/tool/ab_page_parts.h"
#include "graph/tool/plan_page.h"
#include "tests/page_make.h"
#include "tests/tool_run.h"

static char *folder;

static const char *in_folder(const char *name)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* How many entries a folder has. */
static int entries(const char *path)
{
    int n = 0;
    DIR *dir = opendir(path);
    assert_non_null(dir);
    for (struct dirent *e = readdir(dir); e; e = readdir(dir))
        n += e->d_name[0] != '.' || strlen(e->d_name) > 2;
    closedir(dir);
    return n;
}

static page_make_options options_for(const char *name)
{
    return (page_make_options){.folder = folder, .path = in_folder(name), .failed = -1};
}

/* ---- packing ------------------------------------------------------------------------------------------- */

/* The reverse of rl_page_pack, written from its description. */
static void unpack(const rl_page_plain *p, const uint8_t *packed, size_t size, unsigned *out)
{
    size_t width = (size_t)p->width, n = width * (size_t)p->height, planes = (size_t)p->planes, got = 0;
    size_t bytes = n * planes * (size_t)p->bits / 8;
    uint8_t *raw = malloc(bytes + 1);
    struct libdeflate_decompressor *inflate = libdeflate_alloc_decompressor();
    assert_int_equal(libdeflate_deflate_decompress(inflate, packed, size, raw, bytes + 1, &got), 0);
    assert_int_equal(got, bytes);
    libdeflate_free_decompressor(inflate);
    for (size_t i = 0; i < planes; i++)
        for (size_t k = 0; k < n; k++) {
            unsigned before = k % width ? out[i * n + k - 1] : k ? out[i * n + k - width] : 0, d;
            if (p->bits == 8) {
                d = raw[i * n + k];
            } else {
                unsigned z = (unsigned)raw[i * n + k] << 8 | raw[(planes + i) * n + k];
                d = z & 1 ? 0u - (z + 1) / 2 : z / 2;
            }
            out[i * n + k] = (before + d) & (p->bits == 8 ? 0xff : 0xffff);
        }
    free(raw);
}

static void packs_and_unpacks(void **state)
{
    (void)state;
    enum { W = 37, H = 11, P = 3 };
    static uint16_t words[P * W * H];
    static uint8_t bytes[P * W * H];
    static unsigned out[P * W * H];
    uint32_t random = 7;
    for (int i = 0; i < P * W * H; i++) {
        random = random * 1664525u + 1013904223u;
        words[i] = (uint16_t)(i % 5 ? i * 40 : (int)(random >> 16)); /* smooth, and all there is */
        bytes[i] = (uint8_t)(random >> 24);
    }
    for (int bits = 8; bits <= 16; bits += 8) {
        rl_page_plain plain = {bits, P, W, H, bits == 8 ? (void *)bytes : (void *)words};
        uint8_t *packed = NULL;
        size_t size = 0;
        rl_error err = {0};
        assert_int_equal(rl_page_pack(&plain, &packed, &size, &err), RL_OK);
        assert_true(size <= rl_page_pack_bound(&plain));
        unpack(&plain, packed, size, out);
        for (int i = 0; i < P * W * H; i++)
            assert_int_equal(out[i], bits == 8 ? bytes[i] : words[i]);
        rl_free(packed);
    }
}

static void base64_is_base64(void **state)
{
    (void)state;
    static const struct {
        const char *in, *out;
    } known[] = {{"", ""},
                 {"f", "Zg=="},
                 {"fo", "Zm8="},
                 {"foo", "Zm9v"},
                 {"foob", "Zm9vYg=="},
                 {"fooba", "Zm9vYmE="},
                 {"foobar", "Zm9vYmFy"}}; /* RFC 4648 */
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        char out[16] = {0};
        rl_page_base64((const uint8_t *)known[i].in, strlen(known[i].in), out);
        assert_string_equal(out, known[i].out);
        assert_int_equal(rl_page_base64_size(strlen(known[i].in)), strlen(known[i].out));
    }
}

static void texts_are_escaped(void **state)
{
    (void)state;
    rl_str json = {0}, html = {0};
    const char *text = "</script><!--\"\\\n&'\xc3\xa9\xed\xa0\x80\xff\xf0\x9f\x98\x80";
    rl_page_json_text(&json, text);
    rl_page_html_text(&html, text);
    assert_string_equal(json.text, "\"\\u003c/script\\u003e\\u003c!--\\u0022\\u005c\\u000a\\u0026'\xc3\xa9"
                                   "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xf0\x9f\x98\x80\"");
    assert_string_equal(html.text, "&#60;/script&#62;&#60;!--&#34;\\ &#38;&#39;\xc3\xa9"
                                   "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xf0\x9f\x98\x80");
    rl_str_free(&json);
    rl_str_free(&html);
}

static void paths_are_relative(void **state)
{
    (void)state;
    static const struct {
        const char *folder, *path, *want;
    } known[] = {{"out/ab", "out/ab/post/a.exr", "post/a.exr"},
                 {"out/ab", "out/other/a.exr", "../other/a.exr"},
                 {"out/ab", "out/abc/a.exr", "../abc/a.exr"},
                 {"/x/y", "/x/y/z/a.exr", "z/a.exr"},
                 {"/x/y", "/q/a.exr", "../../q/a.exr"},
                 {".", "post/a.exr", "post/a.exr"},
                 {"out/", "out/a.exr", "a.exr"},
                 {"./out", "out/a.exr", "a.exr"},
                 {"../x", "../x/post/a.exr", "post/a.exr"},
                 {"../x", "../y/a.exr", "../y/a.exr"},
                 {"../x", "y/a.exr", "y/a.exr"},
                 {"out", "/abs/a.exr", "/abs/a.exr"},
                 {"out/ab", "a.exr", "../../a.exr"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        rl_str out = {0};
        rl_page_relative(known[i].folder, known[i].path, &out);
        assert_string_equal(rl_str_text(&out), known[i].want);
        rl_str_free(&out);
    }
}

/* ---- the display --------------------------------------------------------------------------------------- */

static rl_code identity(const void *ctx, float *r, float *g, float *b, size_t n, rl_error *err)
{
    (void)r, (void)g, (void)b, (void)n;
    return ctx ? rl_fail(err, RL_E_COLOR, RL_NOWHERE, "refused") : RL_OK;
}

static void tables_are_exact_at_entries(void **state)
{
    (void)state;
    rl_ab_page_display display = {"none", identity, NULL};
    rl_page_lut lut;
    rl_error err = {0};
    assert_int_equal(rl_page_lut_bake(&display, &lut, &err), RL_OK);
    double last = log2(1 + lut.last * 128), first = -log2(1 - lut.first * 128);
    for (int i = 0; i < lut.n; i++) {
        double t = first + (last - first) * i / (lut.n - 1);
        double x = (exp2(fabs(t)) - 1) / 128 * (t < 0 ? -1 : 1);
        float in[3] = {(float)x, 0.25f, (float)x};
        double out[3], want = fmin(x, 1.25); /* entries end there */
        rl_page_lut_apply(&lut, in, out);
        assert_true(fabs(out[0] - want) < 2e-4 && fabs(out[2] - want) < 2e-4);
        assert_true(fabs(out[1] - 0.25) < 2e-3);
    }
    rl_page_lut_free(&lut);
    rl_ab_page_display refusing = {"none", identity, &lut};
    assert_int_equal(rl_page_lut_bake(&refusing, &lut, &err), RL_E_COLOR);
    rl_page_lut_free(&lut);
}

static rl_code by_ocio(const void *ctx, float *r, float *g, float *b, size_t n, rl_error *err)
{
    return rl_ocio_apply(ctx, r, g, b, n, err);
}

/* relit's own tone curve, over 14 stops and saturated colours: what ab_page_lut.c's choice of an axis is for.
 */
static void shows_as_opencolorio_does(void **state)
{
    (void)state;
    enum { COLORS = 20000 };
    rl_error err = {0};
    rl_ocio *ocio = NULL;
    rl_ocio_transform *aces = NULL;
    const rl_ocio_request request = {.from = "lin_rec709", .display = "sRGB", .view = "ACES"};
    assert_int_equal(rl_ocio_open("configs/color/relit.ocio", &ocio, &err), RL_OK);
    assert_int_equal(rl_ocio_transform_new(ocio, &request, &aces, &err), RL_OK);
    rl_ab_page_display display = {"ACES", by_ocio, aces};
    rl_page_lut lut;
    assert_int_equal(rl_page_lut_bake(&display, &lut, &err), RL_OK);
    double mean = 0, most = 0;
    uint32_t random = 3;
    for (int i = 0; i < COLORS; i++) {
        float in[3], want[3];
        double out[3], stops = -10 + 14.0 * i / COLORS;
        for (int c = 0; c < 3; c++) {
            random = random * 1664525u + 1013904223u;
            in[c] = want[c] = (float)exp2(stops - 2 + 4 * (random >> 8) / 16777216.0);
        }
        assert_int_equal(rl_ocio_apply(aces, &want[0], &want[1], &want[2], 1, &err), RL_OK);
        rl_page_lut_apply(&lut, in, out);
        for (int c = 0; c < 3; c++) {
            double error = 255 * fabs(fmin(fmax(out[c], 0), 1) - fmin(fmax((double)want[c], 0), 1));
            mean += error / (3 * COLORS);
            most = fmax(most, error);
        }
    }
    if (mean > 0.08 || most > 4.5)
        print_error("the table is off by %.3f/255 in the mean, %.2f/255 at most\n", mean, most);
    assert_true(mean <= 0.08 && most <= 4.5);
    assert_true(lut.size < 600000); /* a page is not large because of it */
    rl_page_lut_free(&lut);
    rl_ocio_transform_free(&aces);
    rl_ocio_free(&ocio);
}

/* ---- frames -------------------------------------------------------------------------------------------- */

static int count(const char *text, const char *what)
{
    int n = 0;
    for (const char *at = strstr(text, what); at; at = strstr(at + 1, what))
        n++;
    return n;
}

static void makes(const char *spec, unsigned long long budget, rl_code want, rl_ab_page_summary *out,
                  char **text)
{
    page_make_options o = options_for("spec.html");
    rl_error err = {0};
    size_t size = 0;
    o.report_frames = spec;
    o.budget = budget;
    assert_int_equal(page_make(&o, out, &err), want);
    *text = NULL;
    if (!want)
        assert_int_equal(rl_file_read(o.path, text, &size, &err), RL_OK);
    if (!want)
        assert_int_equal(size, out->bytes);
}

static void holds_what_matters(void **state)
{
    (void)state;
    static const struct {
        const char *spec;
        size_t held;
        const char *why; /* in the page */
    } known[] = {{NULL, 3, "\"why\":[\"worst flip\"]"},    {"worst", 1, "\"worst flip\""},
                 {"first,last", 2, "\"why\":[\"first\"]"}, {"none", 0, "\"frames\""},
                 {"all", PAGE_FRAMES, "\"chosen\""},       {"102-103, 105", 3, "\"why\":[\"chosen\"]"},
                 {"first,106,worst", 3, "\"chosen\""},     {"999", 0, "\"frames\""}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        rl_ab_page_summary got;
        char *text;
        makes(known[i].spec, 0, RL_OK, &got, &text);
        assert_int_equal(got.held, known[i].held);
        assert_int_equal(got.frames, PAGE_FRAMES);
        assert_int_equal(got.left_out, 0);
        assert_non_null(strstr(text, known[i].why));
        assert_int_equal(count(text, "\"images\":["), known[i].held);
        rl_free(text);
    }
    const char *wrong[] = {"fist", "3-1", "", "first,,last", "1,x"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        rl_ab_page_summary got;
        char *text;
        makes(wrong[i], 0, RL_E_USAGE, &got, &text);
    }
}

static void count_notes(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)where;
    *(int *)ctx += severity == RL_NOTE && strstr(text, "are linked and not held");
}

/* A page without all that was asked for says so. */
static void says_what_is_left_out(void **state)
{
    (void)state;
    int notes = 0;
    const rl_log log = {count_notes, &notes};
    page_make_options o = options_for("note.html");
    rl_ab_page_summary got;
    rl_error err = {0};
    char *text;
    size_t size;
    o.log = &log;
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    assert_int_equal(notes, 0);
    o.budget = got.bytes - 2000;
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    assert_int_equal(notes, 1);
    assert_true(got.left_out > 0 && got.left_out < 3);
    assert_int_equal(rl_file_read(o.path, &text, &size, &err), RL_OK);
    assert_non_null(strstr(text, got.left_out == 1 ? "\"leftOut\":1," : "\"leftOut\":2,"));
    rl_free(text);
}

/* The least telling frames go first; what is in the page keeps to the budget. */
static void keeps_to_its_budget(void **state)
{
    (void)state;
    rl_ab_page_summary all, some, none;
    char *text;
    makes("all,first,worst", 0, RL_OK, &all, &text);
    rl_free(text);
    makes("all,first,worst", all.bytes - 1000, RL_OK, &some, &text);
    assert_true(some.held >= PAGE_FRAMES - 2 && some.held < PAGE_FRAMES && some.bytes < all.bytes);
    assert_int_equal(some.left_out, PAGE_FRAMES - some.held);
    assert_non_null(strstr(text, "\"why\":[\"worst flip\",\"chosen\"]"));
    assert_non_null(strstr(text, "\"why\":[\"first\",\"chosen\"]"));
    rl_free(text);
    unsigned long long least = all.bytes;
    for (size_t held = PAGE_FRAMES; held > 0; held = none.held) {
        least = least * 7 / 8;
        makes("all,first,worst", least, RL_OK, &none, &text);
        assert_true(none.held == 0 || none.bytes <= least);
        rl_free(text);
    }
    assert_int_equal(none.left_out, PAGE_FRAMES);
}

/* Nothing but the page is left behind; not even the page when it cannot be written. */
static void leaves_nothing_behind(void **state)
{
    (void)state;
    page_make_options o = options_for("only/report.html");
    rl_error err = {0};
    rl_ab_page_summary got;
    assert_int_equal(rl_folder_make(in_folder("only"), &err), RL_OK);
    o.folder = in_folder("only");
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    assert_int_equal(entries(in_folder("only")), 1);
    o.path = in_folder("only/missing/report.html");
    assert_int_equal(page_make(&o, &got, &err), RL_E_IO);
    assert_int_equal(entries(in_folder("only")), 1);
    o.folder = in_folder("nowhere");
    err = (rl_error){0};
    assert_int_equal(page_make(&o, &got, &err), RL_E_IO);
}

/* The n-th allocation fails: an error, or a page that is whole; never a file in between. */
static void survives_lack_of_memory(void **state)
{
    (void)state;
    page_make_options o = options_for("lack/report.html");
    rl_error err = {0};
    rl_ab_page_summary got;
    assert_int_equal(rl_folder_make(in_folder("lack"), &err), RL_OK);
    o.folder = in_folder("lack");
    o.report_frames = "first";
    size_t before = rl_alloc_live();
    for (unsigned long n = 1;; n += n < 60 ? 1 : 37) {
        err = (rl_error){0};
        rl_alloc_fail_at(n, n % 2);
        rl_code code = page_make(&o, &got, &err);
        bool reached = rl_alloc_fail_at(0, 0) == 0;
        assert_int_equal(rl_alloc_live(), before);
        assert_int_equal(entries(o.folder), code == RL_OK);
        if (code == RL_OK)
            unlink(o.path);
        else
            assert_int_equal(err.code, RL_E_MEMORY);
        if (!reached)
            break;
    }
}

static void metrics_must_be_an_object(void **state)
{
    (void)state;
    const rl_variant variant = {.name = "a"};
    const rl_ab_plan plan = {.variants = &variant, .n_variants = 1, .n_listed = 1};
    const rl_ab_page_source source = {0};
    const rl_ab_page_options options = {.folder = folder};
    rl_ab_page *page = NULL;
    rl_error err = {0};
    assert_int_equal(rl_ab_page_new(&plan, &source, &options, &page, &err), RL_OK);
    assert_int_equal(rl_ab_page_write(page, in_folder("no.html"), "[1", NULL, &err), RL_E_FORMAT);
    err = (rl_error){0};
    assert_int_equal(rl_ab_page_write(page, in_folder("no.html"), "[1]", NULL, &err), RL_E_FORMAT);
    assert_false(rl_path_exists(in_folder("no.html")));
    rl_ab_page_free(&page);
}

/* ---- relit plan ---------------------------------------------------------------------------------------- */

static void plans_show_times_of_a_trace(void **state)
{
    (void)state;
    rl_error err = {0};
    char *text;
    size_t size;
    assert_int_equal(page_make_plan(in_folder("p.html"), in_folder("t.json"), "aa", &err), RL_OK);
    assert_int_equal(rl_file_read(in_folder("p.html"), &text, &size, &err), RL_OK);
    assert_non_null(strstr(text, "{\"frames\":2,\"spans\":{\"kernel light: lighting\":{\"ms\":5},"
                                 "\"kernel aa: taa_0\":{\"ms\":1.5},\"kernel aa: taa_1\":{\"ms\":0.5}}}"));
    rl_free(text);
    static const char *const bad[] = {"", "[]", "{\"traceEvents\":[]}", "{\"traceEvents\":[{\"cat\":1}]}"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        rl_str out = {0};
        assert_int_equal(rl_file_write(in_folder("bad.json"), bad[i], strlen(bad[i]), &err), RL_OK);
        assert_int_equal(rl_plan_page("x", "{}", in_folder("bad.json"), &out, &err), RL_E_FORMAT);
        assert_string_equal(err.file, in_folder("bad.json"));
        rl_str_free(&out);
        err = (rl_error){0};
    }
}

static int make_folder(void **state)
{
    (void)state;
    folder = folder_new();
    return folder ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    folder_remove(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(packs_and_unpacks),           cmocka_unit_test(base64_is_base64),
        cmocka_unit_test(texts_are_escaped),           cmocka_unit_test(paths_are_relative),
        cmocka_unit_test(tables_are_exact_at_entries), cmocka_unit_test(holds_what_matters),
        cmocka_unit_test(says_what_is_left_out),       cmocka_unit_test(shows_as_opencolorio_does),
        cmocka_unit_test(keeps_to_its_budget),         cmocka_unit_test(leaves_nothing_behind),
        cmocka_unit_test(survives_lack_of_memory),     cmocka_unit_test(metrics_must_be_an_object),
        cmocka_unit_test(plans_show_times_of_a_trace),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
