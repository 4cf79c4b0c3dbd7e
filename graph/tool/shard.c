#include "graph/tool/shard.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>

/* What lies before k frames of warm-up has at most this share in the first picture behind them. */
static double share(double least, size_t k)
{
    return pow(1 - least, (double)k + 1);
}

/* Frames of warm-up after which that is at most `bound`. */
static double needed(double least, double bound)
{
    double k = ceil(log(bound) / log(1 - least)) - 1;
    return k > 0 ? k : 0;
}

static void print_fading(const rl_fading *f, size_t k, rl_str *out)
{
    rl_str_printf(out, "  %s (%s): ", f->node, f->pass);
    if (f->least <= 0) {
        rl_str_add(out, f->least < 0 ? "the pass does not say how fast its history fades: no bound is known\n"
                                     : "with these parameters history never has to fade: no bound\n");
        return;
    }
    rl_str_printf(
        out,
        "a frame has at least the share w = %g in its result; what lies before the warm-up at most\n"
        "    (1 - w)^(K+1) = %.3g %% in the first picture, times 1 - w in each picture behind it. A colour "
        "is off\n"
        "    by at most that share of the range which it had over the frames that history holds,\n"
        "    %s.\n    K = %.0f gives 5 %%, K = %.0f gives 1 %%\n",
        f->least, 100 * share(f->least, k), f->where ? f->where : "everywhere", needed(f->least, 0.05),
        needed(f->least, 0.01));
}

void rl_shard_print(const rl_session *s, size_t capture, const rl_options *o, rl_str *out)
{
    rl_shard_part p;
    rl_fading f;
    rl_session_shard(s, capture, &p);
    rl_str_printf(out, "\nshard %d/%d of '%s': ", o->shard[0], o->shard[1],
                  rl_session_capture_name(s, capture));
    if (!p.n) {
        rl_str_add(out, "no frames\n");
        return;
    }
    rl_str_printf(out, "writes %zu of %zu frames, %lld to %lld\n", p.n, rl_session_frames(s, capture),
                  p.first, p.last);
    if (p.takes_over)
        rl_str_printf(out, "  goes on from the checkpoint after frame %lld, which shard %d/%d writes\n",
                      p.from, o->shard[0] - 1, o->shard[1]);
    if (p.preroll)
        rl_str_printf(out, "  processes the %zu frames before them for their history only\n", p.preroll);
    if (p.hands_over)
        rl_str_printf(out, "  leaves a checkpoint after frame %lld for shard %d/%d\n", p.last,
                      o->shard[0] + 1, o->shard[1]);
    if (p.exact) {
        rl_str_printf(out, "  exact: the pictures of one run over all frames, bit for bit%s\n",
                      p.history ? "" : " (the graph keeps no history)");
        return;
    }
    rl_str_printf(out, "  not exact; error of K = %zu frames of warm-up:\n", p.preroll);
    for (size_t i = 0; rl_session_fading(s, capture, i, &f); i++)
        print_fading(&f, p.preroll, out);
    if (rl_session_fading(s, capture, 1, &f))
        rl_str_add(out, "  each is about a node whose inputs are exact: errors of one that feeds another add "
                        "to its own\n");
}

static json_t *fading_json(const rl_session *s, size_t capture, const rl_shard_part *p)
{
    json_t *list = json_array();
    rl_fading f;
    for (size_t i = 0; !p->exact && rl_session_fading(s, capture, i, &f); i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:s, s:o, s:o}", "node", f.node, "pass", f.pass, "least_share",
                                        f.least >= 0 ? json_real(f.least) : json_null(), "bound",
                                        f.least > 0 ? json_real(share(f.least, p->preroll)) : json_null()));
    return list;
}

rl_code rl_shard_json(const rl_session *s, size_t capture, const rl_options *o, const char *text, rl_str *out,
                      rl_error *err)
{
    rl_shard_part p;
    json_t *root = json_loads(text, 0, NULL);
    rl_session_shard(s, capture, &p);
    json_t *shard =
        json_pack("{s:i, s:i, s:I, s:I, s:b, s:b, s:o}", "part", o->shard[0], "parts", o->shard[1], "frames",
                  (json_int_t)p.n, "preroll", (json_int_t)p.preroll, "exact", p.exact, "hands_over",
                  p.hands_over, "fading", fading_json(s, capture, &p));
    if (p.n) {
        json_object_set_new(shard, "first", json_integer(p.first));
        json_object_set_new(shard, "last", json_integer(p.last));
    }
    json_object_set_new(shard, "needs_checkpoint_after", p.takes_over ? json_integer(p.from) : json_null());
    bool good = root && shard && !json_object_set_new(root, "shard", shard);
    char *whole = good ? json_dumps(root, JSON_COMPACT) : NULL;
    if (whole)
        rl_str_add(out, whole);
    free(whole);
    json_decref(root);
    return whole ? RL_OK : rl_fail_memory(err, 1);
}
