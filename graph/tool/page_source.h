/* The sources of relit's pages, graph/tool/page/, which are built into the program. */
#ifndef RL_TOOL_PAGE_SOURCE_H
#define RL_TOOL_PAGE_SOURCE_H

#include <stddef.h>

#include "graph/base/error.h"
#include "graph/base/text.h"

/* The text of a source, "page.css". A page without one cannot be made: it is never NULL. Static. */
const char *rl_page_source(const char *name);

/* What puts a page together. Both get `ctx`. */
typedef struct rl_page_maker {
    void (*put)(void *ctx, const char *text, size_t n);
    /* What belongs into the place of that name (n characters). */
    rl_code (*part)(void *ctx, const char *name, size_t n, rl_error *err);
    void *ctx;
} rl_page_maker;

/* The HTML source of that name, with its places, written {{name}}, filled. */
rl_code rl_page_expand(const char *html, const rl_page_maker *maker, rl_error *err);

/* Scripts one after the other; names end with NULL. */
void rl_page_put_scripts(const rl_page_maker *maker, const char *const *names);

/* JSON whose '<' are written \u003c (they can be in strings only): "</script>" and "<!--" in it cannot end or
 * change the element around it. */
void rl_page_put_json(const rl_page_maker *maker, const char *json);

/* A text between quotes in JSON that is safe inside of <script>; bytes that are no UTF-8 become U+FFFD. */
void rl_page_json_text(rl_str *out, const char *text);
/* A text in HTML, between tags or in a quoted attribute; the same about UTF-8. */
void rl_page_html_text(rl_str *out, const char *text);

#endif
