/* Shadows of lights that the capture never had: a march through the depth buffer towards the light, after McGuire and Mara, "Efficient
 * GPU Screen-Space Ray Tracing", JCGT 2014. Behind surface.cl, in front of lighting.cl.
 *
 * What is not on the image casts no shadow: occluders out of sight, behind others or beyond the border. What is on it is taken for
 * a slab as deep as shadow_thickness_m; between two pixels the slab's back is that of the nearer one, so that an edge before
 * something far behind it has no curtain. Where the whole way takes at most shadow_steps pixels, the answer is that for the depth
 * buffer (1/z linear between pixels, so that a plane never shadows itself); beyond, only every n-th pixel is looked at, from a
 * random first one, and occluders narrower than that are missed at some pixels (noise). */

/* A light's ray on the image. Point and light are homogeneous (w = 0: directional), so both kinds are one formula: the pixel
 * moves by `ray` from step to step, and the depth of step i is z / (1 - i bend). */
typedef struct track_t {
    floatv x, y, rayx, rayy; /* buffer pixels; the larger of |rayx|, |rayy| is 1 */
    floatv bend, last;       /* steps before the light or the border is reached, 0 = none */
} track_t;

/* The light in view space: a point, or where it comes from. */
static inline void light_in_view(constant light_t *light, constant camera_t *c, float *view)
{
    float from[3];
    for (int i = 0; i < 3; i++)
        from[i] = light->type == LIGHT_DIRECTIONAL ? -light->direction[i] : light->position[i] - c->to_world[4 * i + 3];
    for (int i = 0; i < 3; i++)
        view[i] = c->to_view[4 * i] * from[0] + c->to_view[4 * i + 1] * from[1] + c->to_view[4 * i + 2] * from[2];
}

/* Steps from a pixel to the image's first or last one on an axis. */
static inline floatv to_border(floatv at, floatv ray, int first, int end)
{
    floatv room = rl_select(at - (float)first, (float)(end - 1) - at, ray > 0.0f);
    return room / fmax(fabs(ray), 1e-6f);
}

static inline void lay_track(track_t *t, constant frame_t *f, constant light_t *light, floatv z, int x, int y)
{
    constant camera_t *c = &f->camera;
    float view[3];
    light_in_view(light, c, view);
    float ahead = -view[2];
    t->x = rl_to_floatv(RL_LANES + x);
    t->y = (float)y;
    floatv gx = c->focal[0] * (view[0] - rl_ray_x(f, c, t->x) * ahead);
    floatv gy = (floatv)(-c->focal[1] * (view[1] - rl_ray_y(f, c, (float)y) * ahead));
    floatv g = fmax(fmax(fabs(gx), fabs(gy)), 1e-20f);
    intv wide = fabs(gx) >= fabs(gy);
    t->rayx = rl_select(gx / g, copysign((floatv)1.0f, gx), wide);
    t->rayy = rl_select(copysign((floatv)1.0f, gy), gy / g, wide);
    t->bend = (light->type == LIGHT_DIRECTIONAL ? (floatv)ahead : ahead - z) / g;
    floatv border = floor(fmin(to_border(t->x, t->rayx, f->valid[0], f->valid[2]),
                               to_border(t->y, t->rayy, f->valid[1], f->valid[3])));
    t->last = ahead > 0.0f ? fmin(border, ceil(g / ahead) - 1.0f) : border;
}

/* The surface's depth at a place between two pixels of a row or a column, and the nearer of theirs; huge where nothing is. */
static inline floatv surface_depth(global const float *depth, constant frame_t *f, floatv x, floatv y, intv on, floatv *nearer)
{
    floatv left = floor(x), top = floor(y), part = (x - left) + (y - top), a, b;
    intv ix = clamp(rl_to_intv(left), f->valid[0], f->valid[2] - 1), iy = clamp(rl_to_intv(top), f->valid[1], f->valid[3] - 1);
    intv at = iy * f->stride + ix;
    intv next = at + select((intv)0, (intv)1, (x > left) & (ix < f->valid[2] - 1)) +
                select((intv)0, (intv)f->stride, (y > top) & (iy < f->valid[3] - 1));
    int from[RL_W], to[RL_W];
    float near[RL_W], far[RL_W];
    rl_vstore(select((intv)0, at, on), 0, from);
    rl_vstore(select((intv)0, next, on), 0, to);
    for (int i = 0; i < RL_W; i++) {
        near[i] = depth[from[i]];
        far[i] = depth[to[i]];
    }
    a = rl_vload(0, near);
    b = rl_vload(0, far);
    a = rl_select((floatv)0.0f, 1.0f / fmax(a, 1e-20f), a > 0.0f);
    b = rl_select((floatv)0.0f, 1.0f / fmax(b, 1e-20f), b > 0.0f);
    *nearer = 1.0f / fmax(fmax(a, b), 1e-20f);
    return 1.0f / fmax(mix(a, b, part), 1e-20f);
}

/* Where a march of `stride` pixels a step begins: 1 to stride. */
static inline floatv first_step(constant params_t *p, constant frame_t *f, floatv stride, int which, int x, int y)
{
    float share[RL_W];
    for (int i = 0; i < RL_W; i++) {
        uint h = rl_hash((uint)p->seed + 0x632BE5ABu * (uint)which, (uint)f->number, (uint)(x + i + f->origin[0]),
                         (uint)(y + f->origin[1]));
        share[i] = (float)(h >> 8) * (1.0f / 16777216.0f);
    }
    return 1.0f + fmin(floor(rl_vload(0, share) * stride), stride - 1.0f);
}

/* Visibility of light number `which` from the lanes `on`, 0 or 1; 1 elsewhere. */
static inline floatv march(global const float *depth, constant params_t *p, constant frame_t *f, constant light_t *light, floatv z,
                           intv on, int which, int x, int y)
{
    track_t t;
    lay_track(&t, f, light, z, x, y);
    floatv visible = 1.0f, before = z, i = 1.0f;
    floatv stride = fmax(ceil(t.last / (float)p->shadow_steps), 1.0f);
    if (p->shadow_jitter && rl_any(on & (stride > 1.0f)))
        i = first_step(p, f, stride, which, x, y);
    intv going = on & (i <= t.last);
    while (rl_any(going)) {
        floatv front, surface = surface_depth(depth, f, fma(i, t.rayx, t.x), fma(i, t.rayy, t.y), going, &front);
        floatv d = z / fmax(1.0f - i * t.bend, 1e-9f);
        intv hit = going & (d > surface + p->shadow_bias_m) & (fmin(d, before) < front + p->shadow_thickness_m);
        visible = rl_select(visible, 0.0f, hit);
        before = d;
        i += stride;
        going &= ~hit & (i <= t.last);
    }
    return visible;
}
