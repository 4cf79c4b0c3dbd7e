/* Drawing a graphviz text. libgvc is opened on first use: it is slow to start (its plugins bring cairo and
 * pango), and relit works without it. */
#ifndef RL_TOOL_SVG_H
#define RL_TOOL_SVG_H

#include "graph/base/error.h"
#include "graph/base/text.h"

/* Appends the drawing as SVG. RL_E_IO: graphviz is not installed; RL_E_FORMAT: it refused the text. */
rl_code rl_svg_from_dot(const char *dot, rl_str *out, rl_error *err);

#endif
