/* What colourists set: CDL, exposure and contrast, primary grading. */
#include <math.h>

#include "graph/run/color_emit.h"

static const char channel[3] = {'r', 'g', 'b'};

static double reciprocal(double x)
{
    return x == 0 ? 1 : 1 / x;
}

static void emit_saturation(rl_color_text *t, double saturation)
{
    rl_str_add(&t->body, "        floatv luma = fma(r, K(0.2126f), fma(g, K(0.7152f), b * 0.0722f));\n");
    for (int i = 0; i < 3; i++)
        rl_str_printf(&t->body, "        %c = fma(%c - luma, K(%s), luma);\n", channel[i], channel[i],
                      RL_LIT(saturation));
}

static void emit_clamp(rl_color_text *t, bool on)
{
    for (int i = 0; i < 3 && on; i++)
        rl_str_printf(&t->body, "        %c = min(max(%c, 0.0f), 1.0f);\n", channel[i], channel[i]);
}

static void emit_cdl_power(rl_color_text *t, const rl_op *op)
{
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        double power = op->inverse ? reciprocal(op->u.cdl.power[i]) : op->u.cdl.power[i];
        if (power != 1)
            rl_str_printf(&t->body, "        %c = select(%c, rl_c_pow(%c, K(%s)), %c >= 0.0f);\n", c, c, c,
                          RL_LIT(power), c);
    }
}

bool rl_color_emit_cdl(rl_color_text *t, const rl_op *op)
{
    bool clamp = op->u.cdl.clamp;
    if (!op->inverse) {
        for (int i = 0; i < 3; i++)
            rl_str_printf(&t->body, "        %c = fma(%c, K(%s), K(%s));\n", channel[i], channel[i],
                          RL_LIT(op->u.cdl.slope[i]), RL_LIT(op->u.cdl.offset[i]));
        emit_clamp(t, clamp);
        emit_cdl_power(t, op);
        emit_saturation(t, op->u.cdl.saturation);
        emit_clamp(t, clamp);
        return true;
    }
    emit_clamp(t, clamp);
    emit_saturation(t, reciprocal(op->u.cdl.saturation));
    emit_clamp(t, clamp);
    emit_cdl_power(t, op);
    for (int i = 0; i < 3; i++)
        rl_str_printf(&t->body, "        %c = (%c - %s) * %s;\n", channel[i], channel[i],
                      RL_LIT(op->u.cdl.offset[i]), RL_LIT(reciprocal(op->u.cdl.slope[i])));
    emit_clamp(t, clamp);
    return true;
}

/* OpenColorIO's least pivot and contrast, and the video style's power (1/1.83). */
#define CONTRAST_LEAST 0.001
#define VIDEO_POWER    0.54644808743169393

bool rl_color_emit_contrast(rl_color_text *t, const rl_op *op)
{
    double contrast = fmax(CONTRAST_LEAST, op->u.contrast.contrast * op->u.contrast.gamma);
    double pivot = fmax(CONTRAST_LEAST, op->u.contrast.pivot), gain = exp2(op->u.contrast.exposure);
    if (op->u.contrast.style == 2) {
        pivot = fmax(0, log2(pivot / 0.18) * op->u.contrast.log_step + op->u.contrast.log_grey);
        double offset = (op->u.contrast.exposure * op->u.contrast.log_step - pivot) * contrast + pivot;
        for (int i = 0; i < 3; i++) {
            char c = channel[i];
            if (op->inverse)
                rl_str_printf(&t->body, "        %c = (%c - %s) * %s;\n", c, c, RL_LIT(offset),
                              RL_LIT(1 / contrast));
            else
                rl_str_printf(&t->body, "        %c = fma(%c, K(%s), K(%s));\n", c, c, RL_LIT(contrast),
                              RL_LIT(offset));
        }
        return true;
    }
    if (op->u.contrast.style == 1) {
        pivot = pow(pivot, VIDEO_POWER);
        gain = pow(gain, VIDEO_POWER);
    }
    if (op->inverse)
        contrast = 1 / contrast;
    for (int i = 0; i < 3; i++) {
        char c = channel[i];
        if (contrast == 1)
            rl_str_printf(&t->body, "        %c = %c * %s;\n", c, c, RL_LIT(op->inverse ? 1 / gain : gain));
        else
            rl_str_printf(&t->body, "        %c = rl_c_pow(%c * %s, K(%s)) * %s;\n", c, c,
                          RL_LIT(op->inverse ? 1 / pivot : gain / pivot), RL_LIT(contrast),
                          RL_LIT(op->inverse ? pivot / gain : pivot));
    }
    return true;
}

/* ---- primary grading
 * --------------------------------------------------------------------------------------------- */

static void emit_slope(rl_color_text *t, const rl_op *op, int i)
{
    double slope = op->u.primary.slope[i], offset = op->u.primary.offset[i], pivot = op->u.primary.pivot;
    if (op->inverse)
        rl_str_printf(&t->body, "        %c = (%c - %s) * %s + %s;\n", channel[i], channel[i], RL_LIT(pivot),
                      RL_LIT(reciprocal(slope)), RL_LIT(pivot - offset));
    else
        rl_str_printf(&t->body, "        %c = (%c + %s) * %s + %s;\n", channel[i], channel[i],
                      RL_LIT(offset - pivot), RL_LIT(slope), RL_LIT(pivot));
}

static void emit_signed_power(rl_color_text *t, const rl_op *op, int i)
{
    double power = op->u.primary.power[i], black = op->u.primary.black, range = op->u.primary.range;
    char c = channel[i];
    if (power == 1)
        return;
    rl_str_printf(&t->body, "        %c = %c - %s;\n", c, c, RL_LIT(black));
    rl_str_printf(&t->body, "        %c = fma(copysign(rl_c_pow(fabs(%c) * %s, K(%s)), %c), K(%s), K(%s));\n",
                  c, c, RL_LIT(1 / range), RL_LIT(op->inverse ? 1 / power : power), c, RL_LIT(range),
                  RL_LIT(black));
}

/* OpenColorIO's "no clamp" is the largest float. */
#define NO_CLAMP 3e38

static void emit_limits(rl_color_text *t, const rl_op *op)
{
    for (int i = 0; i < 3; i++) {
        if (op->u.primary.low > -NO_CLAMP)
            rl_str_printf(&t->body, "        %c = max(%c, %s);\n", channel[i], channel[i],
                          RL_LIT(op->u.primary.low));
        if (op->u.primary.high < NO_CLAMP)
            rl_str_printf(&t->body, "        %c = min(%c, %s);\n", channel[i], channel[i],
                          RL_LIT(op->u.primary.high));
    }
}

bool rl_color_emit_primary(rl_color_text *t, const rl_op *op)
{
    double saturation = op->inverse ? reciprocal(op->u.primary.saturation) : op->u.primary.saturation;
    if (op->inverse) {
        emit_limits(t, op);
        if (saturation != 1)
            emit_saturation(t, saturation);
    }
    for (int i = 0; i < 3; i++) {
        if (!op->inverse)
            emit_slope(t, op, i);
        emit_signed_power(t, op, i);
        if (op->inverse)
            emit_slope(t, op, i);
    }
    if (!op->inverse) {
        if (saturation != 1)
            emit_saturation(t, saturation);
        emit_limits(t, op);
    }
    return true;
}
