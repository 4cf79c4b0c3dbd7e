#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/batch_help.h"

#include <dirent.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char pipeline[] = "relit: 1\n"
                               "materials: {default: {}}\n"
                               "graph:\n"
                               "  light: {pass: lighting}\n"
                               "  join: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                               "  aa: {pass: taa, in: {color: join.color}}\n"
                               "outputs:\n"
                               "  beauty: {image: aa.color, file: \"{capture}.{frame:04}.exr\"}\n";

static void make_loop(const batch_place *p, int frames)
{
    char source[PATH_MAX], target[64], line[64];
    size_t size;
    char *manifest = file_read("captures/monkey_turn/capture.yaml", &size);
    for (int i = 1; i <= frames; i++) {
        char name[64];
        snprintf(name, sizeof name, "captures/monkey_turn/monkey_turn.%04d.exr", (i - 1) % 12 + 1);
        assert_non_null(realpath(name, source));
        snprintf(target, sizeof target, "loop.%04d.exr", i);
        char *path = path_in(p->capture, target);
        assert_int_equal(symlink(source, path), 0);
        free(path);
    }
    snprintf(line, sizeof line, "frames: 1-%d\n", frames);
    char *named = text_replace(manifest, "monkey_turn.####.exr", "loop.####.exr");
    char *begun = text_replace(named, "frames: 1-12\n", line),
         *whole = text_replace(begun, "name: monkey_turn", "name: loop");
    file_write(p->capture, "capture.yaml", whole, strlen(whole));
    free(manifest);
    free(named);
    free(begun);
    free(whole);
}

batch_place batch_enter(int frames)
{
    batch_place p = {.folder = folder_new()};
    p.capture = path_in(p.folder, "loop");
    p.pipe = path_in(p.folder, "p.yaml");
    file_write(p.folder, "p.yaml", pipeline, strlen(pipeline));
    char *make = path_in(p.folder, "loop");
    assert_int_equal(mkdir(make, 0777), 0);
    free(make);
    make_loop(&p, frames);
    return p;
}

batch_place batch_enter_plain(int frames)
{
    batch_place p = batch_enter(frames);
    tool_result r = BATCH(&p, "plain", 0, "--quiet");
    tool_result_free(&r);
    return p;
}

void batch_leave(batch_place *p)
{
    free(p->capture);
    free(p->pipe);
    folder_remove(p->folder);
    *p = (batch_place){0};
}

static void fill(const batch_place *p, const char *out, const char *const *more, const char **words)
{
    int n = 0;
    const char *own[] = {"run", p->pipe, "--out", out};
    for (; n < 4; n++)
        words[n] = own[n];
    bool other_capture = false;
    for (int i = 0; more[i] && n < 60; i++) {
        other_capture |= !strcmp(more[i], "--capture");
        words[n++] = more[i];
    }
    if (!other_capture) {
        words[n++] = "--capture";
        words[n++] = p->capture;
    }
    words[n] = NULL;
}

tool_result batch_run(const batch_place *p, const char *out, int status, const char *const *more)
{
    const char *words[64];
    char *path = path_in(p->folder, out);
    fill(p, path, more, words);
    tool_result r = tool_run(words);
    if (r.status != status)
        print_error("status %d instead of %d\n%s%s\n", r.status, status, r.out, r.err);
    assert_int_equal(r.status, status);
    free(path);
    return r;
}

pid_t batch_start(const batch_place *p, const char *out, const char *const *more)
{
    const char *words[64] = {"relit", "--run-the-tool"};
    char *path = path_in(p->folder, out), *log = path_in(p->folder, "log");
    fill(p, path, more, words + 2);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        int fd = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666);
        dup2(fd, 1);
        dup2(fd, 2);
        execv("/proc/self/exe", (char **)(uintptr_t)words);
        _exit(127);
    }
    free(path);
    free(log);
    return pid;
}

static bool same_file(const char *a, const char *b)
{
    if (access(a, R_OK) || access(b, R_OK))
        return false;
    size_t na, nb;
    char *x = file_read(a, &na), *y = file_read(b, &nb);
    bool same = na == nb && !memcmp(x, y, na);
    free(x);
    free(y);
    return same;
}

/* Files of `a` that `b` lacks or has otherwise. */
static int one_way(const char *a, const char *b)
{
    int n = 0;
    DIR *dir = opendir(a);
    assert_non_null(dir);
    for (struct dirent *d = readdir(dir); d; d = readdir(dir)) {
        if (d->d_type == DT_DIR)
            continue;
        char *x = path_in(a, d->d_name), *y = path_in(b, d->d_name);
        n += !same_file(x, y);
        free(x);
        free(y);
    }
    closedir(dir);
    return n;
}

int batch_differences(const batch_place *p, const char *a, const char *b)
{
    char *x = path_in(p->folder, a), *y = path_in(p->folder, b);
    int there = one_way(x, y), back = one_way(y, x);
    free(x);
    free(y);
    return there > back ? there : back;
}

void batch_assert_same(const batch_place *p, const char *a, const char *b)
{
    assert_int_equal(batch_differences(p, a, b), 0);
}

int batch_notes(const batch_place *p, const char *out, const char *part)
{
    char *path = path_in(p->folder, out), *notes = path_in(path, ".relit");
    int n = 0;
    DIR *dir = opendir(notes);
    for (struct dirent *d = dir ? readdir(dir) : NULL; d; d = readdir(dir))
        n += strstr(d->d_name, part) != NULL;
    if (dir)
        closedir(dir);
    free(path);
    free(notes);
    return n;
}
