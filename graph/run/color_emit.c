#include "graph/run/color_emit.h"

#include <math.h>
#include <string.h>

static const char channel[3] = {'r', 'g', 'b'};

/* The least float that has all its bits: what OpenColorIO brings the argument of a logarithm to. */
#define TINY "TINY"

rl_lit_text rl_lit(double value)
{
    rl_lit_text out;
    rl_format_float((float)value, out.text);
    if (!strpbrk(out.text, ".en"))
        strcat(out.text, ".0");
    strcat(out.text, "f");
    return out;
}

size_t rl_color_table_add(rl_color_text *t, const float *values, size_t n)
{
    float *both = rl_arena_array(t->arena, t->table_n + n, sizeof *both);
    size_t start = t->table_n;
    if (!both) {
        t->no_memory = true;
        return 0;
    }
    if (start)
        memcpy(both, t->table, start * sizeof *both);
    memcpy(both + start, values, n * sizeof *both);
    t->table = both;
    t->table_n = start + n;
    return start;
}

/* ---- matrix, range ----------------------------------------------------------------------------------- */

/* "fma(b, K(…), …)" for one row; a coefficient of 0 costs nothing. */
static void emit_row(rl_str *s, const double *m, double offset, int row)
{
    rl_str sum = {0};
    if (offset != 0)
        rl_str_printf(&sum, "K(%s)", RL_LIT(offset));
    for (int c = 0; c < 3; c++) {
        rl_str next = {0};
        if (m[c] == 0)
            continue;
        if (sum.length == 0 && m[c] == 1)
            rl_str_printf(&next, "%c", channel[c]);
        else if (sum.length == 0)
            rl_str_printf(&next, "%c * %s", channel[c], RL_LIT(m[c]));
        else if (m[c] == 1)
            rl_str_printf(&next, "%c + %s", channel[c], rl_str_text(&sum));
        else
            rl_str_printf(&next, "fma(%c, K(%s), %s)", channel[c], RL_LIT(m[c]), rl_str_text(&sum));
        s->failed = s->failed || sum.failed || next.failed;
        rl_str_free(&sum);
        sum = next;
    }
    rl_str_printf(s, "        floatv n%c = %s;\n", channel[row], sum.length ? rl_str_text(&sum) : "K(0.0f)");
    s->failed = s->failed || sum.failed;
    rl_str_free(&sum);
}

static bool emit_matrix(rl_color_text *t, const rl_op *op)
{
    for (int row = 0; row < 3; row++)
        emit_row(&t->body, op->u.matrix.m + 3 * row, op->u.matrix.offset[row], row);
    rl_str_add(&t->body, "        r = nr, g = ng, b = nb;\n");
    return true;
}

static bool emit_range(rl_color_text *t, const rl_op *op)
{
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        if (op->u.range.scale != 1)
            rl_str_printf(&t->body, "        %c = fma(%c, K(%s), K(%s));\n", c, c, RL_LIT(op->u.range.scale),
                          RL_LIT(op->u.range.offset));
        else if (op->u.range.offset != 0)
            rl_str_printf(&t->body, "        %c = %c + %s;\n", c, c, RL_LIT(op->u.range.offset));
        if (op->u.range.has_low)
            rl_str_printf(&t->body, "        %c = max(%c, %s);\n", c, c, RL_LIT(op->u.range.low));
        if (op->u.range.has_high)
            rl_str_printf(&t->body, "        %c = min(%c, %s);\n", c, c, RL_LIT(op->u.range.high));
    }
    return true;
}

/* ---- logarithms -------------------------------------------------------------------------------------- */

/* The line below the break, in the log's direction: value = slope·x + offset, and where it ends on both axes.
 */
typedef struct line {
    double slope, offset, lin_break, log_break;
} line;

