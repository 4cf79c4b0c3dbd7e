#include "graph/base/alloc.h"

#include <malloc.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define HUGE_PAGE ((size_t)2 << 20)

static atomic_size_t live, peak;
static atomic_ulong countdown; /* 0 = off */
static atomic_int keep_failing;

static int must_fail(void)
{
    unsigned long n = atomic_load(&countdown);
    while (n > 0) {
        unsigned long next = n == 1 && atomic_load(&keep_failing) ? 1 : n - 1;
        if (atomic_compare_exchange_weak(&countdown, &n, next))
            return n == 1;
    }
    return 0;
}

static void *counted(void *p)
{
    if (!p)
        return NULL;
    size_t bytes = malloc_usable_size(p);
    size_t now = atomic_fetch_add(&live, bytes) + bytes;
    size_t top = atomic_load(&peak);
    while (now > top && !atomic_compare_exchange_weak(&peak, &top, now))
        ;
    return p;
}

void *rl_malloc(size_t bytes)
{
    return must_fail() ? NULL : counted(malloc(bytes ? bytes : 1));
}

void *rl_calloc(size_t count, size_t size)
{
    if (must_fail() || (size && count > SIZE_MAX / size))
        return NULL;
    return counted(calloc(count ? count : 1, size ? size : 1));
}

void *rl_realloc(void *p, size_t bytes)
{
    if (must_fail())
        return NULL;
    size_t before = p ? malloc_usable_size(p) : 0;
    void *q = realloc(p, bytes ? bytes : 1);
    if (q) {
        atomic_fetch_sub(&live, before);
        counted(q);
    }
    return q;
}

/* Images are walked by planes far apart: with pages of 4 KB each first touch is a fault, and address
 * translation misses all the time. Advice only; whether there are huge pages is the system's business. */
static void *advised(void *p, size_t bytes)
{
    size_t front = p ? (HUGE_PAGE - (uintptr_t)p % HUGE_PAGE) % HUGE_PAGE : 0;
    if (p && bytes >= front + HUGE_PAGE)
        madvise((char *)p + front, (bytes - front) / HUGE_PAGE * HUGE_PAGE, MADV_HUGEPAGE);
    return p;
}

void *rl_aligned(size_t bytes)
{
    if (must_fail() || bytes > SIZE_MAX - RL_ALIGN)
        return NULL;
    size_t whole = (bytes + RL_ALIGN - 1) / RL_ALIGN * RL_ALIGN;
    return counted(advised(aligned_alloc(RL_ALIGN, whole ? whole : RL_ALIGN), whole));
}

void *rl_aligned_zeroed(size_t bytes, void **block)
{
    *block = bytes > SIZE_MAX - RL_ALIGN ? NULL : rl_calloc(1, bytes + RL_ALIGN);
    if (!*block)
        return NULL;
    return advised((char *)*block + (RL_ALIGN - (uintptr_t)*block % RL_ALIGN) % RL_ALIGN, bytes);
}

char *rl_strdup(const char *text)
{
    size_t n = strlen(text) + 1;
    char *copy = rl_malloc(n);
    return copy ? memcpy(copy, text, n) : NULL;
}

void rl_free(void *p)
{
    if (p)
        atomic_fetch_sub(&live, malloc_usable_size(p));
    free(p);
}

size_t rl_alloc_live(void)
{
    return atomic_load(&live);
}

size_t rl_alloc_peak(void)
{
    return atomic_load(&peak);
}

void rl_alloc_reset_peak(void)
{
    atomic_store(&peak, atomic_load(&live));
}

unsigned long rl_alloc_fail_at(unsigned long n, int for_good)
{
    atomic_store(&keep_failing, for_good);
    return atomic_exchange(&countdown, n);
}
