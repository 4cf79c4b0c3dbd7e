/* The surface that the scattering filters see, behind scatter.cl: slopes, areas, distances in space, and how a curved
 * surface differs from a flat one. */

/* ---- slopes ------------------------------------------------------------------------------------------- */

/* Slope of the depth along one axis, metres a pixel: the flatter of the two differences to neighbours of the
 * same material, so that a silhouette does not count as a slope; 0 when there are none. */
static inline floatv scatter_slope(global const float *depth, global const uint *stencil, constant frame_t *f,
                                   const vector_t *v, int dx, int dy)
{
    int i = scatter_at(f, v, dx, dy), j = scatter_at(f, v, -dx, -dy);
    intv id = rl_as_intv(rl_vload(0, stencil + v->at));
    floatv z = rl_vload(0, depth + v->at), a = rl_vload(0, depth + i) - z, b = z - rl_vload(0, depth + j);
    intv has_a = rl_as_intv(rl_vload(0, stencil + i)) == id,
         has_b = rl_as_intv(rl_vload(0, stencil + j)) == id;
    intv take_a = has_a & (~has_b | (fabs(a) <= fabs(b)));
    return rl_select(scatter_keep(b, has_b), a, take_a);
}

/* The same in metres of depth a metre of the screen's plane, at most MOST_TILT (84 degrees) either way. */
#define MOST_TILT 10.0f
static inline floatv scatter_tilt(const inputs_t *in, const vector_t *v, floatv z, int dx, int dy)
{
    float focal = dx ? in->f->camera.focal[0] : in->f->camera.focal[1];
    return clamp(scatter_slope(in->depth, in->stencil, in->f, v, dx, dy) * (focal / z), -MOST_TILT,
                 MOST_TILT);
}

#if P_weighting == WEIGHTING_SURFACE
/* Mean slope to both neighbours, of those that are of the same material and less steep than MOST_TILT: right
 * to second order on a curved surface, where the flatter one comes out too small. */
static inline floatv scatter_mean_slope(global const float *depth, global const uint *stencil,
                                        constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int i = scatter_at(f, v, dx, dy), j = scatter_at(f, v, -dx, -dy);
    intv id = rl_as_intv(rl_vload(0, stencil + v->at));
    floatv z = rl_vload(0, depth + v->at), a = rl_vload(0, depth + i) - z, b = z - rl_vload(0, depth + j);
    floatv most = z * (MOST_TILT / (dx ? f->camera.focal[0] : f->camera.focal[1]));
    intv has_a = (rl_as_intv(rl_vload(0, stencil + i)) == id) & (fabs(a) <= most),
         has_b = (rl_as_intv(rl_vload(0, stencil + j)) == id) & (fabs(b) <= most);
    floatv sum = scatter_keep(a, has_a) + scatter_keep(b, has_b);
    return rl_select(sum, 0.5f * sum, has_a & has_b);
}
#define SCATTER_AREA_SLOPE scatter_mean_slope
#else
#define SCATTER_AREA_SLOPE scatter_slope
#endif

/* ---- distances ---------------------------------------------------------------------------------------- */

/* `orientation: tangent` and `weighting: surface` take distances between points in space. The others count r on the
 * screen's plane and the depth beside it, r² + dz², as Golubev 2018 does: off the view axis that is not the distance
 * of points that differ in depth, and a filter there is not quite round. */
#define TRUE_DISTANCES (P_weighting == WEIGHTING_SURFACE || P_orientation == ORIENTATION_TANGENT)

/* Square of the distance between two points in space: one at depth z on the ray (rx, ry, -1), and one dz deeper on the
 * ray (rx + u, ry + v, -1). */
static inline floatv scatter_far2(floatv z, floatv rx, float ry, float u, float v, floatv dz)
{
    floatv a = fma(dz, rx + u, z * u), b = fma(dz, (floatv)(ry + v), z * v);
    return fma(a, a, fma(b, b, dz * dz));
}

/* How many times as deep as here a plane is where, were depth linear on screen, it would be 1 + f times as deep: 1/z is
 * what is linear. The area that a pixel sees of it grows with the cube. Near the plane's horizon and beyond, where no
 * light comes from, 50. */
static inline floatv scatter_plane_scale(floatv f)
{
    return 1.0f / fmax(1.0f - f, 0.02f);
}

/* ---- weighting: surface ------------------------------------------------------------------------------- */