static line log_line(const rl_op *op, int c)
{
    double base = log(op->u.log.base), at = op->u.log.lin_break[c];
    double arg = op->u.log.lin_slope[c] * at + op->u.log.lin_offset[c];
    line l = {.lin_break = at,
              .log_break = op->u.log.log_slope[c] * log(arg) / base + op->u.log.log_offset[c]};
    l.slope = op->u.log.has_line ? op->u.log.line_slope[c]
                                 : op->u.log.log_slope[c] * op->u.log.lin_slope[c] / (arg * base);
    l.offset = l.log_break - l.slope * at;
    return l;
}

static void emit_to_log(rl_color_text *t, const rl_op *op, int i)
{
    char c = channel[i];
    double slope = op->u.log.log_slope[i] / log2(op->u.log.base);
    rl_str_printf(&t->body, "        n%c = max(", c);
    if (op->u.log.lin_slope[i] == 1 && op->u.log.lin_offset[i] == 0)
        rl_str_printf(&t->body, "%c", c);
    else
        rl_str_printf(&t->body, "fma(%c, K(%s), K(%s))", c, RL_LIT(op->u.log.lin_slope[i]),
                      RL_LIT(op->u.log.lin_offset[i]));
    rl_str_printf(&t->body, ", " TINY ");\n        n%c = fma(rl_c_log2(n%c), K(%s), K(%s));\n", c, c,
                  RL_LIT(slope), RL_LIT(op->u.log.log_offset[i]));
}

static void emit_from_log(rl_color_text *t, const rl_op *op, int i)
{
    char c = channel[i];
    double scale = log2(op->u.log.base) / op->u.log.log_slope[i];
    rl_str_printf(&t->body, "        n%c = rl_c_exp2(fma(%c, K(%s), K(%s)));\n", c, c, RL_LIT(scale),
                  RL_LIT(-op->u.log.log_offset[i] * scale));
    if (op->u.log.lin_slope[i] != 1 || op->u.log.lin_offset[i] != 0)
        rl_str_printf(&t->body, "        n%c = (n%c - %s) * %s;\n", c, c, RL_LIT(op->u.log.lin_offset[i]),
                      RL_LIT(1 / op->u.log.lin_slope[i]));
}

static bool emit_log(rl_color_text *t, const rl_op *op)
{
    rl_str_add(&t->body, "        floatv nr, ng, nb;\n");
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        if (op->inverse)
            emit_from_log(t, op, i);
        else
            emit_to_log(t, op, i);
        if (!op->u.log.has_break) {
            rl_str_printf(&t->body, "        %c = n%c;\n", c, c);
            continue;
        }
        line l = log_line(op, i);
        if (op->inverse)
            rl_str_printf(&t->body, "        %c = select((%c - %s) * %s, n%c, %c > %s);\n", c, c,
                          RL_LIT(l.offset), RL_LIT(1 / l.slope), c, c, RL_LIT(l.log_break));
        else
            rl_str_printf(&t->body, "        %c = select(fma(%c, K(%s), K(%s)), n%c, %c > %s);\n", c, c,
                          RL_LIT(l.slope), RL_LIT(l.offset), c, c, RL_LIT(l.lin_break));
    }
    return true;
}

/* ---- powers ------------------------------------------------------------------------------------------ */

static bool emit_power(rl_color_text *t, const rl_op *op)
{
    rl_op_negative negative = op->u.power.negative;
    if (negative == RL_NEGATIVE_LINEAR)
        return false;
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        double gamma = op->inverse ? 1 / op->u.power.gamma[i] : op->u.power.gamma[i];
        rl_lit_text gamma_text = rl_lit(gamma);
        const char *y = gamma_text.text;
        if (gamma == 1 && negative == RL_NEGATIVE_CLAMP)
            rl_str_printf(&t->body, "        %c = max(%c, 0.0f);\n", c, c);
        else if (gamma == 1)
            continue;
        else if (negative == RL_NEGATIVE_CLAMP)
            rl_str_printf(&t->body, "        %c = rl_c_pow(%c, K(%s));\n", c, c, y);
        else if (negative == RL_NEGATIVE_MIRROR)
            rl_str_printf(&t->body, "        %c = copysign(rl_c_pow(fabs(%c), K(%s)), %c);\n", c, c, y, c);
        else
            rl_str_printf(&t->body, "        %c = select(%c, rl_c_pow(%c, K(%s)), %c > 0.0f);\n", c, c, c, y,
                          c);
    }
    return true;
}

