#include "tests/fuzz/fuzz.h"

#include <string.h>

/* Words that the schemas know, and values that have broken parsers before. */
static const char *const words[] = {
    "null",
    "true",
    "~",
    "[]",
    "{}",
    "[[[[",
    "{{{{",
    "!!binary",
    "&a",
    "*a",
    "<<: *a",
    "---",
    "...",
    "# ",
    "\t",
    "\r\n",
    "\"",
    "'",
    "|",
    ">",
    "? ",
    ": ",
    "- ",
    ", ",
    "\\0",
    "\\xff",
    "\xff\xfe",
    "\xef\xbb\xbf",
    "%s%n",
    "{frame}",
    "{frame:04}",
    "{frame:999999999}",
    "{capture}",
    "{variant}",
    "{",
    "}",
    "../",
    "/",
    "####",
    "%04d",
    "%n",
    "%s",
    "0",
    "-1",
    "1e308",
    "1e-308",
    "1e999",
    ".nan",
    ".inf",
    "-.inf",
    "2147483647",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "0x7fffffff",
    "1-99999999",
    "1-3x0",
    "-3--1",
    "relit",
    "include",
    "capture",
    "files",
    "frames",
    "camera",
    "matrix",
    "header",
    "fov_x",
    "jitter",
    "layers",
    "lights",
    "graph",
    "pass",
    "in",
    "outputs",
    "image",
    "file",
    "colorspace",
    "display",
    "view",
    "exposure",
    "profiles",
    "materials",
    "default",
    "stencil",
    "kernel",
    "entry",
    "ports",
    "params",
    "role",
    "read",
    "write",
    "history",
    "scratch",
    "of",
    "type",
    "rgb",
    "id",
    "vec2",
    "scalar",
    "normal",
    "layout",
    "phase4",
    "optional",
    "words",
    "range",
    "value",
    "enum",
    "float",
    "int",
    "bool",
    "memory",
    "preset",
    "blender",
    "unit",
    "kind",
    "radial",
    "device",
    "encoding",
    "octahedral",
    "depth",
    "albedo",
    "light.diffuse",
    "sss.color",
    "aa.color",
    "capture.depth",
    "capture.stencil",
    "lighting",
    "sss_burley",
    "sss_reference",
    "taa",
    "combine",
    "geometric_normal",
    "cuts",
    "remap",
};

