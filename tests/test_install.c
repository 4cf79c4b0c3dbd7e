/* `make install` gives a relit that stands alone, and a program written against it works. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define BUILD_FOLDER (getenv("BUILD") ? getenv("BUILD") : "build")

static char prefix[] = "/tmp/relit-install-XXXXXX";

/* Runs a command; its standard output, without the last newline. */
static int run(const char *command, char *out, size_t size)
{
    FILE *f = popen(command, "r");
    assert_non_null(f);
    size_t n = fread(out, 1, size - 1, f);
    out[n] = 0;
    if (n && out[n - 1] == '\n')
        out[n - 1] = 0;
    return pclose(f);
}

static int install(void **state)
{
    (void)state;
    char command[1024], out[4096];
    if (!mkdtemp(prefix))
        return 1;
    snprintf(command, sizeof command, "make -s install BUILD=%s PREFIX=%s 2>&1", BUILD_FOLDER, prefix);
    int status = run(command, out, sizeof out);
    if (status)
        fprintf(stderr, "%s\n", out);
    return status;
}

static int uninstall(void **state)
{
    (void)state;
    char command[256], out[256];
    snprintf(command, sizeof command, "rm -rf %s", prefix);
    return run(command, out, sizeof out);
}

static void program_runs_from_its_prefix(void **state)
{
    (void)state;
    char command[1024], out[4096];
    snprintf(command, sizeof command,
             "cd / && %s/bin/relit check %s/share/relit/configs/vignette.yaml --capture %s/captures/monkey",
             prefix, prefix, getcwd((char[512]){0}, 512));
    assert_int_equal(run(command, out, sizeof out), 0);
    assert_non_null(strstr(out, "OK"));
}

static void library_processes_a_frame_from_memory(void **state)
{
    (void)state;
    const char *extra = strstr(BUILD_FOLDER, "asan") ? "-fsanitize=address,undefined" : "";
    char command[2048], out[4096];
    snprintf(command, sizeof command,
             "cc -std=c11 -Wall -Wextra -Werror %s tests/example.c -o %s/example "
             "$(PKG_CONFIG_PATH=%s/lib/pkgconfig pkg-config --cflags --libs relit) -Wl,-rpath,%s/lib 2>&1",
             extra, prefix, prefix, prefix);
    int status = run(command, out, sizeof out);
    if (status)
        print_message("%s\n", out);
    assert_int_equal(status, 0);
    snprintf(command, sizeof command, "cd / && %s/example 2>&1", prefix);
    assert_int_equal(run(command, out, sizeof out), 0);
    /* albedo/pi * irradiance pi, head on, Lambert: the albedo itself */
    assert_string_equal(out, "rgb 96x64 0.8000 0.5000 0.4000");
}

/* Linked into a program that stands anywhere, it finds the colour configuration of its prefix. */
static void static_library_finds_its_files(void **state)
{
    (void)state;
    const char *extra = strstr(BUILD_FOLDER, "asan") ? "-fsanitize=address,undefined" : "";
    char command[2048], out[4096];
    snprintf(command, sizeof command,
             "export PKG_CONFIG_PATH=%s/lib/pkgconfig; cc -std=c11 %s tests/example.c -o %s.example "
             "$(pkg-config --cflags relit) %s/lib/librelit.a "
             "$(pkg-config --static --libs relit | sed 's/-lrelit //') 2>&1",
             prefix, extra, prefix, prefix);
    int status = run(command, out, sizeof out);
    if (status)
        print_message("%s\n", out);
    assert_int_equal(status, 0);
    snprintf(command, sizeof command, "cd / && %s.example 2>&1; status=$?; rm %s.example; exit $status",
             prefix, prefix);
    assert_int_equal(run(command, out, sizeof out), 0);
    assert_string_equal(out, "rgb 96x64 0.8000 0.5000 0.4000");
}

/* What the headers declare is what the library shows, and nothing else. */
static void library_shows_its_headers(void **state)
{
    (void)state;
    char command[1024], out[8192];
    snprintf(
        command, sizeof command,
        "cd %s && cat include/relit/graph/relit.h include/relit/graph/base/*.h | sed '/^ \\*/d' | "
        "grep -o '\\brl_[a-z_]*(' | tr -d '(' | sort -u > declared && "
        "nm -D --defined-only lib/librelit.so | awk '{print $3}' | sort -u > shown && diff declared shown",
        prefix);
    int status = run(command, out, sizeof out);
    if (status)
        print_message("%s\n", out);
    assert_int_equal(status, 0);
    snprintf(command, sizeof command, "test -s %s/share/doc/relit/LICENSE", prefix);
    assert_int_equal(run(command, out, sizeof out), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(program_runs_from_its_prefix),
        cmocka_unit_test(library_processes_a_frame_from_memory),
        cmocka_unit_test(static_library_finds_its_files),
        cmocka_unit_test(library_shows_its_headers),
    };
    return cmocka_run_group_tests(tests, install, uninstall);
}
