#include "graph/run/shim_ocio_ops.hh"

#include <cmath>
#include <cstring>
#include <string>

namespace OCIO = OCIO_NAMESPACE;

static void first3(const double *from, double *to)
{
    memcpy(to, from, 3 * sizeof *to);
}

static bool invert3(const double *m, double *out)
{
    double c0 = m[4] * m[8] - m[5] * m[7], c1 = m[5] * m[6] - m[3] * m[8], c2 = m[3] * m[7] - m[4] * m[6];
    double det = m[0] * c0 + m[1] * c1 + m[2] * c2;
    if (det == 0)
        return false;
    double inverse[9] = {c0, m[2] * m[7] - m[1] * m[8], m[1] * m[5] - m[2] * m[4],
                         c1, m[0] * m[8] - m[2] * m[6], m[2] * m[3] - m[0] * m[5],
                         c2, m[1] * m[6] - m[0] * m[7], m[0] * m[4] - m[1] * m[3]};
    for (int i = 0; i < 9; i++)
        out[i] = inverse[i] / det;
    return true;
}

static void read_matrix(const OCIO::MatrixTransform &t, bool inverse, rl_op *op)
{
    double m44[16], offset[4], m[9];
    t.getMatrix(m44);
    t.getOffset(offset);
    /* Colour that depends on alpha has no place in an RGB image. */
    if (m44[3] != 0 || m44[7] != 0 || m44[11] != 0)
        return;
    for (int i = 0; i < 9; i++)
        m[i] = m44[i / 3 * 4 + i % 3];
    if (!inverse) {
        memcpy(op->u.matrix.m, m, sizeof m);
        first3(offset, op->u.matrix.offset);
    } else {
        if (!invert3(m, op->u.matrix.m))
            return;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                op->u.matrix.offset[i] -= op->u.matrix.m[3 * i + j] * offset[j];
    }
    op->kind = RL_OP_MATRIX;
    op->inverse = false;
}

static void read_range(const OCIO::RangeTransform &t, bool inverse, rl_op *op)
{
    bool low = t.hasMinInValue() && t.hasMinOutValue(), high = t.hasMaxInValue() && t.hasMaxOutValue();
    double in0 = low ? t.getMinInValue() : 0, in1 = high ? t.getMaxInValue() : 0;
    double out0 = low ? t.getMinOutValue() : 0, out1 = high ? t.getMaxOutValue() : 0;
    if (inverse) {
        std::swap(in0, out0);
        std::swap(in1, out1);
    }
    bool clamps = t.getStyle() == OCIO::RANGE_CLAMP;
    op->u.range.scale = low && high && in1 != in0 ? (out1 - out0) / (in1 - in0) : 1;
    op->u.range.offset = low ? out0 - in0 * op->u.range.scale : out1 - in1 * op->u.range.scale;
    op->u.range.has_low = low && clamps;
    op->u.range.has_high = high && clamps;
    op->u.range.low = out0;
    op->u.range.high = out1;
    op->kind = RL_OP_RANGE;
    op->inverse = false;
}

static void read_log(const OCIO::LogTransform &t, rl_op *op)
{
    op->u.log.base = t.getBase();
    for (int c = 0; c < 3; c++)
        op->u.log.log_slope[c] = op->u.log.lin_slope[c] = 1;
    op->kind = RL_OP_LOG;
}

/* LogAffine and LogCamera have these in common. */
template <typename T> static void read_log_sides(const T &t, rl_op *op)
{
    op->u.log.base = t.getBase();
    t.getLogSideSlopeValue(op->u.log.log_slope);
    t.getLogSideOffsetValue(op->u.log.log_offset);
    t.getLinSideSlopeValue(op->u.log.lin_slope);
    t.getLinSideOffsetValue(op->u.log.lin_offset);
    op->kind = RL_OP_LOG;
}

static void read_log_camera(const OCIO::LogCameraTransform &t, rl_op *op)
{
    read_log_sides(t, op);
    op->u.log.has_break = true;
    t.getLinSideBreakValue(op->u.log.lin_break);
    op->u.log.has_line = t.getLinearSlopeValue(op->u.log.line_slope);
}

/* ---- the rest ---------------------------------------------------------------------------------------- */

