/* What a capture and its pipeline lack, said once, before the first frame: passes do without, but the picture
 * may not be the one that was meant. */
#include <string.h>

#include "graph/run/session.h"

static int find_port(const rl_pass *pass, const char *name)
{
    for (size_t p = 0; p < pass->ports.n; p++)
        if (pass->ports.rows[p].role == RL_READ && !strcmp(pass->ports.rows[p].name, name))
            return (int)p;
    return -1;
}

/* Whether "a|b|c" has the word. */
static bool is_among(const char *words, const char *word, size_t length)
{
    for (; words; words = strchr(words, '|') ? strchr(words, '|') + 1 : NULL)
        if (strcspn(words, "|") == length && !strncmp(words, word, length))
            return true;
    return false;
}

/* The word that a material's profile has for a key, as `length` bytes; NULL when it has no profile, or its
 * shading switches that off. */
static const char *profile_word(const rl_materials *m, size_t material, const rl_param *row, size_t *length)
{
    double v[3], on[3];
    if (!rl_material_has_profile(m, material) || !rl_material_get(m, material, "profile", row->name, v) ||
        (rl_material_get(m, material, "shading", row->name, on) && on[0] == 0))
        return NULL;
    const char *word = row->words;
    for (int i = 0; word && i < (int)v[0]; i++)
        word = strchr(word, '|') ? strchr(word, '|') + 1 : NULL;
    *length = word ? strcspn(word, "|") : 0;
    return word;
}

/* The first material whose profile asks for what a port gives that is not there, nor the one instead of it.
 */
static void note_missed(const rl_session *s, const rl_sequence *q, const rl_graph_node *node,
                        const rl_port *port)
{
    const rl_pass *pass = node->pass;
    size_t key = strcspn(port->missed_by, ":");
    int other = port->instead ? find_port(pass, port->instead) : -1;
    if (other >= 0 && node->images[other] >= 0)
        return;
    for (size_t k = 0; k < pass->profile_keys.n; k++) {
        const rl_param *row = &pass->profile_keys.rows[k];
        if (strncmp(row->name, port->missed_by, key) || row->name[key])
            continue;
        for (size_t i = 1; i < q->materials->count; i++) {
            size_t length;
            const char *word = profile_word(q->materials, i, row, &length);
            if (!word || !is_among(port->missed_by + key + 2, word, length))
                continue;
            rl_report(
                s->log, RL_NOTE, node->where,
                "pass '%s' (%s): the profile of material '%s' has '%s: %.*s', but there is no '%s'%s%s%s: "
                "%s",
                node->name, pass->name, q->materials->names[i], row->name, (int)length, word, port->name,
                port->instead ? " and no '" : "", port->instead ? port->instead : "",
                port->instead ? "'" : "", port->if_missed);
            return;
        }
    }
}

static void note_ports(const rl_session *s, const rl_sequence *q, const rl_graph_node *node)
{
    for (size_t p = 0; p < node->pass->ports.n; p++) {
        const rl_port *port = &node->pass->ports.rows[p];
        if (node->images[p] >= 0)
            continue;
        bool left_out = rl_manifest_layer(q->manifest, port->name); /* `none`: no news */
        if (port->if_absent && !left_out)
            rl_report(s->log, RL_NOTE, node->where, "pass '%s' (%s): capture '%s' has no layer '%s': %s",
                      node->name, node->pass->name, q->manifest->name, port->name, port->if_absent);
        if (port->missed_by)
            note_missed(s, q, node, port);
    }
}

/* A black picture that nobody asked for. Lights that are written down and off are what somebody wants. */
static bool warn_dark(const rl_session *s, const rl_sequence *q, const rl_graph_node *node)
{
    if (q->n_lights || s->pipeline->lights || s->pipeline->ambient || q->manifest->lights.n)
        return false;
    for (size_t p = 0; p < node->pass->ports.n; p++)
        if (node->pass->ports.rows[p].format == RL_LIGHTS) {
            rl_report(s->log, RL_WARNING, node->where,
                      "pass '%s' (%s): there is no light: neither the pipeline nor the capture '%s' has "
                      "`lights:`",
                      node->name, node->pass->name, q->manifest->name);
            return true;
        }
    return false;
}

void rl_session_note_absent(const rl_session *s, const rl_sequence *q)
{
    bool dark = false;
    for (size_t i = 0; i < q->plan->n_nodes; i++) {
        const rl_graph_node *node = &q->graph->nodes[q->plan->nodes[i].node];
        note_ports(s, q, node);
        dark = dark || warn_dark(s, q, node);
    }
}
