/* Surface normal from depth. On each axis one neighbour gives the tangent: of those with the same material the one whose
 * inverse depth differs less. Inverse depth is linear over a plane, so a plane is exact whichever is taken, and a step in
 * depth is not bridged. An axis without such a neighbour is taken as parallel to the screen. */

typedef struct side_t {
    floatv slope;  /* d ln(depth) per ray unit, of the tangent towards growing x or y */
    floatv ray;    /* ray coordinate of the neighbour on this axis */
    floatv change; /* |difference of inverse depth|; 1e30: no such neighbour */
} side_t;

/* `sign` is +1 for the neighbour behind (growing x, growing y), -1 for the one before. */
static inline side_t look(constant frame_t *f, global const float *depth, global const uint *stencil, uintv id, floatv z,
                          int x, int y, float sign, float focal, floatv ray)
{
    int row = clamp(y, 0, f->rows - 1), at = rl_index(f, x, row);
    floatv there = rl_load(depth, at);
    intv same = (rl_load_id(stencil, at) == id) & rl_insidev(f, x, y) & (there > 0.0f);
    there = rl_select(z, there, same);
    side_t s;
    floatv dz = there - z; /* exact for neighbours within a factor of two */
    s.slope = dz * (sign * focal) / z;
    s.ray = ray;
    s.change = rl_select(1e30f, fabs(dz / (there * z)), same);
    return s;
}

static inline side_t nearer(side_t a, side_t b)
{
    intv take_b = b.change < a.change;
    side_t s = {rl_select(a.slope, b.slope, take_b), rl_select(a.ray, b.ray, take_b), a.change};
    return s;
}

kernel void geometric_normal(global const float *depth, global const uint *stencil, global float *normal,
                             constant frame_t *f, constant material_t *materials)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    constant camera_t *c = &f->camera;
    uintv id = rl_load_id(stencil, at);
    intv full = id != 0;
    floatv out[3] = {0.0f, 0.0f, 0.0f};
    if (rl_any(full)) {
        floatv z = rl_select(1.0f, rl_load(depth, at), full);
        floatv px = rl_to_floatv(RL_LANES + x), rx = rl_ray_x(f, c, px);
        float ry = rl_ray_y(f, c, (float)y), fx = c->focal[0], fy = c->focal[1];
        side_t h = nearer(look(f, depth, stencil, id, z, x + 1, y, 1, fx, rl_ray_x(f, c, px + 1.0f)),
                          look(f, depth, stencil, id, z, x - 1, y, -1, fx, rl_ray_x(f, c, px - 1.0f)));
        side_t v = nearer(look(f, depth, stencil, id, z, x, y + 1, 1, fy, rl_ray_y(f, c, (float)(y + 1))),
                          look(f, depth, stencil, id, z, x, y - 1, -1, fy, rl_ray_y(f, c, (float)(y - 1))));
        /* Tangents per pixel, times focal/z: P' - P = dz ray' + z (ray' - ray). Down times right faces the camera. */
        floatv right[3] = {fma(h.slope, h.ray, 1.0f), h.slope * ry, -h.slope};
        floatv down[3] = {v.slope * rx, fma(v.slope, v.ray, -1.0f), -v.slope};
        floatv n[3] = {down[1] * right[2] - down[2] * right[1], down[2] * right[0] - down[0] * right[2],
                       down[0] * right[1] - down[1] * right[0]};
        floatv scale = rsqrt(fma(n[0], n[0], fma(n[1], n[1], n[2] * n[2])));
        for (int i = 0; i < 3; i++) {
            constant float *m = &c->to_world[4 * i];
            out[i] = rl_select(0.0f, scale * fma(m[0], n[0], fma(m[1], n[1], m[2] * n[2])), full);
        }
    }
    for (int i = 0; i < 3; i++)
        RL_STORE(normal, i, x, y, out[i]);
}
