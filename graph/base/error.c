#include "graph/base/error.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static void copy_tail(char *out, size_t size, const char *text)
{
    size_t n = strlen(text);
    const char *from = n < size ? text : text + (n - size + 1);
    memcpy(out, from, strlen(from) + 1);
}

/* Bytes that follow the first of a character; 0 for a single byte, and for what is no UTF-8 (RFC 3629). */
static size_t utf8_more(const unsigned char *c)
{
    size_t more = *c >= 0xc2 && *c < 0xe0 ? 1 : *c >= 0xe0 && *c < 0xf0 ? 2 : *c >= 0xf0 && *c < 0xf5 ? 3 : 0;
    for (size_t i = 1; i <= more; i++)
        if ((c[i] & 0xc0) != 0x80)
            return 0;
    bool overlong = (*c == 0xe0 && c[1] < 0xa0) || (*c == 0xf0 && c[1] < 0x90),
         none = (*c == 0xed && c[1] > 0x9f) || (*c == 0xf4 && c[1] > 0x8f); /* surrogates, past the end */
    return overlong || none ? 0 : more;
}

/* Names and values of users are quoted in messages: what would break the line or the terminal does not pass.
 */
void rl_one_line(char *text)
{
    for (unsigned char *c = (unsigned char *)text; *c; c++) {
        size_t more = utf8_more(c);
        if (*c == '\n' || *c == '\t')
            *c = ' ';
        else if (*c < ' ' || *c == 127 || (*c > 127 && !more))
            *c = '?';
        c += more;
    }
}

rl_code rl_vfail(rl_error *err, rl_code code, rl_where where, const char *fmt, va_list args)
{
    if (!err)
        return code;
    if (err->code != RL_OK)
        return err->code;
    err->code = code;
    err->line = where.line;
    err->column = where.column;
    copy_tail(err->file, sizeof err->file, where.file ? where.file : "");
    vsnprintf(err->text, sizeof err->text, fmt, args);
    rl_one_line(err->text);
    return code;
}

rl_code rl_fail(rl_error *err, rl_code code, rl_where where, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    rl_code result = rl_vfail(err, code, where, fmt, args);
    va_end(args);
    return result;
}

rl_code rl_fail_file(rl_error *err, rl_code code, const char *file, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    rl_code result = rl_vfail(err, code, (rl_where){.file = file}, fmt, args);
    va_end(args);
    return result;
}

rl_code rl_fail_memory(rl_error *err, unsigned long long bytes)
{
    return rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "out of memory: %llu bytes could not be allocated", bytes);
}

void rl_error_format(const rl_error *err, char *out, unsigned long size)
{
    char place[sizeof err->file + 32] = "";
    if (err->file[0] && err->line > 0)
        snprintf(place, sizeof place, "%s:%d:%d: ", err->file, err->line, err->column);
    else if (err->file[0])
        snprintf(place, sizeof place, "%s: ", err->file);
    snprintf(out, size, "%serror: %s", place, err->text);
    if (size)
        rl_one_line(out); /* a file's name may hold anything */
}

const char *rl_code_text(rl_code code)
{
    static const char *const texts[] = {
#define RL_CODE_TEXT(name, text) [name] = text,
        RL_CODES(RL_CODE_TEXT)
#undef RL_CODE_TEXT
    };
    return (unsigned)code < sizeof texts / sizeof *texts ? texts[code] : "unknown error";
}

const char *rl_code_name(rl_code code)
{
    static const char *const names[] = {
#define RL_CODE_NAME(name, text) [name] = #name,
        RL_CODES(RL_CODE_NAME)
#undef RL_CODE_NAME
    };
    return (unsigned)code < sizeof names / sizeof *names ? names[code] : "RL_E_?";
}
