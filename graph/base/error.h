/* Errors as data. A function that can fail returns rl_code and fills an rl_error; only the tool layer
 * prints. The first error is kept: a later one on the same rl_error is dropped, since it is usually a
 * consequence. */
#ifndef RL_BASE_ERROR_H
#define RL_BASE_ERROR_H

#include <stdarg.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* code, what it means */
#define RL_CODES(X)                                                                                          \
    X(RL_OK, "no error")                                                                                     \
    X(RL_E_USAGE, "the command line or a call is wrong")                                                     \
    X(RL_E_CONFIG, "a pipeline or a manifest is wrong")                                                      \
    X(RL_E_IO, "a file could not be read or written")                                                        \
    X(RL_E_FORMAT, "a file does not hold what its format or the manifest promises")                          \
    X(RL_E_MEMORY, "out of memory, or over the memory limit")                                                \
    X(RL_E_DEVICE, "an OpenCL device is missing or failed")                                                  \
    X(RL_E_BUILD, "an OpenCL program does not compile")                                                      \
    X(RL_E_COLOR, "OpenColorIO refused")                                                                     \
    X(RL_E_DATA, "pixels that cannot be processed, such as a stencil id without a material")                 \
    X(RL_E_CANCELLED, "stopped on request")                                                                  \
    X(RL_E_INTERNAL, "a broken promise inside relit")

typedef enum rl_code {
#define RL_CODE_ENUM(name, text) name,
    RL_CODES(RL_CODE_ENUM)
#undef RL_CODE_ENUM
} rl_code;

/* A place in a file. `file` may be NULL (no place); line and column count from 1, 0 = not known. */
typedef struct rl_where {
    const char *file;
    int line, column;
} rl_where;

#define RL_NOWHERE ((rl_where){0})

typedef struct rl_error {
    rl_code code;
    int line, column;
    char file[512];  /* "" when there is no place; longer paths lose their head, not their tail */
    char text[1536]; /* one line, without control characters; no "error:" in front */
} rl_error;

#if defined(__GNUC__)
#define RL_PRINTF(fmt, args) __attribute__((format(printf, fmt, args)))
#else
#define RL_PRINTF(fmt, args)
#endif

/* Records an error unless `err` holds one already; `err` may be NULL. Returns the code that err then holds
 * (or `code`), so that `return rl_fail(...)` reads well. */
rl_code rl_fail(rl_error *err, rl_code code, rl_where where, const char *fmt, ...) RL_PRINTF(4, 5);
rl_code rl_vfail(rl_error *err, rl_code code, rl_where where, const char *fmt, va_list args);

/* The same for a plain file without a line. */
rl_code rl_fail_file(rl_error *err, rl_code code, const char *file, const char *fmt, ...) RL_PRINTF(4, 5);

/* Out of memory while asking for `bytes`. */
rl_code rl_fail_memory(rl_error *err, unsigned long long bytes);

/* "file:line:column: error: text", as users see it. Writes at most `size` bytes, always terminated. */
void rl_error_format(const rl_error *err, char *out, unsigned long size);

/* Control characters in place: line ends and tabs become spaces, the others '?'. */
void rl_one_line(char *text);

/* The code's meaning and its name ("RL_E_IO"). Static strings. */
const char *rl_code_text(rl_code code);
const char *rl_code_name(rl_code code);

#ifdef __cplusplus
}
#endif
#endif
