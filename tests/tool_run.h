/* Runs the tool in this process or in a child, in a folder of its own. Include cmocka.h first. */
#ifndef RL_TESTS_TOOL_RUN_H
#define RL_TESTS_TOOL_RUN_H

#include <stdbool.h>
#include <stddef.h>

/* What a call of the tool left behind; texts are freed with tool_result_free. */
typedef struct tool_result {
    int status; /* exit status; 128 + signal when a signal ended it */
    char *out, *err;
} tool_result;

/* `arguments` end with NULL and begin with the command ("run"). */
tool_result tool_run(const char *const *arguments);
/* The same in a child: this program again, started with NAME=VALUE in its environment. `tool_child` must be
 * the first thing that main does: in such a child it runs the tool and does not return. */
tool_result tool_run_child(const char *setting, const char *const *arguments);
void tool_child(int argc, char **argv);
/* Any program. */
tool_result tool_spawn(const char *program, const char *setting, const char *const *arguments);
void tool_result_free(tool_result *r);
/* relit itself, in the build folder that the tests are in; kept until the program ends. */
const char *tool_program(void);

/* A fresh folder under $TMPDIR; removed with all that is in it by folder_remove. The result is malloc'ed. */
char *folder_new(void);
void folder_remove(char *folder);
/* Regular files below a folder, without relit's own notes (.relit/); 0 when there is no such folder. */
int folder_files(const char *folder);

/* "folder/name", malloc'ed. */
char *path_in(const char *folder, const char *name);
void file_write(const char *folder, const char *name, const void *data, size_t size);
/* The whole file, malloc'ed, with a zero byte behind it. */
char *file_read(const char *path, size_t *size);
/* `text` with the first `find` replaced, malloc'ed; fails the test when it is not there. find may be NULL. */
char *text_replace(const char *text, const char *find, const char *put);

#endif
