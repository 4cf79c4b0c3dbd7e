/* Memory. Everything that relit allocates itself goes through here, so that it can be counted
 * (--memory-limit, `relit plan`) and so that a test can make the Nth allocation fail. All functions are
 * thread-safe. */
#ifndef RL_BASE_ALLOC_H
#define RL_BASE_ALLOC_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Rows and buffers start at this many bytes: a cache line, a 512-bit vector, and PoCL's extended alignment.
 */
#define RL_ALIGN 128

/* NULL when memory is out. Size 0 gives a pointer that can be freed. Free with rl_free. */
void *rl_malloc(size_t bytes);
void *rl_calloc(size_t count, size_t size); /* zeroed; checks count·size for overflow */
void *rl_realloc(void *p, size_t bytes);    /* not for aligned memory */
void *rl_aligned(size_t bytes);             /* aligned to RL_ALIGN, not zeroed */
/* Aligned and zeroed, without touching pages that the system gives zeroed. It lies in *block, which is what
 * rl_free takes. */
void *rl_aligned_zeroed(size_t bytes, void **block);
char *rl_strdup(const char *text);
void rl_free(void *p); /* NULL is safe */

/* Bytes that are allocated now, and the most that ever were (since the last reset). */
size_t rl_alloc_live(void);
size_t rl_alloc_peak(void);
void rl_alloc_reset_peak(void);

/* For tests: the n-th allocation from now (1 = the next) fails, and so do all after it if `for_good`;
 * n = 0 switches this off. Returns how many were left of the n before, 0 when it has failed. */
unsigned long rl_alloc_fail_at(unsigned long n, int for_good);

#ifdef __cplusplus
}
#endif
#endif
