/* ACES' and others' fixed functions, and tables. */
#include <math.h>

#include "graph/run/color_emit.h"

/* 4 over the window of hues in radians (120 and 135 degrees), how far red moves, glow's gain and middle: the
 * constants of ACES 0.3 and 1.0. */
#define RED_03  "1.90985932f", "0.15f"
#define RED_10  "1.69765273f", "0.18f"
#define GLOW_03 "0.075f", "0.1f"
#define GLOW_10 "0.05f", "0.08f"

static bool emit_glow(rl_color_text *t, const char *gain, const char *mid, bool inverse)
{
    rl_str_printf(&t->body,
                  "        floatv glow = 1.0f + rl_c_glow(r, g, b, %s, %s, %d);\n"
                  "        r *= glow, g *= glow, b *= glow;\n",
                  gain, mid, inverse);
    return true;
}

static bool emit_red_10(rl_color_text *t, const char *scale, const char *strength, bool inverse)
{
    rl_str_printf(&t->body, "        r = rl_c_red_mod%s(r, g, b, %s, %s);\n", inverse ? "_inverse" : "",
                  scale, strength);
    return true;
}

static bool emit_red_03(rl_color_text *t, const char *scale, const char *strength, bool inverse)
{
    rl_str_printf(&t->body,
                  "        floatv to = rl_c_red_mod%s(r, g, b, %s, %s);\n"
                  "        intv in = rl_c_hue_weight(r, g, b, %s) > 0.0f;\n"
                  "        floatv ng = select(g, rl_c_keep_hue(g, b, r, to), in & (g >= b));\n"
                  "        b = select(b, rl_c_keep_hue(b, g, r, to), in & (g < b));\n"
                  "        r = to, g = ng;\n",
                  inverse ? "_inverse" : "", scale, strength, scale);
    return true;
}

static bool emit_surround(rl_color_text *t, const char *red, const char *green, const char *blue,
                          double least, double gamma)
{
    rl_str_printf(&t->body,
                  "        floatv s = rl_c_surround(fma(r, K(%s), fma(g, K(%s), b * %s)), %s, %s);\n"
                  "        r *= s, g *= s, b *= s;\n",
                  red, green, blue, RL_LIT(least), RL_LIT(gamma - 1));
    return true;
}

static bool emit_gamut(rl_color_text *t, const rl_op *op)
{
    const double *limit = op->u.fixed.params, *threshold = limit + 3;
    double power = limit[6];
    rl_str_add(&t->body, "        floatv ach = max(r, max(g, b));\n");
    for (int i = 0; i < 3; i++) {
        /* Where the compressed distance reaches 1 at the limit. */
        double span = limit[i] - threshold[i];
        double scale = span / pow(pow((1 - threshold[i]) / span, -power) - 1, 1 / power);
        rl_str_printf(&t->body, "        %c = rl_c_gamut(%c, ach, %s, %s, %s, %d);\n", "rgb"[i], "rgb"[i],
                      RL_LIT(threshold[i]), RL_LIT(scale), RL_LIT(power), op -> inverse);
    }
    return true;
}

/* ---- colour spaces that are no matrix: r, g, b hold X, Y, Z or H, S, V; the white of Luv is D65
 * -------------- */

static const char to_xyy[] = "        floatv d = rl_c_inverse(r + g + b), y = g;\n"
                             "        r *= d, g *= d, b = y;\n";

static const char from_xyy[] = "        floatv d = b * rl_c_inverse(g), z = (1.0f - r - g) * d;\n"
                               "        r *= d, g = b, b = z;\n";

static const char to_uvy[] = "        floatv d = rl_c_inverse(r + 15.0f * g + 3.0f * b), y = g;\n"
                             "        r *= 4.0f * d, g *= 9.0f * d, b = y;\n";

static const char from_uvy[] = "        floatv d = 0.75f * b * rl_c_inverse(g);\n"
                               "        floatv z = (4.0f - r - 6.66666667f * g) * d;\n"
                               "        r *= 3.0f * d, g = b, b = z;\n";