/* splitmix64 (Steele 2014): any seed is a good one. */
static uint64_t next(uint64_t *state)
{
    uint64_t z = *state += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

static size_t below(uint64_t *state, size_t n)
{
    return n ? (size_t)(next(state) % n) : 0;
}

typedef struct input {
    uint8_t *data;
    size_t size;
} input;

/* Replaces `cut` bytes at `at` by `n` others (which may be bytes of the input itself). */
static void replace(input *in, size_t at, size_t cut, const uint8_t *put, size_t n)
{
    uint8_t copy[4096];
    if (at > in->size)
        return;
    cut = cut > in->size - at ? in->size - at : cut;
    n = n > sizeof copy ? sizeof copy : n;
    if (in->size - cut + n > FUZZ_MOST_BYTES)
        return;
    memcpy(copy, put, n);
    memmove(in->data + at + n, in->data + at + cut, in->size - at - cut);
    memcpy(in->data + at, copy, n);
    in->size = in->size - cut + n;
}

static void change_bytes(input *in, uint64_t *r)
{
    static const uint64_t values[] = {0,
                                      1,
                                      0x7f,
                                      0x80,
                                      0xff,
                                      0x7fff,
                                      0xffff,
                                      0x7fffffff,
                                      0x80000000,
                                      0xffffffff,
                                      0x7fffffffffffffff,
                                      0xffffffffffffffff};
    size_t at = below(r, in->size), width = (size_t)1 << below(r, 4);
    if (!in->size)
        return;
    switch (below(r, 4)) {
    case 0:
        in->data[at] ^= (uint8_t)(1u << below(r, 8));
        break;
    case 1:
        in->data[at] = (uint8_t)next(r);
        break;
    case 2:
        in->data[at] = (uint8_t)(in->data[at] + below(r, 35) - 17);
        break;
    default: {
        uint64_t v = values[below(r, sizeof values / sizeof *values)];
        memcpy(in->data + at, &v, width < in->size - at ? width : in->size - at);
    }
    }
}

static void move_bytes(input *in, uint64_t *r)
{
    size_t at = below(r, in->size + 1), from = below(r, in->size + 1), n = below(r, below(r, 4) ? 16 : 512);
    n = n > in->size - from ? in->size - from : n;
    switch (below(r, 4)) {
    case 0:
        replace(in, at, n, NULL == in->data ? in->data : in->data + from, 0);
        break;
    case 1:
        replace(in, at, 0, in->data + from, n);
        break;
    case 2:
        replace(in, at, n, in->data + from, n);
        break;
    default: /* cut the end off */
        in->size = below(r, 8) ? in->size : at;
    }
}

/* From one delimiter to the next: a word, or with '\n' a line. */
static size_t span(const input *in, size_t at, const char *delimiters)
{
    size_t n = 0;
    while (at + n < in->size && !strchr(delimiters, in->data[at + n] ? in->data[at + n] : ' '))
        n++;
    return n;
}

static size_t begin_of(const input *in, size_t at, const char *delimiters)
{
    while (at > 0 && !strchr(delimiters, in->data[at - 1] ? in->data[at - 1] : ' '))
        at--;
    return at;
}

static void change_words(input *in, uint64_t *r)
{
    const char *delimiters = below(r, 3) ? " \n:,[]{}\"" : "\n";
    size_t at = begin_of(in, below(r, in->size + 1), delimiters), n = span(in, at, delimiters);
    size_t other = begin_of(in, below(r, in->size + 1), delimiters), m = span(in, other, delimiters);
    const char *word = words[below(r, sizeof words / sizeof *words)];
    switch (below(r, 5)) {
    case 0:
    case 1:
        replace(in, at, n, (const uint8_t *)word, strlen(word));
        break;
    case 2:
        replace(in, at, 0, (const uint8_t *)word, strlen(word));
        break;
    case 3:
        replace(in, at, n, in->data + other, m);
        break;
    default:
        replace(in, at, n + (*delimiters == '\n'), in->data, 0);
    }
}

/* The end becomes another seed's. */
static void splice(input *in, const fuzz_bytes *seeds, size_t n_seeds, uint64_t *r)
{
    const fuzz_bytes *other = &seeds[below(r, n_seeds)];
    size_t at = below(r, in->size + 1), from = below(r, other->size + 1), n = other->size - from;
    n = at + n > FUZZ_MOST_BYTES ? FUZZ_MOST_BYTES - at : n;
    memcpy(in->data + at, other->data + from, n);
    in->size = at + n;
}

size_t fuzz_mutate(const fuzz_target *target, const fuzz_bytes *seeds, size_t n_seeds, uint64_t seed,
                   uint64_t n, uint8_t *out)
{
    uint64_t r = seed * 0x2545F4914F6CDD1Du + n;
    const fuzz_bytes *from = &seeds[below(&r, n_seeds)];
    input in = {out, from->size > FUZZ_MOST_BYTES ? FUZZ_MOST_BYTES : from->size};
    memcpy(out, from->data, in.size);
    size_t changes = below(&r, 3) ? 1 : 1 + below(&r, 12); /* one change gets deepest */
    for (size_t i = 0; i < changes; i++) {
        size_t kind = below(&r, 16);
        if (target->text && kind < 10)
            change_words(&in, &r);
        else if (kind == 15)
            splice(&in, seeds, n_seeds, &r);
        else if (kind >= 12)
            move_bytes(&in, &r);
        else
            change_bytes(&in, &r);
    }
    return in.size;
}
