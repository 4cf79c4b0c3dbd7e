/* The displacement that makes history and frame agree in a tile: whole pixels by trial, their parts by least squares (Lucas
 * and Kanade 1981), between the sample and a parabola through the history: the sample's own slopes are those of an aliased
 * picture. */

#if !HAS_motion

#define REACH        8                      /* pixels that are searched, to each side */
#define USUAL_BEND   0.3f                   /* pixels that the displacement changes in half a tile, or in as much depth */
#define TERMS        4                      /* of a displacement along x, and along y */
#define UNKNOWNS     (2 * TERMS)
#define TURNS        2                      /* of least squares */

/* Sum of squared differences; lanes of something else, and such as differ more, count `most`. */
static inline float difference(const tile_t *t, const floatv *want, float most, int dx, int dy)
{
    floatv sum = 0.0f;
    EACH_VECTOR(v) {
        floatv off = want[v] - history(t, v, dx, dy);
        off = rl_select(most, fmin(off * off, most), of_material(t, v, dx, dy));
        sum += rl_select(0.0f, off, t->inner[v]);
    }
    return sum_lanes(sum);
}

/* x and y of a displacement s: affine, and linear in depth, as what turns moves (Longuet-Higgins and Prazdny 1980). */
static inline void displace(const float *s, floatv across, floatv down, floatv behind, floatv *x, floatv *y)
{
    *x = fma(s[1], across, fma(s[2], down, fma(s[3], behind, (floatv)s[0])));
    *y = fma(s[TERMS + 1], across, fma(s[TERMS + 2], down, fma(s[TERMS + 3], behind, (floatv)s[TERMS])));
}

/* The same difference with the displacement s besides, by the history's slopes; in `normal`, the normal equations
 * for another step: the upper triangle and the right side. */
static inline float fine_difference(const tile_t *t, float most, int dx, int dy, const float *s,
                                    float normal[UNKNOWNS][UNKNOWNS + 1])
{
    floatv sum = 0.0f, a[UNKNOWNS][UNKNOWNS + 1];
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = i; j <= UNKNOWNS; j++)
            a[i][j] = 0.0f;
    EACH_VECTOR(v) {
        floatv across, down, px, py;
        in_tile(v, &across, &down);
        floatv behind = relief(t, t->then[v]);
        displace(s, across, down, behind, &px, &py);
        px += t->dx[v] + (t->f->camera.jitter[0] - (float)t->bx);
        py += t->dy[v] + (t->f->camera.jitter[1] - (float)t->by);
        intv same = of_material(t, v, dx, dy);
        floatv here = history(t, v, dx, dy), left = history(t, v, dx - 1, dy), right = history(t, v, dx + 1, dy);
        floatv above = history(t, v, dx, dy - 1), below = history(t, v, dx, dy + 1);
        floatv gx = 0.5f * (right - left), gy = 0.5f * (below - above);
        floatv bx = right + left - 2.0f * here, by = below + above - 2.0f * here;
        floatv off = t->green[v] - here - px * fma(0.5f * px, bx, gx) - py * fma(0.5f * py, by, gy);
        gx = fma(px, bx, gx);
        gy = fma(py, by, gy);
        intv use = same & (off * off < most);
        sum += rl_select(0.0f, rl_select(most, off * off, use), t->inner[v]);
        gx = rl_select(0.0f, gx, use);
        gy = rl_select(0.0f, gy, use);
        floatv row[UNKNOWNS + 1] = {gx, gx * across, gx * down, gx * behind, gy, gy * across, gy * down, gy * behind, off};
        for (int i = 0; i < UNKNOWNS; i++)
            for (int j = i; j <= UNKNOWNS; j++)
                a[i][j] = fma(row[i], row[j], a[i][j]);
    }
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = i; j <= UNKNOWNS; j++)
            normal[i][j] = sum_lanes(a[i][j]);
    return sum_lanes(sum);
}

/* Adds the solution of a symmetric, positive definite system to s; rounding must not make it singular. */
static inline void solve(float a[UNKNOWNS][UNKNOWNS + 1], float *s)
{
    float least[UNKNOWNS];
    for (int i = 0; i < UNKNOWNS; i++)
        least[i] = 1e-6f * a[i][i];
    for (int i = 0; i < UNKNOWNS; i++) {
        a[i][i] = fmax(a[i][i], least[i]);
        for (int k = i + 1; k < UNKNOWNS; k++)
            for (int j = UNKNOWNS; j >= k; j--)
                a[k][j] -= a[i][k] / a[i][i] * a[i][j];
    }
    for (int i = UNKNOWNS - 1; i >= 0; i--) {
        for (int j = i + 1; j < UNKNOWNS; j++)
            a[i][UNKNOWNS] -= a[i][j] * a[j][UNKNOWNS];
        a[i][UNKNOWNS] /= a[i][i];
        s[i] += a[i][UNKNOWNS];
    }
}

/* Finds the displacement s beside the camera's; the share of the difference that is left. */
static inline float search(const tile_t *t, float *s)
{
    floatv want[TILE_N];
    float most = 4.0f * t->slopes / t->lanes, normal[UNKNOWNS][UNKNOWNS + 1];
    EACH_VECTOR(v)
        want[v] = expected(t, v);
    int bx = 0, by = 0;
    float first = 0.0f, best = 0.0f;
    for (int step = 3; step; step--) { /* 3: none at all */
        int cx = bx, cy = by, reach = step == 3 ? 0 : step == 2 ? REACH : 1;
        for (int j = -reach; j <= reach; j += step) {
            for (int i = -reach; i <= reach; i += step) {
                float e = difference(t, want, most, cx + i, cy + j);
                if (step == 3)
                    first = best = e;
                bx = e < best ? cx + i : bx;
                by = e < best ? cy + j : by;
                best = fmin(best, e);
            }
        }
    }
    for (int i = 0; i < UNKNOWNS; i++)
        s[i] = 0.0f;
    _Pragma("unroll 1") for (int turn = 0;; turn++) {
        best = fine_difference(t, most, bx, by, s, normal);
        if (turn == TURNS)
            break;
        float noise = best / t->lanes + 1e-12f;
        for (int i = 0; i < UNKNOWNS; i++) {
            float usual = i % TERMS ? USUAL_BEND : 1.0f;
            normal[i][i] += noise / (usual * usual);
            normal[i][UNKNOWNS] -= i % TERMS ? noise / (usual * usual) * s[i] : 0.0f;
        }
        solve(normal, s);
        int sx = (int)clamp(floor(s[0] + t->ox + 0.5f), -1.0f, 1.0f);
        int sy = (int)clamp(floor(s[TERMS] + t->oy + 0.5f), -1.0f, 1.0f);
        bx += sx;
        by += sy;
        s[0] = clamp(s[0] - (float)sx, -1.0f, 1.0f);
        s[TERMS] = clamp(s[TERMS] - (float)sy, -1.0f, 1.0f);
    }
    s[0] += (float)bx;
    s[TERMS] += (float)by;
    return best / fmax(first, 1e-30f);
}

#endif
