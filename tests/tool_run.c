#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/tool_run.h"

#include <ftw.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "graph/tool/tool.h"

static const char child_word[] = "--run-the-tool";

tool_result tool_run(const char *const *arguments)
{
    char *argv[64] = {(char *)"relit"};
    int argc = 1;
    size_t out_size, err_size;
    tool_result r = {0};
    FILE *out = open_memstream(&r.out, &out_size), *err = open_memstream(&r.err, &err_size);
    assert_true(out && err);
    while (arguments[argc - 1] && argc < 63) {
        argv[argc] = (char *)(uintptr_t)arguments[argc - 1];
        argc++;
    }
    r.status = rl_tool_main(argc, argv, out, err);
    fclose(out);
    fclose(err);
    return r;
}

void tool_child(int argc, char **argv)
{
    if (argc > 1 && !strcmp(argv[1], child_word)) {
        argv[1] = argv[0];
        exit(rl_tool_main(argc - 1, argv + 1, stdout, stderr));
    }
}

static char *drain(FILE *f)
{
    char *text = calloc(1, 1 << 20);
    assert_non_null(text);
    rewind(f);
    size_t n = fread(text, 1, (1 << 20) - 1, f);
    text[n] = 0;
    fclose(f);
    return text;
}

tool_result tool_spawn(const char *program, const char *setting, const char *const *arguments)
{
    char *argv[64] = {(char *)(uintptr_t)program};
    for (int i = 0; arguments[i] && i < 62; i++)
        argv[i + 1] = (char *)(uintptr_t)arguments[i];
    FILE *out = tmpfile(), *err = tmpfile();
    tool_result r = {0};
    int status = 0;
    assert_true(out && err);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        dup2(fileno(out), 1);
        dup2(fileno(err), 2);
        if (setting)
            putenv((char *)(uintptr_t)setting);
        execv(program, argv);
        _exit(127);
    }
    assert_int_equal(waitpid(pid, &status, 0), pid);
    r.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    r.out = drain(out);
    r.err = drain(err);
    return r;
}

tool_result tool_run_child(const char *setting, const char *const *arguments)
{
    const char *words[64] = {child_word};
    for (int i = 0; arguments[i] && i < 62; i++)
        words[i + 1] = arguments[i];
    return tool_spawn("/proc/self/exe", setting, words);
}

const char *tool_program(void)
{
    static char path[PATH_MAX];
    ssize_t n = readlink("/proc/self/exe", path, sizeof path - 16);
    path[n > 0 ? n : 0] = 0;
    for (int i = 0; i < 2 && strrchr(path, '/'); i++) /* BUILD/tests/test_tool -> BUILD */
        *strrchr(path, '/') = 0;
    return strcat(path, "/relit");
}

void tool_result_free(tool_result *r)
{
    free(r->out);
    free(r->err);
    *r = (tool_result){0};
}

char *path_in(const char *folder, const char *name)
{
    size_t size = strlen(folder) + strlen(name) + 2;
    char *path = malloc(size);
    assert_non_null(path);
    snprintf(path, size, "%s/%s", folder, name);
    return path;
}

char *folder_new(void)
{
    const char *base = getenv("TMPDIR");
    char *folder = path_in(base ? base : "/tmp", "relit-test-XXXXXX");
    assert_non_null(mkdtemp(folder));
    return folder;
}

static int remove_one(const char *path, const struct stat *s, int flag, struct FTW *ftw)
{
    (void)s, (void)flag, (void)ftw;
    return remove(path);
}

void folder_remove(char *folder)
{
    nftw(folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
    free(folder);
}

static int files_seen;

static int count_one(const char *path, const struct stat *s, int flag, struct FTW *ftw)
{
    (void)s, (void)ftw;
    files_seen += flag == FTW_F && !strstr(path, "/.relit/"); /* what relit notes for --resume is no result */
    return 0;
}

int folder_files(const char *folder)
{
    files_seen = 0;
    nftw(folder, count_one, 16, FTW_PHYS);
    return files_seen;
}

void file_write(const char *folder, const char *name, const void *data, size_t size)
{
    char *path = path_in(folder, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
    free(path);
}

char *file_read(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    if (!f)
        fail_msg("'%s' cannot be opened", path);
    fseek(f, 0, SEEK_END);
    *size = (size_t)ftell(f);
    rewind(f);
    char *data = calloc(1, *size + 1);
    assert_non_null(data);
    assert_int_equal(fread(data, 1, *size, f), *size);
    fclose(f);
    return data;
}

char *text_replace(const char *text, const char *find, const char *put)
{
    const char *at = find ? strstr(text, find) : text + strlen(text);
    if (!at)
        fail_msg("'%s' is not in the text to be changed", find);
    size_t cut = find ? strlen(find) : 0, head = (size_t)(at - text);
    const char *middle = put ? put : "";
    char *result = malloc(strlen(text) + strlen(middle) + 1);
    assert_non_null(result);
    memcpy(result, text, head);
    strcpy(result + head, middle);
    strcat(result, at + cut);
    return result;
}