static const char to_luv[] = "        floatv d = rl_c_inverse(r + 15.0f * g + 3.0f * b);\n"
                             "        floatv u = 4.0f * r * d, v = 9.0f * g * d;\n"
                             "        floatv root = 1.16f * rl_c_pow(g, K(0.333333333f)) - 0.16f;\n"
                             "        r = select(root, 9.03296296f * g, g <= 0.00885645168f);\n"
                             "        g = 13.0f * r * (u - 0.19783001f);\n"
                             "        b = 13.0f * r * (v - 0.46831999f);\n";

static const char from_luv[] = "        floatv d = 0.0769230769f * rl_c_inverse(r);\n"
                               "        floatv u = g * d + 0.19783001f, v = b * d + 0.46831999f;\n"
                               "        floatv e = (r + 0.16f) * 0.862068966f;\n"
                               "        floatv y = select(e * e * e, 0.110705646f * r, r <= 0.08f);\n"
                               "        floatv s = 0.25f * y * rl_c_inverse(v);\n"
                               "        r = 9.0f * u * s, g = y, b = (12.0f - 3.0f * u - 20.0f * v) * s;\n";

static bool emit_space(rl_color_text *t, const char *forward, const char *backward, bool inverse)
{
    rl_str_add(&t->body, inverse ? backward : forward);
    return true;
}

bool rl_color_emit_fixed(rl_color_text *t, const rl_op *op)
{
    double gamma = op->u.fixed.params[0];
    switch (op->u.fixed.style) {
    case RL_FIXED_RED_MOD_03:
        return emit_red_03(t, RED_03, op->inverse);
    case RL_FIXED_RED_MOD_10:
        return emit_red_10(t, RED_10, op->inverse);
    case RL_FIXED_GLOW_03:
        return emit_glow(t, GLOW_03, op->inverse);
    case RL_FIXED_GLOW_10:
        return emit_glow(t, GLOW_10, op->inverse);
    case RL_FIXED_DARK_TO_DIM_10: /* weights: the Y of AP1 */
        return emit_surround(t, "0.27222872f", "0.67408177f", "0.05368952f", 1e-10,
                             op->inverse ? 1.0192640913260627 : 0.9811);
    case RL_FIXED_REC2100_SURROUND:
        return emit_surround(t, "0.2627f", "0.678f", "0.0593f", 1e-4, op->inverse ? 1 / gamma : gamma);
    case RL_FIXED_GAMUT_COMP_13:
        return emit_gamut(t, op);
    case RL_FIXED_HSV:
        return emit_space(t, "        rl_c_to_hsv(&r, &g, &b);\n", "        rl_c_from_hsv(&r, &g, &b);\n",
                          op->inverse);
    case RL_FIXED_XYY:
        return emit_space(t, to_xyy, from_xyy, op->inverse);
    case RL_FIXED_UVY:
        return emit_space(t, to_uvy, from_uvy, op->inverse);
    case RL_FIXED_LUV:
        return emit_space(t, to_luv, from_luv, op->inverse);
    }
    return false;
}

/* ---- tables ------------------------------------------------------------------------------------------ */

bool rl_color_emit_lut1d(rl_color_text *t, const rl_op *op)
{
    size_t n = op->u.lut1d.n;
    if (op->inverse || op->u.lut1d.hue_adjust || n < 2)
        return false;
    size_t start = rl_color_table_add(t, op->u.lut1d.rgb, 3 * n);
    for (int i = 0; i < 3; i++) {
        char c = "rgb"[i];
        if (op->u.lut1d.half_domain)
            rl_str_printf(&t->body, "        %c = rl_c_lut_half(tables + %zu, %d, %c);\n", c, start, i, c);
        else
            rl_str_printf(&t->body, "        %c = rl_c_lut1d(tables + %zu, %zu, %d, %c);\n", c, start, n, i,
                          c);
    }
    return true;
}

bool rl_color_emit_lut3d(rl_color_text *t, const rl_op *op)
{
    size_t n = op->u.lut3d.n;
    if (op->inverse || n < 2)
        return false;
    size_t start = rl_color_table_add(t, op->u.lut3d.rgb, 3 * n * n * n);
    rl_str_printf(&t->body, "        rl_c_lut3d%s(tables + %zu, %zu, &r, &g, &b);\n",
                  op->u.lut3d.tetrahedral ? "" : "_linear", start, n);
    return true;
}
