#include "graph/tool/svg.h"

#include <dlfcn.h>
#include <string.h>

/* What is called of libcgraph.so.6 and libgvc.so.6 (graphviz 2.30 to 9), with the types of their headers. */
typedef struct Agraph_s graph_t;
typedef struct GVC_s gvc_t;

typedef struct graphviz {
    void *cgraph, *gvc;
    graph_t *(*agmemread)(const char *text);
    int (*agclose)(graph_t *);
    char *(*aglasterr)(void);
    int (*agseterr)(int level); /* agerrlevel_t; 2 = AGMAX: nothing is printed on stderr */
    gvc_t *(*gvContext)(void);
    int (*gvFreeContext)(gvc_t *);
    int (*gvLayout)(gvc_t *, graph_t *, const char *engine);
    int (*gvFreeLayout)(gvc_t *, graph_t *);
    int (*gvRenderData)(gvc_t *, graph_t *, const char *format, char **data, unsigned *length);
    void (*gvFreeRenderData)(char *data);
} graphviz;

static const char *missing(const char *what)
{
    const char *reason = dlerror();
    return reason ? reason : what;
}

/* ISO C has no conversion from an object pointer to a function pointer; POSIX promises that the bytes are the
 * same. */
static bool symbol(void *library, const char *name, void *function)
{
    void *address = library ? dlsym(library, name) : NULL;
    memcpy(function, &address, sizeof address);
    return address != NULL;
}

static rl_code load(graphviz *g, rl_error *err)
{
    g->cgraph = dlopen("libcgraph.so.6", RTLD_NOW | RTLD_LOCAL);
    g->gvc = g->cgraph ? dlopen("libgvc.so.6", RTLD_NOW | RTLD_LOCAL) : NULL;
    if (symbol(g->cgraph, "agmemread", &g->agmemread) && symbol(g->cgraph, "agclose", &g->agclose) &&
        symbol(g->cgraph, "aglasterr", &g->aglasterr) && symbol(g->cgraph, "agseterr", &g->agseterr) &&
        symbol(g->gvc, "gvContext", &g->gvContext) && symbol(g->gvc, "gvFreeContext", &g->gvFreeContext) &&
        symbol(g->gvc, "gvLayout", &g->gvLayout) && symbol(g->gvc, "gvFreeLayout", &g->gvFreeLayout) &&
        symbol(g->gvc, "gvRenderData", &g->gvRenderData) &&
        symbol(g->gvc, "gvFreeRenderData", &g->gvFreeRenderData))
        return RL_OK;
    return rl_fail(
        err, RL_E_IO, RL_NOWHERE,
        "drawing needs graphviz's library (Debian: libgvc6), which cannot be loaded: %s; --format dot "
        "works without it",
        missing("a function is missing"));
}

rl_code rl_svg_from_dot(const char *dot, rl_str *out, rl_error *err)
{
    graphviz g = {0};
    graph_t *graph = NULL;
    gvc_t *context = NULL;
    char *data = NULL;
    unsigned length = 0;
    bool laid_out = false;
    rl_code code = load(&g, err);
    if (code)
        goto done; /* the libraries stay loaded: their plugins do not survive dlclose */
    g.agseterr(2);
    graph = g.agmemread(dot);
    context = graph ? g.gvContext() : NULL;
    laid_out = context && g.gvLayout(context, graph, "dot") == 0;
    if (laid_out && g.gvRenderData(context, graph, "svg", &data, &length) == 0 && data) {
        rl_str_addn(out, data, length);
    } else {
        const char *reason = g.aglasterr();
        code = rl_fail(err, RL_E_FORMAT, RL_NOWHERE, "graphviz could not draw the plan: %.*s",
                       (int)strcspn(reason ? reason : "no reason given", "\n"),
                       reason ? reason : "no reason given");
    }
done:
    if (data)
        g.gvFreeRenderData(data);
    if (laid_out)
        g.gvFreeLayout(context, graph);
    if (graph)
        g.agclose(graph);
    if (context)
        g.gvFreeContext(context);
    return code;
}
