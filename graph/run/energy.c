#include "graph/run/energy.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "kernels/shared.h"

_Static_assert(sizeof(rl_energy) == RL_SUM_VALUES * sizeof(double), "rl_energy is the sums' values");

void rl_energy_read(const float *sums, size_t material, rl_energy *out)
{
    double values[RL_SUM_VALUES] = {0};
    for (size_t band = 0; band < RL_BANDS; band++) {
        const float *v = sums + 2 * (band * RL_SUM_MATERIALS + material) * RL_SUM_VALUES;
        for (size_t i = 0; i < RL_SUM_VALUES; i++)
            values[i] += (double)v[2 * i] + (double)v[2 * i + 1];
    }
    memcpy(out, values, sizeof *out);
}

void rl_energy_add(rl_energy *to, const rl_energy *what)
{
    double a[RL_SUM_VALUES], b[RL_SUM_VALUES];
    memcpy(a, to, sizeof a);
    memcpy(b, what, sizeof b);
    for (size_t i = 0; i < RL_SUM_VALUES; i++)
        a[i] += b[i];
    memcpy(to, a, sizeof a);
}

static double worst(const double difference[3], const double in[3])
{
    double most = 0;
    for (int c = 0; c < 3; c++)
        if (difference[c] != 0)
            most = fmax(most, in[c] > 0 ? fabs(difference[c]) / in[c] : INFINITY);
    return most;
}

double rl_energy_imbalance(const rl_energy *e)
{
    double d[3];
    for (int c = 0; c < 3; c++)
        d[c] = e->in[c] - e->out[c];
    return worst(d, e->in);
}

double rl_energy_open(const rl_energy *e)
{
    double d[3];
    for (int c = 0; c < 3; c++)
        d[c] = e->out[c] - (e->in[c] - e->border[c] - e->off_screen[c] - e->clamped[c] + e->redistributed[c]);
    return worst(d, e->in);
}

/* ---- the ledger of a run ---------------------------------------------------------------------------------
 */

void rl_energy_ledger_free(rl_energy_ledger *ledger)
{
    rl_free(ledger->rows);
    *ledger = (rl_energy_ledger){0};
}

static rl_code make_room(rl_energy_ledger *l, size_t more, rl_error *err)
{
    size_t room = l->room ? l->room : 64;
    while (room < l->n + more)
        room *= 2;
    if (room == l->room)
        return RL_OK;
    rl_energy_row *rows = rl_realloc(l->rows, room * sizeof *rows);
    if (!rows)
        return rl_fail_memory(err, room * sizeof *rows);
    l->rows = rows;
    l->room = room;
    return RL_OK;
}

static bool is_empty(const rl_energy *e)
{
    double values[RL_SUM_VALUES];
    memcpy(values, e, sizeof values);
    for (size_t i = 0; i < ENERGY_PIXELS; i++)
        if (values[i] != 0)
            return false;
    return true;
}

rl_code rl_energy_ledger_add(rl_energy_ledger *ledger, const rl_energy_row *row, const float *sums,
                             size_t n_materials, rl_error *err)
{
    rl_code code = make_room(ledger, n_materials + 1, err);
    if (code)
        return code;
    rl_energy_row *all = &ledger->rows[ledger->n++];
    *all = *row;
    all->material = RL_ENERGY_ALL;
    all->energy = (rl_energy){0};
    for (size_t m = 0; m < n_materials && m < RL_SUM_MATERIALS; m++) {
        rl_energy_row *one = &ledger->rows[ledger->n];
        *one = *row;
        one->material = (int)m;
        rl_energy_read(sums, m, &one->energy);
        rl_energy_add(&all->energy, &one->energy);
        if (m > 0 && !is_empty(&one->energy)) /* index 0 has no material: part of the whole alone */
            ledger->n++;
    }
    return RL_OK;
}

rl_code rl_energy_ledger_push(rl_energy_ledger *ledger, const rl_energy_row *row, rl_error *err)
{
    rl_code code = make_room(ledger, 1, err);
    if (!code)
        ledger->rows[ledger->n++] = *row;
    return code;
}

int rl_energy_image(const rl_graph *graph, size_t node)
{
    const rl_graph_node *n = &graph->nodes[node];
    for (size_t i = 0; i < n->pass->ports.n; i++)
        if (n->pass->ports.rows[i].role == RL_REDUCTION && !strcmp(n->pass->ports.rows[i].name, "energy"))
            return n->images[i];
    return -1;
}
