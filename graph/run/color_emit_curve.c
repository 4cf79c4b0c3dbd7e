/* RGB curves: quadratic B-splines, as straight-line vector code. */
#include <math.h>

#include "graph/run/color_emit.h"

static const char channel[3] = {'r', 'g', 'b'};

/* "Grading log": stops from 18 % grey, a line below xbrk (OpenColorIO's GradingRGBCurve, style lin). */
static const double lin_break = 0.0041318374739483946, lin_shift = -0.000157849851665374,
                    lin_gain = 363.034608563, lin_offset = -7, log_break = -5.5;

static void emit_lin_to_log(rl_color_text *t)
{
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        rl_str_printf(
            &t->body,
            "        %c = select(fma(%c, K(%s), K(%s)), rl_c_log2(max((%c + %s) * %s, TINY)), %c >= %s);\n",
            c, c, RL_LIT(lin_gain), RL_LIT(lin_offset), c, RL_LIT(lin_shift), RL_LIT(1 / (0.18 + lin_shift)),
            c, RL_LIT(lin_break));
    }
}

static void emit_log_to_lin(rl_color_text *t)
{
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        rl_str_printf(&t->body,
                      "        %c = select((%c - %s) * %s, fma(rl_c_exp2(%c), K(%s), K(%s)), %c >= %s);\n", c,
                      c, RL_LIT(lin_offset), RL_LIT(1 / lin_gain), c, RL_LIT(0.18 + lin_shift),
                      RL_LIT(-lin_shift), c, RL_LIT(log_break));
    }
}

/* The pieces meet with equal value and slope, up to float rounding. */
static bool is_smooth(const rl_op_spline *s)
{
    for (size_t i = 0; i + 2 < s->n; i++) {
        double h = (double)s->knots[i + 1] - s->knots[i];
        double value = (s->a[i] * h + s->b[i]) * h + s->c[i], slope = 2 * s->a[i] * h + s->b[i];
        if (fabs(value - s->c[i + 1]) > 2e-6 * (1 + fabs(value)) ||
            fabs(slope - s->b[i + 1]) > 2e-6 * (1 + fabs(slope)))
            return false;
    }
    return true;
}

static double end_slope(const rl_op_spline *s)
{
    size_t last = s->n - 2;
    return 2 * s->a[last] * ((double)s->knots[s->n - 1] - s->knots[last]) + s->b[last];
}

/* A smooth quadratic spline is one parabola plus a multiple d of max(x - knot, 0)² for every knot to its
 * right and of min(x - knot, 0)² for every knot to its left. With √|d| inside of the square that is three
 * operations a knot, no comparison and no table. The parabola is the middle piece's: the sums then cancel
 * least. */
static void emit_smooth_start(rl_color_text *t, const rl_op_spline *s, char c)
{
    size_t mid = (s->n - 2) / 2;
    rl_str_printf(&t->body, "        x%c = min(max(%c, %s), %s);\n", c, c, RL_LIT(s->knots[0]),
                  RL_LIT(s->knots[s->n - 1]));
    rl_str_printf(&t->body,
                  "        u%c = x%c - %s;\n        y%c = fma(fma(u%c, K(%s), K(%s)), u%c, K(%s));\n", c, c,
                  RL_LIT(s->knots[mid]), c, c, RL_LIT(s->a[mid]), RL_LIT(s->b[mid]), c, RL_LIT(s->c[mid]));
}

static void emit_smooth_knot(rl_color_text *t, const rl_op_spline *s, size_t i, char c)
{
    size_t mid = (s->n - 2) / 2;
    double change = i > mid ? (double)s->a[i] - s->a[i - 1] : (double)s->a[i - 1] - s->a[i];
    double root = sqrt(fabs(change));
    if (change != 0)
        rl_str_printf(&t->body,
                      "        u%c = %s(fma(x%c, K(%s), K(%s)), 0.0f), y%c = fma(%su%c, u%c, y%c);\n", c,
                      i > mid ? "max" : "min", c, RL_LIT(root), RL_LIT(-root * s->knots[i]), c,
                      change < 0 ? "-" : "", c, c, c);
}

static void emit_smooth_end(rl_color_text *t, const rl_op_spline *s, char c)
{
    if (s->b[0] != 0)
        rl_str_printf(&t->body, "        y%c = fma(min(%c - %s, 0.0f), K(%s), y%c);\n", c, c,
                      RL_LIT(s->knots[0]), RL_LIT(s->b[0]), c);
    if (fabs(end_slope(s)) > 1e-7)
        rl_str_printf(&t->body, "        y%c = fma(max(%c - %s, 0.0f), K(%s), y%c);\n", c, c,
                      RL_LIT(s->knots[s->n - 1]), RL_LIT(end_slope(s)), c);
    rl_str_printf(&t->body, "        %c = y%c;\n", c, c);
}

