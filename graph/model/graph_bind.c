/* From names to indices: which image feeds which port, and what to say when there is none. */
#include <string.h>

#include "graph/model/graph_build.h"

#define CAPTURE "capture"
#define NOTHING "none" /* no image has a name without a dot */

/* ---- names -----------------------------------------------------------------------------------------------
 */

/* Candidates for rl_suggest; the arena owns the array. */
typedef struct names {
    const char **list;
    size_t n;
} names;

static rl_code fail_unknown(rl_graph_builder *b, rl_where where, const char *head, const char *name,
                            names known, const char *what)
{
    rl_str text = {0};
    rl_str_add(&text, head);
    rl_suggest(&text, name, known.list, known.n, what);
    rl_code code = text.failed ? rl_fail_memory(b->err, strlen(head))
                               : rl_fail(b->err, RL_E_CONFIG, where, "%s", rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

/* What follows "GROUP." in the names of a producer's images; node -1: the capture's layers. */
static rl_code names_of_images(rl_graph_builder *b, int node, names *out)
{
    *out = (names){rl_arena_array(b->arena, b->n_images, sizeof *out->list), 0};
    if (!out->list)
        return rl_fail_memory(b->err, b->n_images * sizeof *out->list);
    size_t skip = strlen(node < 0 ? CAPTURE : b->nodes[node].name) + 1;
    for (size_t i = 0; i < b->n_images; i++)
        if (b->images[i].node == node && b->images[i].format != RL_SUMS)
            out->list[out->n++] = b->images[i].name + skip;
    return RL_OK;
}

/* What can stand before the dot. */
static rl_code names_of_groups(rl_graph_builder *b, names *out)
{
    *out = (names){rl_arena_array(b->arena, b->n_nodes + 1, sizeof *out->list), 0};
    if (!out->list)
        return rl_fail_memory(b->err, (b->n_nodes + 1) * sizeof *out->list);
    for (size_t i = 0; i < b->n_nodes; i++)
        out->list[out->n++] = b->nodes[i].name;
    out->list[out->n++] = CAPTURE;
    return RL_OK;
}

static rl_code names_of_ports(rl_graph_builder *b, const rl_pass *pass, unsigned roles, names *out)
{
    *out = (names){rl_arena_array(b->arena, pass->ports.n, sizeof *out->list), 0};
    if (!out->list)
        return rl_fail_memory(b->err, pass->ports.n * sizeof *out->list);
    for (size_t p = 0; p < pass->ports.n; p++)
        if (roles >> pass->ports.rows[p].role & 1)
            out->list[out->n++] = pass->ports.rows[p].name;
    return RL_OK;
}

static int find_port(const rl_pass *pass, const char *name, rl_role role)
{
    for (size_t p = 0; p < pass->ports.n; p++)
        if (pass->ports.rows[p].role == role && !strcmp(pass->ports.rows[p].name, name))
            return (int)p;
    return -1;
}

/* "pass 'sss' (sss_burley)", in the arena. */
static const char *call_node(rl_graph_builder *b, const rl_graph_node *node)
{
    return rl_arena_printf(b->arena, "pass '%s' (%s)", node->name, node->pass->name);
}

/* ---- images ----------------------------------------------------------------------------------------------
 */

static int find_image(const rl_graph_builder *b, const char *name)
{
    for (size_t i = 0; i < b->n_images; i++)
        if (!strcmp(b->images[i].name, name))
            return (int)i;
    return -1;
}

enum { THE_CAPTURE = -1, NO_GROUP = -2 };

/* The node that `name` starts with: "sss" of "sss.color". */
static int find_group(const rl_graph_builder *b, const char *name, size_t length)
{
    if (length == strlen(CAPTURE) && !strncmp(name, CAPTURE, length))
        return THE_CAPTURE;
    for (size_t i = 0; i < b->n_nodes; i++)
        if (strlen(b->nodes[i].name) == length && !strncmp(b->nodes[i].name, name, length))
            return (int)i;
    return NO_GROUP;
}

static rl_code fail_image(rl_graph_builder *b, const char *name, rl_where where, const char *user)
{
    const char *dot = strchr(name, '.'), *leaf = dot ? dot + 1 : "", *head, *what = "its images";
    const size_t length = dot ? (size_t)(dot - name) : strlen(name);
    const int group = find_group(b, name, length);
    const char *prefix = rl_arena_strndup(b->arena, name, length);
    names known = {0};
    rl_code code = group == NO_GROUP ? names_of_groups(b, &known) : names_of_images(b, group, &known);
    if (code != RL_OK || !prefix)
        return code != RL_OK ? code : rl_fail_memory(b->err, length);
    if (group == NO_GROUP) {
        head = rl_arena_printf(b->arena, "%s: no image '%s': the graph has no pass '%s'", user, name, prefix);
        what = "known";
        leaf = prefix;
    } else if (!dot) {
        head = rl_arena_printf(b->arena, "%s: no image '%s': write '%s.IMAGE'", user, name, name);
    } else if (group == THE_CAPTURE) {
        head =
            rl_arena_printf(b->arena, "%s: no image '%s': the capture has no layer '%s'", user, name, leaf);
        what = "its layers";
    } else {
        head = rl_arena_printf(b->arena, "%s: no image '%s': pass '%s' (%s) does not write '%s'", user, name,
                               prefix, b->nodes[group].pass->name, leaf);
    }
    return head ? fail_unknown(b, where, head, leaf, known, what) : rl_fail_memory(b->err, strlen(name));
}

rl_code rl_graph_resolve(rl_graph_builder *b, const char *name, rl_where where, const char *user, int *out)
{
    *out = find_image(b, name);
    return *out >= 0 ? RL_OK : fail_image(b, name, where, user);
}

rl_code rl_graph_check_format(rl_graph_builder *b, const char *user, const rl_port *port, int image,
                              rl_where where)
{
    const rl_image *found = &b->images[image];
    if (found->format == port->format)
        return RL_OK;
    return rl_fail(b->err, RL_E_CONFIG, where, "%s: port '%s' takes %s, '%s' is %s", user, port->name,
                   rl_format_name(port->format), found->name, rl_format_name(found->format));
}

/* ---- ports -----------------------------------------------------------------------------------------------
 */

static rl_code fail_port(rl_graph_builder *b, const rl_graph_node *node, const char *user,
                         const rl_node_input *in)
{
    int past = find_port(node->pass, in->port, RL_HISTORY);
    if (past >= 0)
        return rl_fail(b->err, RL_E_CONFIG, in->where,
                       "%s: port '%s' is the past of port '%s' and takes no image of its own", user, in->port,
                       node->pass->ports.rows[past].of ? node->pass->ports.rows[past].of : "");
    names known;
    rl_code code = names_of_ports(b, node->pass, 1u << RL_READ, &known);
    const char *head = rl_arena_printf(b->arena, "%s has no input port '%s'", user, in->port);
    if (code != RL_OK)
        return code;
    return head ? fail_unknown(b, in->where, head, in->port, known, "known")
                : rl_fail_memory(b->err, strlen(user));
}

static rl_code bind_named(rl_graph_builder *b, size_t index, const char *user, const rl_node_input *in)
{
    const rl_graph_node *node = &b->nodes[index];
    int port = find_port(node->pass, in->port, RL_READ), image = -1;
    if (port < 0)
        return fail_port(b, node, user, in);
    if (node->images[port] >= 0)
        return rl_fail(b->err, RL_E_CONFIG, in->where, "%s: input '%s' is given twice", user, in->port);
    if (!strcmp(in->image, NOTHING) && node->pass->ports.rows[port].optional)
        return RL_OK;
    if (!strcmp(in->image, NOTHING))
        return rl_fail(b->err, RL_E_CONFIG, in->where,
                       "%s: port '%s' needs an image (%s): only optional ones can be '" NOTHING "'", user,
                       in->port, rl_format_name(node->pass->ports.rows[port].format));
    const char *asker = rl_arena_printf(b->arena, "%s: port '%s'", user, in->port);
    if (!asker)
        return rl_fail_memory(b->err, strlen(user) + strlen(in->port));
    rl_code code = rl_graph_resolve(b, in->image, in->where, asker, &image);
    if (code == RL_OK)
        code = rl_graph_check_format(b, user, &node->pass->ports.rows[port], image, in->where);
    b->bound[index][port] = image;
    return code;
}

/* Whether `in:` says that an (optional) port is to have no image. */
static bool is_left_out(const rl_node_input *inputs, size_t n, const char *port)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(inputs[i].port, port) && !strcmp(inputs[i].image, NOTHING))
            return true;
    return false;
}

