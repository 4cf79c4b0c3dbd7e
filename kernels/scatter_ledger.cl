/* The ledger of energy of the scattering filters, behind scatter.cl and energy.cl: graph/run/energy.h says what its
 * columns are. */

#if WANTS_energy
/* Weights of the samples that are none: of another material or of nothing, and beyond the image. */
typedef struct rejected_t {
    floatv border[3], off_screen[3];
} rejected_t;

/* Lanes whose sample (dx, dy) pixels away lies in the image. */
static inline intv scatter_inside(constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int y = 4 * v->sy + v->py + dy;
    intv x = (RL_LANES + v->sx) * 4 + (v->px + dx);
    return (x >= f->valid[0]) & (x < f->valid[2]) & (intv)(y >= f->valid[1] && y < f->valid[3] ? -1 : 0);
}

static inline void scatter_reject(rejected_t *r, int c, floatv weight, intv inside)
{
    r->border[c] += scatter_keep(weight, inside);
    r->off_screen[c] += scatter_keep(weight, ~inside);
}

/* Channel c of a result: the pixel's own light, the share of the result that is not left to it, the weights w
 * of the samples that count and their light times weights, those that are rejected (`black`: they are in w),
 * and what the filter gives, before its clamps and after. */
static inline void scatter_account(floatv *out, int c, floatv own, float share, floatv w, floatv light,
                                   const rejected_t *r, intv black, floatv unclamped, floatv given, float least)
{
    floatv all = w + scatter_keep(r->border[c] + r->off_screen[c], ~black);
    intv any = all > least;
    floatv per = scatter_keep(1.0f / all, any);
    out[3 + c] = share * own * r->border[c] * per;
    out[6 + c] = share * own * r->off_screen[c] * per;
    out[9 + c] = unclamped - given;
    out[12 + c] = scatter_keep(unclamped - fma((floatv)share, light * per - own, own), any);
}

/* A result's part of the ledger, of the pixels at `at`; planes are `plane` floats apart. */
#define SCATTER_KEEP_LEDGER(out, plane, at)                                                                  \
    RL_UNROLL                                                                                                \
    for (int c = 0; c < 3; c++) {                                                                            \
        rl_vstore((out)[3 + c], 0, border + c * (plane) + (at));                                             \
        rl_vstore((out)[6 + c], 0, off_screen + c * (plane) + (at));                                         \
        rl_vstore((out)[9 + c], 0, clamped + c * (plane) + (at));                                            \
        rl_vstore((out)[12 + c], 0, redistributed + c * (plane) + (at));                                     \
    }

/* Sums of the light that goes through the filter, all of it on the way out: times exit(albedo) F_out of the
 * pixel that it belongs to. `parts`: diffuse, filtered, and the four of the ledger, in the layout given. */
static inline void scatter_energy(int layout, global const float *const *parts, global const float *albedo,
                                  global const float *normal, global const uint *stencil, global float *energy,
                                  constant frame_t *f, constant material_t *materials)
{
    band_t band = energy_band(energy, f);
    ENERGY_EACH_VECTOR(f, band, x, y)
    {
        int at = rl_index(f, x, y);
        intv id = rl_as_intv(scatter_load(layout, (global const float *)stencil, f, 0, x, y));
        intv left = rl_insidev(f, x, y) & (id != 0);
        while (scatter_any(left)) {
            int m = scatter_max_int(id & left);
            intv mine = left & (id == m);
            left &= ~mine;
            constant material_t *mat = &materials[m];
            if (!mat->has_profile)
                continue;
            floatv out = 1.0f, values[ENERGY_PIXELS];
            if (mat->shading_diffuse == DIFFUSE_DISNEY && mat->shading_exit_transmission == EXIT_SSS)
                out = scatter_disney(scatter_n_dot_v(f, normal, x, y));
            RL_UNROLL
            for (int c = 0; c < 3; c++) {
                floatv a = rl_load(albedo + c * f->plane, at);
                a = out * (mat->profile_texturing == TEXTURING_PRE_POST ? sqrt(a) : a);
                for (int i = 0; i < 6; i++)
                    values[3 * i + c] = a * scatter_load(layout, parts[i], f, c, x, y);
            }
            energy_post(&band, (uint)m, mine, values);
        }
    }
}
#define SCATTER_ENERGY(layout)                                                                               \
    global const float *parts[6] = {diffuse, filtered, border, off_screen, clamped, redistributed};          \
    scatter_energy(layout, parts, albedo, normal, stencil, energy, f, materials)
#endif