static void read_fixed(const OCIO::FixedFunctionTransform &t, rl_op *op)
{
    static const struct {
        OCIO::FixedFunctionStyle theirs;
        rl_op_fixed ours;
    } styles[] = {
        {OCIO::FIXED_FUNCTION_ACES_RED_MOD_03, RL_FIXED_RED_MOD_03},
        {OCIO::FIXED_FUNCTION_ACES_RED_MOD_10, RL_FIXED_RED_MOD_10},
        {OCIO::FIXED_FUNCTION_ACES_GLOW_03, RL_FIXED_GLOW_03},
        {OCIO::FIXED_FUNCTION_ACES_GLOW_10, RL_FIXED_GLOW_10},
        {OCIO::FIXED_FUNCTION_ACES_DARK_TO_DIM_10, RL_FIXED_DARK_TO_DIM_10},
        {OCIO::FIXED_FUNCTION_ACES_GAMUT_COMP_13, RL_FIXED_GAMUT_COMP_13},
        {OCIO::FIXED_FUNCTION_REC2100_SURROUND, RL_FIXED_REC2100_SURROUND},
        {OCIO::FIXED_FUNCTION_RGB_TO_HSV, RL_FIXED_HSV},
        {OCIO::FIXED_FUNCTION_XYZ_TO_xyY, RL_FIXED_XYY},
        {OCIO::FIXED_FUNCTION_XYZ_TO_uvY, RL_FIXED_UVY},
        {OCIO::FIXED_FUNCTION_XYZ_TO_LUV, RL_FIXED_LUV},
    };
    if (t.getNumParams() > sizeof op->u.fixed.params / sizeof(double))
        return;
    t.getParams(op->u.fixed.params);
    for (const auto &style : styles)
        if (style.theirs == t.getStyle()) {
            op->u.fixed.style = style.ours;
            op->kind = RL_OP_FIXED;
        }
}

static bool read_negative(OCIO::NegativeStyle style, rl_op_negative *out)
{
    static const struct {
        OCIO::NegativeStyle theirs;
        rl_op_negative ours;
    } styles[] = {{OCIO::NEGATIVE_CLAMP, RL_NEGATIVE_CLAMP},
                  {OCIO::NEGATIVE_MIRROR, RL_NEGATIVE_MIRROR},
                  {OCIO::NEGATIVE_PASS_THRU, RL_NEGATIVE_PASS},
                  {OCIO::NEGATIVE_LINEAR, RL_NEGATIVE_LINEAR}};
    for (const auto &known : styles)
        if (known.theirs == style) {
            *out = known.ours;
            return true;
        }
    return false;
}

static void read_power(const OCIO::ExponentTransform &t, rl_op *op)
{
    double value[4];
    t.getValue(value);
    first3(value, op->u.power.gamma);
    if (read_negative(t.getNegativeStyle(), &op->u.power.negative))
        op->kind = RL_OP_POWER;
}

static void read_moncurve(const OCIO::ExponentWithLinearTransform &t, rl_op *op)
{
    double gamma[4], offset[4];
    t.getGamma(gamma);
    t.getOffset(offset);
    first3(gamma, op->u.moncurve.gamma);
    first3(offset, op->u.moncurve.offset);
    if (read_negative(t.getNegativeStyle(), &op->u.moncurve.negative))
        op->kind = RL_OP_MONCURVE;
}

static void read_cdl(const OCIO::CDLTransform &t, rl_op *op)
{
    t.getSlope(op->u.cdl.slope);
    t.getOffset(op->u.cdl.offset);
    t.getPower(op->u.cdl.power);
    op->u.cdl.saturation = t.getSat();
    op->u.cdl.clamp = t.getStyle() == OCIO::CDL_ASC;
    op->kind = RL_OP_CDL;
}

static void read_contrast(const OCIO::ExposureContrastTransform &t, rl_op *op)
{
    op->u.contrast.style = t.getStyle() == OCIO::EXPOSURE_CONTRAST_LINEAR  ? 0
                           : t.getStyle() == OCIO::EXPOSURE_CONTRAST_VIDEO ? 1
                                                                           : 2;
    op->u.contrast.exposure = t.getExposure();
    op->u.contrast.contrast = t.getContrast();
    op->u.contrast.gamma = t.getGamma();
    op->u.contrast.pivot = t.getPivot();
    op->u.contrast.log_step = t.getLogExposureStep();
    op->u.contrast.log_grey = t.getLogMidGray();
    op->kind = RL_OP_CONTRAST;
}

static bool read_lut1d(rl_arena *arena, const OCIO::Lut1DTransform &t, rl_op *op)
{
    size_t n = t.getLength();
    auto rgb = static_cast<float *>(rl_arena_array(arena, 3 * n, sizeof(float)));
    if (!rgb)
        return false;
    for (size_t i = 0; i < n; i++)
        t.getValue(i, rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]);
    op->u.lut1d.n = n;
    op->u.lut1d.rgb = rgb;
    op->u.lut1d.half_domain = t.getInputHalfDomain();
    op->u.lut1d.hue_adjust = t.getHueAdjust() != OCIO::HUE_NONE;
    op->kind = RL_OP_LUT1D;
    return true;
}

