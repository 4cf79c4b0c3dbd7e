#include "graph/tool/page_source.h"

#include <string.h>

/* $(BUILD)/page.c, made by the Makefile. */
typedef struct embedded {
    const char *name;
    const unsigned char *text;
} embedded;
extern const embedded rl_embedded_page[];

const char *rl_page_source(const char *name)
{
    for (const embedded *e = rl_embedded_page; e->name; e++)
        if (!strcmp(e->name, name))
            return (const char *)e->text;
    return "";
}

rl_code rl_page_expand(const char *html, const rl_page_maker *maker, rl_error *err)
{
    rl_code code = RL_OK;
    for (const char *at = rl_page_source(html); at && !code;) {
        const char *open = strstr(at, "{{"), *close = open ? strstr(open, "}}") : NULL;
        maker->put(maker->ctx, at, close ? (size_t)(open - at) : strlen(at));
        if (!close)
            break;
        code = maker->part(maker->ctx, open + 2, (size_t)(close - open - 2), err);
        at = close + 2;
    }
    return code;
}

void rl_page_put_scripts(const rl_page_maker *maker, const char *const *names)
{
    for (; *names; names++) {
        const char *text = rl_page_source(*names);
        maker->put(maker->ctx, text, strlen(text));
    }
}

void rl_page_put_json(const rl_page_maker *maker, const char *json)
{
    for (const char *at = json; *at;) {
        size_t n = strcspn(at, "<");
        maker->put(maker->ctx, at, n);
        at += n;
        if (*at) {
            maker->put(maker->ctx, "\\u003c", 6);
            at++;
        }
    }
}

/* Bytes of the UTF-8 sequence at `s` (RFC 3629: shortest form, no surrogates, to U+10FFFF); 0: there is none.
 */
static size_t utf8_length(const unsigned char *s)
{
    size_t n = s[0] < 0x80 ? 1 : s[0] >= 0xc2 && s[0] < 0xe0 ? 2 : s[0] >= 0xe0 && s[0] < 0xf0 ? 3 : 4;
    if (n == 4 && (s[0] < 0xf0 || s[0] > 0xf4))
        return 0;
    for (size_t i = 1; i < n; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    if ((s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xed && s[1] > 0x9f) || (s[0] == 0xf0 && s[1] < 0x90) ||
        (s[0] == 0xf4 && s[1] > 0x8f))
        return 0;
    return n;
}

/* Adds the character at *text and moves on. */
static void add_character(rl_str *out, const char **text)
{
    size_t n = utf8_length((const unsigned char *)*text);
    if (n)
        rl_str_addn(out, *text, n);
    else
        rl_str_add(out, "\xef\xbf\xbd");
    *text += n ? n : 1;
}

void rl_page_json_text(rl_str *out, const char *text)
{
    rl_str_add(out, "\"");
    while (*text) {
        unsigned char c = (unsigned char)*text;
        if (c < 0x20 || c == '"' || c == '\\' || c == '<' || c == '>' || c == '&') {
            rl_str_printf(out, "\\u%04x", c);
            text++;
        } else {
            add_character(out, &text);
        }
    }
    rl_str_add(out, "\"");
}

void rl_page_html_text(rl_str *out, const char *text)
{
    while (*text) {
        unsigned char c = (unsigned char)*text;
        if (c == '<' || c == '>' || c == '&' || c == '"' || c == '\'') {
            rl_str_printf(out, "&#%d;", c);
            text++;
        } else if (c < 0x20 || c == 0x7f) {
            rl_str_add(out, " ");
            text++;
        } else {
            add_character(out, &text);
        }
    }
}