/* A port that no `in:` names takes the capture's layer of its name. */
static rl_code bind_implicit(rl_graph_builder *b, size_t index, const char *user, size_t port_index)
{
    const rl_graph_node *node = &b->nodes[index];
    const rl_port *port = &node->pass->ports.rows[port_index];
    const char *layer = rl_arena_printf(b->arena, CAPTURE ".%s", port->name);
    if (!layer)
        return rl_fail_memory(b->err, strlen(port->name) + sizeof CAPTURE);
    int image = find_image(b, layer);
    if (image >= 0) {
        b->bound[index][port_index] = image;
        return rl_graph_check_format(b, user, port, image, node->where);
    }
    if (port->optional)
        return RL_OK;
    names known;
    rl_code code = names_of_images(b, -1, &known);
    const char *head = rl_arena_printf(
        b->arena,
        "%s: port '%s' needs an image (%s): `in:` does not name one and the capture has no layer '%s'", user,
        port->name, rl_format_name(port->format), port->name);
    if (code != RL_OK)
        return code;
    return head ? fail_unknown(b, node->where, head, port->name, known, "its layers")
                : rl_fail_memory(b->err, strlen(user));
}

/* The past of an own output, else of what an own input reads; absent with that input. */
static rl_code bind_history(rl_graph_builder *b, size_t index, const char *user, size_t port_index)
{
    const rl_graph_node *node = &b->nodes[index];
    const rl_port *port = &node->pass->ports.rows[port_index];
    const char *of = port->of ? port->of : "";
    int now = find_port(node->pass, of, RL_WRITE);
    if (now < 0)
        now = find_port(node->pass, of, RL_READ);
    if (now >= 0) {
        int image = b->bound[index][port_index] = node->images[now];
        return image < 0 ? RL_OK : rl_graph_check_format(b, user, port, image, node->where);
    }
    names known;
    rl_code code = names_of_ports(b, node->pass, 1u << RL_READ | 1u << RL_WRITE, &known);
    const char *head = rl_arena_printf(
        b->arena, "%s: port '%s' is the past of port '%s', which does not exist", user, port->name, of);
    if (code != RL_OK)
        return code;
    return head ? fail_unknown(b, node->where, head, of, known, "known")
                : rl_fail_memory(b->err, strlen(user));
}

rl_code rl_graph_bind(rl_graph_builder *b, size_t index, const rl_node_input *inputs, size_t n_inputs)
{
    const rl_graph_node *node = &b->nodes[index];
    const char *user = call_node(b, node);
    rl_code code = user ? RL_OK : rl_fail_memory(b->err, strlen(node->name) + 32);
    for (size_t i = 0; i < n_inputs && code == RL_OK; i++)
        code = bind_named(b, index, user, &inputs[i]);
    for (size_t p = 0; p < node->pass->ports.n && code == RL_OK; p++)
        if (node->pass->ports.rows[p].role == RL_READ && node->images[p] < 0 &&
            !is_left_out(inputs, n_inputs, node->pass->ports.rows[p].name))
            code = bind_implicit(b, index, user, p);
    for (size_t p = 0; p < node->pass->ports.n && code == RL_OK; p++)
        if (node->pass->ports.rows[p].role == RL_HISTORY)
            code = bind_history(b, index, user, p);
    return code;
}