static bool read_lut3d(rl_arena *arena, const OCIO::Lut3DTransform &t, rl_op *op)
{
    size_t n = t.getGridSize();
    auto rgb = static_cast<float *>(rl_arena_array(arena, 3 * n * n * n, sizeof(float)));
    if (!rgb)
        return false;
    for (size_t i = 0; i < n * n * n; i++)
        t.getValue(i / (n * n), i / n % n, i % n, rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]);
    op->u.lut3d.n = n;
    op->u.lut3d.rgb = rgb;
    op->u.lut3d.tetrahedral =
        t.getInterpolation() == OCIO::INTERP_TETRAHEDRAL || t.getInterpolation() == OCIO::INTERP_BEST;
    op->kind = RL_OP_LUT3D;
    return true;
}

template <typename T> static const T &as(const OCIO::Transform &t)
{
    return dynamic_cast<const T &>(t);
}

/* For people. */
static const char *name_of(OCIO::TransformType type)
{
    static const char *const names[] = {"allocation",
                                        "built-in",
                                        "CDL",
                                        "colour space",
                                        "display view",
                                        "exponent",
                                        "exponent with linear part",
                                        "exposure and contrast",
                                        "file",
                                        "fixed function",
                                        "grading primary",
                                        "grading RGB curve",
                                        "grading tone",
                                        "group",
                                        "logarithm (affine)",
                                        "logarithm (camera)",
                                        "logarithm",
                                        "look",
                                        "1D table",
                                        "3D table",
                                        "matrix",
                                        "range"};
    return size_t(type) < sizeof names / sizeof *names ? names[type] : "unknown";
}

/* False when memory is out. What cannot be described stays RL_OP_OTHER. */
static bool read_op(rl_arena *arena, const OCIO::Transform &t, rl_op *op)
{
    op->kind = RL_OP_OTHER;
    op->name = name_of(t.getTransformType());
    op->inverse = t.getDirection() == OCIO::TRANSFORM_DIR_INVERSE;
    switch (t.getTransformType()) {
    case OCIO::TRANSFORM_TYPE_MATRIX:
        read_matrix(as<OCIO::MatrixTransform>(t), op->inverse, op);
        break;
    case OCIO::TRANSFORM_TYPE_RANGE:
        read_range(as<OCIO::RangeTransform>(t), op->inverse, op);
        break;
    case OCIO::TRANSFORM_TYPE_LOG:
        read_log(as<OCIO::LogTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_LOG_AFFINE:
        read_log_sides(as<OCIO::LogAffineTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_LOG_CAMERA:
        read_log_camera(as<OCIO::LogCameraTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_GRADING_RGB_CURVE:
        rl_shim_curves(arena, as<OCIO::GradingRGBCurveTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_FIXED_FUNCTION:
        read_fixed(as<OCIO::FixedFunctionTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_EXPONENT:
        read_power(as<OCIO::ExponentTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_EXPONENT_WITH_LINEAR:
        read_moncurve(as<OCIO::ExponentWithLinearTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_CDL:
        read_cdl(as<OCIO::CDLTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_EXPOSURE_CONTRAST:
        read_contrast(as<OCIO::ExposureContrastTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_GRADING_PRIMARY:
        rl_shim_primary(as<OCIO::GradingPrimaryTransform>(t), op);
        break;
    case OCIO::TRANSFORM_TYPE_LUT1D:
        return read_lut1d(arena, as<OCIO::Lut1DTransform>(t), op);
    case OCIO::TRANSFORM_TYPE_LUT3D:
        return read_lut3d(arena, as<OCIO::Lut3DTransform>(t), op);
    default:
        break;
    }
    return true;
}

rl_code rl_shim_ops(const OCIO::GroupTransform &group, rl_arena *arena, rl_op **ops, size_t *n, rl_error *err)
{
    int count = group.getNumTransforms();
    auto list = static_cast<rl_op *>(rl_arena_array(arena, size_t(count) + 1, sizeof(rl_op)));
    if (!list)
        return rl_fail_memory(err, size_t(count) * sizeof(rl_op));
    for (int i = 0; i < count; i++)
        if (!read_op(arena, *group.getTransform(i), &list[i]))
            return rl_fail_memory(err, 0);
    *ops = list;
    *n = size_t(count);
    return RL_OK;
}