/* Knot by knot of all channels: each sum waits for itself, the three do not wait for each other. */
static void emit_smooth(rl_color_text *t, const rl_op_spline *const *s)
{
    size_t most = 0;
    for (int i = 0; i < 3; i++)
        most = s[i]->n > most ? s[i]->n : most;
    for (int i = 0; i < 3; i++)
        if (s[i]->n)
            emit_smooth_start(t, s[i], channel[i]);
    for (size_t k = 1; k + 1 < most; k++)
        for (int i = 0; i < 3; i++)
            if (k + 1 < s[i]->n)
                emit_smooth_knot(t, s[i], k, channel[i]);
    for (int i = 0; i < 3; i++)
        if (s[i]->n)
            emit_smooth_end(t, s[i], channel[i]);
}

/* For pieces that do not meet smoothly, and for the inverse: a chain of selections finds the piece. `at` are
 * the thresholds: knots, or the values at the knots. */
static void emit_piece(rl_color_text *t, const rl_op_spline *s, const float *at, char c)
{
    rl_str_printf(&t->body, "        ka = K(%s), kb = K(%s), kc = K(%s), k = K(%s);\n", RL_LIT(s->a[0]),
                  RL_LIT(s->b[0]), RL_LIT(s->c[0]), RL_LIT(s->knots[0]));
    for (size_t i = 1; i + 1 < s->n; i++)
        rl_str_printf(&t->body,
                      "        m = %c >= %s, ka = select(ka, K(%s), m), kb = select(kb, K(%s), m), "
                      "kc = select(kc, K(%s), m), k = select(k, K(%s), m);\n",
                      c, RL_LIT(at[i]), RL_LIT(s->a[i]), RL_LIT(s->b[i]), RL_LIT(s->c[i]),
                      RL_LIT(s->knots[i]));
}

static void emit_pieces(rl_color_text *t, const rl_op_spline *s, char c)
{
    double last = s->knots[s->n - 1];
    emit_piece(t, s, s->knots, c);
    rl_str_printf(&t->body, "        u = min(max(%c, %s), %s) - k, y = fma(fma(ka, u, kb), u, kc);\n", c,
                  RL_LIT(s->knots[0]), RL_LIT(last));
    rl_str_printf(&t->body, "        y = fma(min(%c - %s, 0.0f), K(%s), y);\n", c, RL_LIT(s->knots[0]),
                  RL_LIT(s->b[0]));
    rl_str_printf(&t->body, "        %c = fma(max(%c - %s, 0.0f), K(%s), y);\n", c, c, RL_LIT(last),
                  RL_LIT(end_slope(s)));
}

static void emit_inverse(rl_color_text *t, const rl_op_spline *s, char c)
{
    size_t last = s->n - 2;
    double h = (double)s->knots[s->n - 1] - s->knots[last], low = s->c[0];
    double high = (s->a[last] * h + s->b[last]) * h + s->c[last], slope = end_slope(s);
    double below = fabs(s->b[0]) < 1e-5 ? 0 : 1 / (double)s->b[0], above = fabs(slope) < 1e-5 ? 0 : 1 / slope;
    emit_piece(t, s, s->c, c);
    rl_str_printf(&t->body, "        u = kc - min(max(%c, %s), %s);\n", c, RL_LIT(low), RL_LIT(high));
    rl_str_add(&t->body, "        v = sqrt(max(kb * kb - 4.0f * ka * u, 0.0f)) + kb;\n"
                         "        y = k - 2.0f * u / max(v, 1e-30f);\n");
    rl_str_printf(&t->body, "        y = select(y, (%c - %s) * %s + %s, %c <= %s);\n", c, RL_LIT(low),
                  RL_LIT(below), RL_LIT(s->knots[0]), c, RL_LIT(low));
    rl_str_printf(&t->body, "        %c = select(y, (%c - %s) * %s + %s, %c >= %s);\n", c, c, RL_LIT(high),
                  RL_LIT(above), RL_LIT(s->knots[s->n - 1]), c, RL_LIT(high));
}

/* One spline a channel; those without knots change nothing. */
static void emit_splines(rl_color_text *t, const rl_op_spline *const *s, bool inverse)
{
    bool smooth = !inverse;
    for (int i = 0; i < 3; i++)
        smooth = smooth && (s[i]->n == 0 || is_smooth(s[i]));
    if (smooth) {
        emit_smooth(t, s);
        return;
    }
    for (int i = 0; i < 3; i++) {
        if (s[i]->n && inverse)
            emit_inverse(t, s[i], channel[i]);
        else if (s[i]->n)
            emit_pieces(t, s[i], channel[i]);
    }
}

bool rl_color_emit_curves(rl_color_text *t, const rl_op *op)
{
    const rl_op_spline *own[3], *master[3];
    for (int i = 0; i < 3; i++) {
        own[i] = &op->u.curves.spline[i];
        master[i] = &op->u.curves.spline[3];
    }
    rl_str_add(&t->body, "        floatv xr, yr, ur, xg, yg, ug, xb, yb, ub, y, u, v, k, ka, kb, kc;\n"
                         "        intv m;\n");
    if (op->u.curves.lin)
        emit_lin_to_log(t);
    emit_splines(t, op->inverse ? master : own, op->inverse);
    emit_splines(t, op->inverse ? own : master, op->inverse);
    if (op->u.curves.lin)
        emit_log_to_lin(t);
    return true;
}
