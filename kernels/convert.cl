/* Between RL_LINEAR and RL_PHASE4 (shared.h). An item is 64 pixels of one row of one plane, so that both sides see whole
 * vectors of 16. Global size: (columns/64 + 2, rows, planes); the first and the last item of a row write the margins. */

kernel void linear_to_phase4(global const float *src, global float *dst, constant frame_t *f)
{
    int g = (int)get_global_id(0) - 1, y = get_global_id(1), plane = get_global_id(2);
    int step = (f->rows >> 2) * f->stride4;
    global float *q = dst + plane * f->plane4 + ((y & 3) * 4 * (f->rows >> 2) + (y >> 2)) * f->stride4 + RL_MARGIN4 +
                      g * 16;
    if (g < 0 || g * 64 >= f->columns) {
        for (int s = 0; s < 4; s++)
            vstore16((float16)(0.0f), 0, q + s * step);
        return;
    }
    global const float *p = src + plane * f->plane + y * f->stride + g * 64;
    float16 a = vload16(0, p), b = vload16(1, p), c = vload16(2, p), d = vload16(3, p);
    vstore16((float16)(a.s048c, b.s048c, c.s048c, d.s048c), 0, q);
    vstore16((float16)(a.s159d, b.s159d, c.s159d, d.s159d), 0, q + step);
    vstore16((float16)(a.s26ae, b.s26ae, c.s26ae, d.s26ae), 0, q + 2 * step);
    vstore16((float16)(a.s37bf, b.s37bf, c.s37bf, d.s37bf), 0, q + 3 * step);
}

kernel void phase4_to_linear(global const float *src, global float *dst, constant frame_t *f)
{
    int g = (int)get_global_id(0) - 1, y = get_global_id(1), plane = get_global_id(2);
    if (g < 0 || g * 64 >= f->columns)
        return;
    global float *p = dst + plane * f->plane + y * f->stride + g * 64;
    global const float *q = src + plane * f->plane4;
    for (int k = 0; k < 4; k++) {
        int x = g * 64 + k * 16, step = (f->rows >> 2) * f->stride4;
        global const float *r = q + rl_index4(f, x, y);
        float4 a = vload4(0, r), b = vload4(0, r + step), c = vload4(0, r + 2 * step), d = vload4(0, r + 3 * step);
        vstore16((float16)(a.x, b.x, c.x, d.x, a.y, b.y, c.y, d.y, a.z, b.z, c.z, d.z, a.w, b.w, c.w, d.w), k, p);
    }
}
