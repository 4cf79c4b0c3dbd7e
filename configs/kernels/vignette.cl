/* A user kernel: darkens towards the corners. It is run by configs/vignette.yaml.
 *
 * The ABI. The file is compiled as OpenCL C 1.2 behind relit's shared.h and common.cl (in kernels/, or share/relit/kernels when
 * installed) and behind a generated part that declares params_t and material_t. The entry point gets
 *   1. one `global` pointer a port, in the order of `ports:`. Pixel (x, y) of plane p is at p*f->plane + y*f->stride + x (that
 *      is rl_index(f, x, y) behind the plane's start). rgb and normal have 3 planes, vec2 2, scalar and id 1; ids are uint:
 *      the dense material index, 0 = no material. A port that is optional and not fed is NULL, and HAS_name is 0.
 *      `role: history` gives what a port held one frame before (valid when f->history is 1).
 *   2. `constant params_t *`: the parameters in their order, if there are any.
 *   3. `constant frame_t *` (shared.h): sizes, frame number, cameras of this frame and of the one before.
 *   4. `constant material_t *`: the material table, one entry a dense index.
 * With `items: pixel` (the default) an item is a pixel: x = get_global_id(0), y = get_global_id(1), in buffer coordinates; the
 * buffer is a little larger than the image, see rl_inside. With `items: vector` an item is RL_W pixels from x =
 * RL_W*get_global_id(0) on. f->origin turns buffer coordinates into display-window pixels. A compile error is shown as
 * vignette.cl:line:column. */

kernel void vignette(global const float *color, global float *out, constant params_t *p, constant frame_t *f,
                     constant material_t *materials)
{
    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    if (!rl_inside(f, x, y))
        return;
    /* distance from the image's centre in half diagonals: 0 in the centre, 1 in the corners */
    float w = (float)(f->valid[2] - f->valid[0]), h = (float)(f->valid[3] - f->valid[1]);
    float dx = (x + 0.5f - f->valid[0]) - 0.5f * w, dy = (y + 0.5f - f->valid[1]) - 0.5f * h;
    float r2 = 4.0f * (dx * dx + dy * dy) / (w * w + h * h);
    float gain = exp2(-p->gain * r2);
    for (int c = 0; c < 3; c++)
        out[c * f->plane + at] = gain * color[c * f->plane + at];
}