#if P_weighting == WEIGHTING_SURFACE
/* What comes out at x is the sum of R(|x - y|) E(y) dA over the surface (Christensen and Burley 2015). It is not
 * divided by its own weights: on a curved surface they do not add up to one, less where it is convex and more where it
 * is concave. It is divided by the weights that the same samples have on the tangent plane, where they do; so what the
 * samples miss of the core cancels. A sample of another material is left out of both, unless the surface has turned
 * away there: beyond its silhouette the plane's weights count. Half or more of what lies beyond is hidden from a
 * camera that looks along the surface, so the correction fades with the cosine between the surface and the ray:
 *
 *     sum(R E dA) / sum(R dA) * (1 + cos * gain),      gain = sum(R dA) / sum(R_plane dA_plane) - 1
 *
 * What is hidden counts as no less and no more lit than what is seen. Distances and areas are those in space. With
 * those of scatter_far2's screen form beside true areas, gain is off by 1.6 % on a ball 15 degrees off the axis.
 * How wrong: on a captured head against a path-traced truth half of the error of `area`, on a ball of wax a quarter of it
 * (red) to two thirds (blue); passes/README.md has the tables, tests/test_sss_curved.c other shapes: a seventh of it on a
 * ball, a third on waves, 1.3 times on a cylinder. */

/* Slopes of the tangent plane, metres of depth a pixel. */
typedef struct plane_t {
    floatv x, y;
} plane_t;

static inline plane_t scatter_plane(const inputs_t *in, const vector_t *v)
{
    plane_t p;
    p.x = scatter_mean_slope(in->depth, in->stencil, in->f, v, 1, 0);
    p.y = scatter_mean_slope(in->depth, in->stencil, in->f, v, 0, 1);
    return p;
}

/* The cosine between the surface and the ray, from the area that the pixel sees. */
static inline floatv scatter_cosine(floatv z, floatv rx, float ry, floatv area)
{
    return fmin(z * z * rsqrt(fma(rx, rx, (floatv)fma(ry, ry, 1.0f))) / area, 1.0f);
}

/* Lanes whose sample, (dx, dy) pixels away, shows that the surface has turned away before: inside of the image, and
 * empty or behind the plane by more than two pixels are wide. `id` and `far` are the sample's material and depth,
 * `at_plane` the depth of the plane there. */
static inline intv scatter_turned_away(const inputs_t *in, const vector_t *v, int dx, int dy, intv id,
                                       floatv far, floatv at_plane)
{
    constant frame_t *f = in->f;
    int y = 4 * v->sy + v->py + dy;
    intv x = (RL_LANES + v->sx) * 4 + (v->px + dx);
    intv inside = (x >= f->valid[0]) & (x < f->valid[2]);
    float pixel = 2.0f / fmin(f->camera.focal[0], f->camera.focal[1]);
    intv away = (id == 0) | (far > fma(at_plane, (floatv)pixel, at_plane));
    return y >= f->valid[1] && y < f->valid[3] ? inside & away : (intv)0;
}
#endif

/* ---- areas -------------------------------------------------------------------------------------------- */

/* Area of the surface that pixels (x, y) of depth z see, m² on the plane z = -1 times f_x·f_y: |dP/dx ×
 * dP/dy| of P = ((x - c_x)/f_x z, -(y - c_y)/f_y z, -z); zx and zy are the slopes, metres a pixel. */
static inline floatv scatter_area_at(constant frame_t *f, floatv x, int y, floatv z, floatv zx, floatv zy)
{
    constant camera_t *c = &f->camera;
    zx *= c->focal[0];
    zy *= c->focal[1];
    floatv rx = rl_ray_x(f, c, x);
    float ry = rl_ray_y(f, c, (float)y);
    /* The cross product of (z + rx zx, ry zx, -zx) and (rx zy, ry zy - z, -zy), divided by z. */
    floatv n = z + rx * zx - ry * zy;
    return z * sqrt(zx * zx + zy * zy + n * n);
}

/* The same for all vectors of RL_PHASE4 planes, with slopes from the neighbours. */
static inline void scatter_area(global const float *depth, global const uint *stencil, global float *area,
                                constant frame_t *f)
{
    vector_t v = scatter_vector(f);
    SCATTER_FETCH(depth + v.at + 2 * RL_W); /* of 48 streams the hardware loses track */
    SCATTER_FETCH(stencil + v.at + 2 * RL_W);
    SCATTER_FETCH(area + v.at + 2 * RL_W);
    floatv zx = SCATTER_AREA_SLOPE(depth, stencil, f, &v, 1, 0),
           zy = SCATTER_AREA_SLOPE(depth, stencil, f, &v, 0, 1);
    floatv x = rl_to_floatv((RL_LANES + v.sx) * 4 + v.px);
    rl_vstore(scatter_area_at(f, x, 4 * v.sy + v.py, rl_vload(0, depth + v.at), zx, zy), 0, area + v.at);
}