/* A power with a line near 0 ("moncurve"), in one direction: x <= at ? slope·x : power part. The line meets
 * the power with equal value and slope, which fixes where it ends. */
typedef struct moncurve {
    double gamma, offset, scale, at, slope;
} moncurve;

/* As in OpenColorIO: gamma 1 and offset 0 are moved a little, since the line would not exist. */
#define MONCURVE_LEAST 1e-6

static moncurve moncurve_of(double gamma, double offset, bool inverse)
{
    double g = fmax(gamma, 1 + MONCURVE_LEAST), o = fmax(offset, MONCURVE_LEAST);
    double at = o / (g - 1);                             /* on the encoded axis */
    double linear = pow(o * g / ((g - 1) * (1 + o)), g); /* on the linear axis */
    moncurve m;
    if (inverse)
        m = (moncurve){.gamma = 1 / g, .offset = o, .scale = 1 + o, .at = linear, .slope = at / linear};
    else
        m = (moncurve){
            .gamma = g, .offset = o / (1 + o), .scale = 1 / (1 + o), .at = at, .slope = linear / at};
    return m;
}

static bool emit_moncurve(rl_color_text *t, const rl_op *op)
{
    rl_op_negative negative = op->u.moncurve.negative;
    if (negative != RL_NEGATIVE_LINEAR && negative != RL_NEGATIVE_MIRROR)
        return false;
    rl_str_add(&t->body, "        floatv x, p;\n");
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        moncurve m = moncurve_of(op->u.moncurve.gamma[i], op->u.moncurve.offset[i], op->inverse);
        rl_str_printf(&t->body,
                      negative == RL_NEGATIVE_MIRROR ? "        x = fabs(%c);\n" : "        x = %c;\n", c);
        if (op->inverse)
            rl_str_printf(&t->body, "        p = fma(rl_c_power(max(x, " TINY "), K(%s)), K(%s), K(%s));\n",
                          RL_LIT(m.gamma), RL_LIT(m.scale), RL_LIT(-m.offset));
        else
            rl_str_printf(&t->body, "        p = rl_c_power(max(fma(x, K(%s), K(%s)), " TINY "), K(%s));\n",
                          RL_LIT(m.scale), RL_LIT(m.offset), RL_LIT(m.gamma));
        rl_str_printf(&t->body, "        p = select(x * %s, p, x > %s);\n", RL_LIT(m.slope), RL_LIT(m.at));
        rl_str_printf(
            &t->body,
            negative == RL_NEGATIVE_MIRROR ? "        %c = copysign(p, %c);\n" : "        %c = p;\n", c, c);
    }
    return true;
}

/* ---- all of them ------------------------------------------------------------------------------------- */

bool rl_color_emit(rl_color_text *t, const rl_op *op)
{
    static bool (*const emitters[])(rl_color_text *, const rl_op *) = {
        [RL_OP_MATRIX] = emit_matrix,
        [RL_OP_RANGE] = emit_range,
        [RL_OP_LOG] = emit_log,
        [RL_OP_CURVES] = rl_color_emit_curves,
        [RL_OP_FIXED] = rl_color_emit_fixed,
        [RL_OP_POWER] = emit_power,
        [RL_OP_MONCURVE] = emit_moncurve,
        [RL_OP_CDL] = rl_color_emit_cdl,
        [RL_OP_CONTRAST] = rl_color_emit_contrast,
        [RL_OP_PRIMARY] = rl_color_emit_primary,
        [RL_OP_LUT1D] = rl_color_emit_lut1d,
        [RL_OP_LUT3D] = rl_color_emit_lut3d,
        [RL_OP_OTHER] = NULL,
    };
    if (!emitters[op->kind])
        return false;
    rl_str_printf(&t->body, "    { /* %s%s */\n", op->name, op->inverse ? ", inverse" : "");
    bool done = emitters[op->kind](t, op);
    rl_str_add(&t->body, "    }\n");
    return done;
}
