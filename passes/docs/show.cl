/* Kernels of passes/docs/pictures.yaml: data as colours, and images side by side. The ABI is documented in
 * configs/kernels/vignette.cl. All have the same parameters, since params_t is
 * made from the node's list and the file is compiled as a whole. */

/* One image left of a column of the display window, the other right of it, a white line between. */
kernel void halves(global const float *left, global const float *right, global float *out, constant params_t *p,
                   constant frame_t *f, constant material_t *materials)
{
    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    if (!rl_inside(f, x, y))
        return;
    int side = x + f->origin[0] - p->column;
    for (int c = 0; c < 3; c++)
        out[c * f->plane + at] = side == 0 ? 1.0f : side < 0 ? left[c * f->plane + at] : right[c * f->plane + at];
}

/* World-space normals, -1 … 1, as 0 … 1; black where there is none. */
kernel void normals(global const float *normal, global float *out, constant params_t *p, constant frame_t *f,
                    constant material_t *materials)
{
    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    if (!rl_inside(f, x, y))
        return;
    float length2 = 0;
    for (int c = 0; c < 3; c++)
        length2 += normal[c * f->plane + at] * normal[c * f->plane + at];
    for (int c = 0; c < 3; c++)
        out[c * f->plane + at] = length2 > 0.5f ? 0.5f + 0.5f * normal[c * f->plane + at] : 0.0f;
}

/* -1 … 1 as blue, grey, orange. */
static void show(float value, global float *out, int at, int plane)
{
    float k = clamp(value, -1.0f, 1.0f);
    float3 full = k > 0 ? (float3)(1.0f, 0.55f, 0.1f) : (float3)(0.15f, 0.4f, 1.0f);
    float3 colour = mix((float3)(0.3f, 0.3f, 0.3f), full, fabs(k));
    out[at] = colour.x;
    out[plane + at] = colour.y;
    out[2 * plane + at] = colour.z;
}

/* Orange where convex, blue where hollow. */
kernel void bends(global const float *curvature, global float *out, constant params_t *p, constant frame_t *f,
                  constant material_t *materials)
{
    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    if (rl_inside(f, x, y))
        show(curvature[at] / p->most, out, at, f->plane);
}

/* Where two images differ: grey where they are equal, orange where `a` is darker, blue where it is brighter. */
kernel void difference(global const float *a, global const float *b, global float *out, constant params_t *p,
                       constant frame_t *f, constant material_t *materials)
{
    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    if (!rl_inside(f, x, y))
        return;
    float sum = 0.0f;
    for (int c = 0; c < 3; c++)
        sum += (b[c * f->plane + at] - a[c * f->plane + at]) * (1.0f / 3.0f);
    show(sum / p->most, out, at, f->plane);
}
