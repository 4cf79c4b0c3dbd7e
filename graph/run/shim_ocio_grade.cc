/* RGB curves and primary grading as plain structs. */
#include <cmath>
#include <cstring>
#include <string>

#include "graph/run/shim_ocio_ops.hh"

namespace OCIO = OCIO_NAMESPACE;

/* ---- curves: OpenColorIO shows the pieces that it fits to the control points only as shader uniforms ----
 */

struct uniforms {
    const int *knot_offsets = nullptr, *piece_offsets = nullptr;
    const float *knots = nullptr, *pieces = nullptr;
};

static bool ends_with(const std::string &name, const char *tail)
{
    size_t n = strlen(tail);
    return name.size() >= n && name.compare(name.size() - n, n, tail) == 0;
}

static uniforms find_uniforms(const OCIO::GpuShaderDesc &desc)
{
    uniforms found;
    for (unsigned i = 0; i < desc.getNumUniforms(); i++) {
        OCIO::GpuShaderDesc::UniformData data;
        std::string name = desc.getUniform(i, data);
        if (ends_with(name, "knotsOffsets"))
            found.knot_offsets = data.m_vectorInt.m_getVector();
        else if (ends_with(name, "coefsOffsets"))
            found.piece_offsets = data.m_vectorInt.m_getVector();
        else if (ends_with(name, "knots"))
            found.knots = data.m_vectorFloat.m_getVector();
        else if (ends_with(name, "coefs"))
            found.pieces = data.m_vectorFloat.m_getVector();
    }
    return found;
}

static bool copy_spline(rl_arena *arena, const uniforms &from, int curve, rl_op_spline *out)
{
    int knots = from.knot_offsets[2 * curve + 1], pieces = from.piece_offsets[2 * curve + 1] / 3;
    if (knots < 2 || pieces != knots - 1)
        return knots == 0 || pieces == 0; /* none: the identity */
    auto room = static_cast<float *>(rl_arena_array(arena, size_t(knots + 3 * pieces), sizeof(float)));
    if (!room)
        return false;
    memcpy(room, from.knots + from.knot_offsets[2 * curve], size_t(knots) * sizeof(float));
    memcpy(room + knots, from.pieces + from.piece_offsets[2 * curve], size_t(3 * pieces) * sizeof(float));
    out->n = size_t(knots);
    out->knots = room;
    out->a = room + knots;
    out->b = out->a + pieces;
    out->c = out->b + pieces;
    return true;
}

void rl_shim_curves(rl_arena *arena, const OCIO::GradingRGBCurveTransform &t, rl_op *op)
{
    OCIO::TransformRcPtr copy = t.createEditableCopy();
    auto curves = OCIO::DynamicPtrCast<OCIO::GradingRGBCurveTransform>(copy);
    curves->makeDynamic();
    OCIO::GpuShaderDescRcPtr desc = OCIO::GpuShaderDesc::CreateShaderDesc();
    /* A config of its own: a shared one caches processors, and takes dynamic curves for equal. */
    OCIO::Config::CreateRaw()
        ->getProcessor(curves)
        ->getOptimizedGPUProcessor(OCIO::OPTIMIZATION_NONE)
        ->extractGpuShaderInfo(desc);
    uniforms found = find_uniforms(*desc);
    if (!found.knot_offsets || !found.piece_offsets || !found.knots || !found.pieces)
        return;
    for (int c = 0; c < 4; c++)
        if (!copy_spline(arena, found, c, &op->u.curves.spline[c]))
            return;
    op->u.curves.lin = t.getStyle() == OCIO::GRADING_LIN && !t.getBypassLinToLog();
    op->kind = RL_OP_CURVES;
}

/* ---- primary grading ---- */

static void rgb_of(const OCIO::GradingRGBM &v, double out[3])
{
    out[0] = v.m_red;
    out[1] = v.m_green;
    out[2] = v.m_blue;
}

/* The three styles in one form. As OpenColorIO's CPU path has it, the power is left out when it is 1 for all
 * channels (log) or for any (linear, video). */
void rl_shim_primary(const OCIO::GradingPrimaryTransform &t, rl_op *op)
{
    const OCIO::GradingPrimary &v = t.getValue();
    const OCIO::GradingStyle style = t.getStyle();
    double offset[3], lift[3], gain[3], brightness[3], exposure[3], contrast[3], gamma[3];
    rgb_of(v.m_offset, offset);
    rgb_of(v.m_lift, lift);
    rgb_of(v.m_gain, gain);
    rgb_of(v.m_brightness, brightness);
    rgb_of(v.m_exposure, exposure);
    rgb_of(v.m_contrast, contrast);
    rgb_of(v.m_gamma, gamma);
    auto &p = op->u.primary;
    int ones = 0;
    for (int c = 0; c < 3; c++) {
        double up = v.m_lift.m_master + lift[c], by = v.m_gain.m_master * gain[c];
        double slope = v.m_pivotWhite / (by == 0 ? 1 : by) + up - v.m_pivotBlack;
        if (style == OCIO::GRADING_LOG) {
            p.offset[c] = (v.m_brightness.m_master + brightness[c]) * 6.25 / 1023;
            p.slope[c] = v.m_contrast.m_master * contrast[c];
            p.power[c] = 1 / (v.m_gamma.m_master * gamma[c]);
        } else if (style == OCIO::GRADING_LIN) {
            p.offset[c] = v.m_offset.m_master + offset[c];
            p.slope[c] = std::exp2(v.m_exposure.m_master + exposure[c]);
            p.power[c] = v.m_contrast.m_master * contrast[c];
        } else {
            p.offset[c] = v.m_offset.m_master + offset[c] + up;
            p.slope[c] = (v.m_pivotWhite - v.m_pivotBlack) / (slope == 0 ? 1 : slope);
            p.power[c] = 1 / (v.m_gamma.m_master * gamma[c]);
        }
        ones += float(p.power[c]) == 1;
    }
    if (style != OCIO::GRADING_LOG && ones > 0)
        p.power[0] = p.power[1] = p.power[2] = 1;
    bool lin = style == OCIO::GRADING_LIN;
    p.pivot = style == OCIO::GRADING_LOG ? 0.5 + 0.5 * v.m_pivot : lin ? 0 : v.m_pivotBlack;
    p.black = lin ? 0 : v.m_pivotBlack;
    p.range = lin ? 0.18 * std::exp2(v.m_pivot) : v.m_pivotWhite - v.m_pivotBlack;
    p.saturation = v.m_saturation;
    p.low = v.m_clampBlack;
    p.high = v.m_clampWhite;
    op->kind = RL_OP_PRIMARY;
}
