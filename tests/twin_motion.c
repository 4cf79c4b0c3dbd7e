#include "tests/twin_motion.h"

#include <math.h>
#include <string.h>

enum { SIDE = 16, REACH = 8, LEAST = 8, FEW = 32, TURNS = 2, TERMS = 4, UNKNOWNS = 2 * TERMS };

/* A tile and one material of it. */
typedef struct tile {
    const shade_run *run;
    int x, y, rows, bx, by, skip;
    uint32_t id;
    double lanes, slopes, then, ox,
        oy; /* then: mean depth; ox, oy: rest of the camera's displacement of samples */
    struct {
        bool mine, inner;
        double dx, dy, then, now, want, gx, gy;
    } p[SIDE][SIDE];
} tile;

static bool in_image(const frame_t *f, int x, int y)
{
    return x >= f->valid[0] && y >= f->valid[1] && x < f->valid[2] && y < f->valid[3];
}

static uint32_t id_at(const shade_run *run, int port, int x, int y)
{
    return run->images[port] ? twin_tap_id(run, port, x, y) : 0;
}

static double history(const tile *t, int i, int j, int dx, int dy)
{
    return twin_tap(t->run, TAA_LAST_COLOR, 1, t->x + i + t->bx + dx, t->y + j + t->by + dy);
}

static bool of_material(const tile *t, int i, int j, int dx, int dy)
{
    int x = t->x + i + t->bx + dx, y = t->y + j + t->by + dy;
    double then = t->p[j][i].then;
    return t->p[j][i].inner && id_at(t->run, TAA_LAST_STENCIL, x, y) == t->id &&
           fabs(twin_depth(t->run, TAA_LAST_DEPTH, x, y) - then) <= 0.04 * then;
}

static double difference(const tile *t, double most, int dx, int dy)
{
    double sum = 0;
    for (int k = 0; k < SIDE * SIDE; k++) {
        int i = k % SIDE, j = k / SIDE;
        if (t->p[j][i].inner)
            sum += of_material(t, i, j, dx, dy)
                       ? fmin(pow(t->p[j][i].want - history(t, i, j, dx, dy), 2), most)
                       : most;
    }
    return sum;
}

/* What the displacements along x and y are linear in: the place in the tile, and the depth. */
static void terms_of(const tile *t, double i, double j, double then, double *terms)
{
    double pixel = t->then / (double)t->run->frame.previous.focal[0];
    terms[0] = 1;
    terms[1] = (i + 0.5 - SIDE / 2) * 2 / SIDE;
    terms[2] = (j + 0.5 - SIDE / 2) * 2 / SIDE;
    terms[3] = fmax(-4, fmin(4, (then - t->then) / pixel * 2 / SIDE));
}

static double sum_of(const double *s, const double *terms)
{
    double sum = 0;
    for (int i = 0; i < TERMS; i++)
        sum += s[i] * terms[i];
    return sum;
}

/* Value and slope of the parabola through three values one apart, at d from the middle one. */
static void parabola(double before, double here, double behind, double d, double *rise, double *slope)
{
    double bend = before + behind - 2 * here;
    *rise = d * (behind - before) / 2 + d * d * bend / 2;
    *slope = (behind - before) / 2 + d * bend;
}

/* One step of least squares: `a` gets the normal equations, with the right side in its last column. */
static double normal_equations(const tile *t, double most, int bx, int by, const double *s,
                               double a[UNKNOWNS][UNKNOWNS + 1])
{
    double sum = 0;
    memset(a, 0, UNKNOWNS * sizeof *a);
    for (int k = 0; k < SIDE * SIDE; k++) {
        int i = k % SIDE, j = k / SIDE;
        double terms[TERMS], row[UNKNOWNS + 1], rise_x, rise_y, gx, gy, here = history(t, i, j, bx, by);
        const camera_t *camera = &t->run->frame.camera;
        if (!t->p[j][i].inner)
            continue;
        terms_of(t, i, j, t->p[j][i].then, terms);
        double px = t->p[j][i].dx + (double)camera->jitter[0] - t->bx + sum_of(s, terms);
        double py = t->p[j][i].dy + (double)camera->jitter[1] - t->by + sum_of(s + TERMS, terms);
        parabola(history(t, i, j, bx - 1, by), here, history(t, i, j, bx + 1, by), px, &rise_x, &gx);
        parabola(history(t, i, j, bx, by - 1), here, history(t, i, j, bx, by + 1), py, &rise_y, &gy);
        double off = t->p[j][i].now - here - rise_x - rise_y;
        if (!of_material(t, i, j, bx, by) || off * off >= most) {
            sum += most;
            continue;
        }
        for (int c = 0; c < TERMS; c++) {
            row[c] = gx * terms[c];
            row[TERMS + c] = gy * terms[c];
        }
        row[UNKNOWNS] = off;
        sum += off * off;
        for (int r = 0; r < UNKNOWNS; r++)
            for (int c = 0; c <= UNKNOWNS; c++)
                a[r][c] += row[r] * row[c];
    }
    return sum;
}

/* Gauss and Jordan. */
static void solve(double a[UNKNOWNS][UNKNOWNS + 1], double *s)
{
    for (int i = 0; i < UNKNOWNS; i++)
        for (int k = 0; k < UNKNOWNS; k++)
            for (int c = UNKNOWNS; c >= i && k != i; c--)
                a[k][c] -= a[k][i] / a[i][i] * a[i][c];
    for (int i = 0; i < UNKNOWNS; i++)
        s[i] += a[i][UNKNOWNS] / a[i][i];
}

static double search(const tile *t, double *s)
{
    int bx = 0, by = 0;
    double most = 4 * t->slopes / t->lanes, a[UNKNOWNS][UNKNOWNS + 1], first = difference(t, most, 0, 0),
           best = first;
    for (int step = 2; step; step--) {
        int cx = bx, cy = by, reach = step == 2 ? REACH : 1;
        for (int j = -reach; j <= reach; j += step) {
            for (int i = -reach; i <= reach; i += step) {
                double e = difference(t, most, cx + i, cy + j);
                bx = e < best ? cx + i : bx;
                by = e < best ? cy + j : by;
                best = fmin(best, e);
            }
        }
    }
    memset(s, 0, UNKNOWNS * sizeof *s);
    for (int turn = 0; turn < TURNS; turn++) {
        double noise = normal_equations(t, most, bx, by, s, a) / t->lanes + 1e-12;
        for (int i = 0; i < UNKNOWNS; i++) {
            double weight = i % TERMS ? noise / (0.3 * 0.3) : noise;
            a[i][i] += weight;
            a[i][UNKNOWNS] -= i % TERMS ? weight * s[i] : 0;
        }
        solve(a, s);
        int sx = (int)fmax(-1, fmin(1, floor(s[0] + t->ox + 0.5))),
            sy = (int)fmax(-1, fmin(1, floor(s[TERMS] + t->oy + 0.5)));
        bx += sx;
        by += sy;
        s[0] = fmax(-1, fmin(1, s[0] - sx));
        s[TERMS] = fmax(-1, fmin(1, s[TERMS] - sy));
    }
    best = normal_equations(t, most, bx, by, s, a);
    s[0] += bx;
    s[TERMS] += by;
    return best / fmax(first, 1e-30);
}

static double slope(double before, double here, double behind, double *bend)
{
    double a = here - before, b = behind - here;
    *bend += fabs(b - a);
    return fabs(b) < fabs(a) ? b : a;
}

static bool was_elsewhere(const tile *t, int i, int j)
{
    const shade_run *run = t->run;
    const camera_t *a = &run->frame.camera, *b = &run->frame.previous;
    int x = t->x + i, y = t->y + j;
    double bend = 0, z = twin_depth(run, TAA_DEPTH, x, y), then = t->p[j][i].then;
    double gx = slope(twin_depth(run, TAA_DEPTH, x - 1, y), z, twin_depth(run, TAA_DEPTH, x + 1, y), &bend);
    double gy = slope(twin_depth(run, TAA_DEPTH, x, y - 1), z, twin_depth(run, TAA_DEPTH, x, y + 1), &bend);
    double ox = t->bx + (double)b->jitter[0] - (double)a->jitter[0] - t->p[j][i].dx;
    double oy = t->by + (double)b->jitter[1] - (double)a->jitter[1] - t->p[j][i].dy;
    double off = twin_depth(run, TAA_LAST_DEPTH, x + t->bx, y + t->by) - (then + gx * ox + gy * oy);
    double most = 0.25 * (fabs(gx) + fabs(gy)) + 2e-3 * then + bend;
    bool other = off < -0.04 * then || id_at(run, TAA_LAST_STENCIL, x + t->bx, y + t->by) != t->id;
    return off > most || (!other && off < -most);
}

static int has_moved(const tile *t)
{
    double elsewhere = 0, off = 0, apart = 0;
    for (int k = 0; k < SIDE * SIDE; k++) {
        int i = k % SIDE, j = k / SIDE;
        if (!t->p[j][i].inner)
            continue;
        elsewhere += was_elsewhere(t, i, j);
        if (!of_material(t, i, j, 0, 0))
            continue;
        double d = pow(t->p[j][i].want - history(t, i, j, 0, 0), 2);
        off += d;
        if (of_material(t, i, j, -1, 0) && of_material(t, i, j, 1, 0) && of_material(t, i, j, 0, -1) &&
            of_material(t, i, j, 0, 1))
            apart += d;
    }
    if (elsewhere > t->lanes / 8)
        return 2;
    return off > 2 * t->slopes && apart > 2 * t->slopes;
}

/* Pixels of material `id` and what they look like. */
static void look_at(tile *t, uint32_t id)
{
    const frame_t *f = &t->run->frame;
    double dx = 0, dy = 0, then = 0;
    t->id = id;
    t->lanes = t->slopes = 0;
    for (int k = 0; k < SIDE * SIDE; k++) {
        int i = k % SIDE, j = k / SIDE, x = t->x + i, y = t->y + j;
        double z = twin_depth(t->run, TAA_DEPTH, x, y), d[2];
        twin_follow(f, x, y, z, d, &t->p[j][i].then);
        bool mine = j < t->rows && !(j & t->skip) && in_image(f, x, y) && z < 1e18 &&
                    fmax(fabs(d[0]), fabs(d[1])) < 16384 && id_at(t->run, TAA_STENCIL, x, y) == id;
        t->p[j][i].mine = mine;
        t->p[j][i].inner = mine && id_at(t->run, TAA_STENCIL, x - 1, y) == id &&
                           id_at(t->run, TAA_STENCIL, x + 1, y) == id &&
                           id_at(t->run, TAA_STENCIL, x, y - 1) == id &&
                           id_at(t->run, TAA_STENCIL, x, y + 1) == id;
        t->p[j][i].dx = d[0];
        t->p[j][i].dy = d[1];
        double gx = twin_tap(t->run, TAA_COLOR, 1, x + 1, y) - twin_tap(t->run, TAA_COLOR, 1, x - 1, y);
        double gy = twin_tap(t->run, TAA_COLOR, 1, x, y + 1) - twin_tap(t->run, TAA_COLOR, 1, x, y - 1);
        t->p[j][i].gx = gx / 2;
        t->p[j][i].gy = gy / 2;
        if (!t->p[j][i].inner)
            continue;
        t->lanes++;
        t->slopes += gx * gx / 4 + gy * gy / 4 + pow(0.01 * twin_tap(t->run, TAA_COLOR, 1, x, y), 2);
        dx += d[0];
        dy += d[1];
        then += t->p[j][i].then;
    }
    dx = dx / fmax(t->lanes, 1) + (double)f->camera.jitter[0];
    dy = dy / fmax(t->lanes, 1) + (double)f->camera.jitter[1];
    t->bx = (int)floor(dx + 0.5);
    t->by = (int)floor(dy + 0.5);
    t->ox = dx - t->bx;
    t->oy = dy - t->by;
    t->then = then / fmax(t->lanes, 1);
    for (int k = 0; k < SIDE * SIDE; k++) {
        int i = k % SIDE, j = k / SIDE;
        t->p[j][i].now = twin_tap(t->run, TAA_COLOR, 1, t->x + i, t->y + j);
        t->p[j][i].want = t->p[j][i].now -
                          t->p[j][i].gx * (t->p[j][i].dx + (double)f->camera.jitter[0] - t->bx) -
                          t->p[j][i].gy * (t->p[j][i].dy + (double)f->camera.jitter[1] - t->by);
    }
}

/* The tile around the middle of the material's pixels in t. */
static void centre(tile *t)
{
    double n = 0, x = 0, y = 0;
    for (int k = 0; k < SIDE * SIDE; k++) {
        if (!t->p[k / SIDE][k % SIDE].mine)
            continue;
        n++;
        x += k % SIDE + 0.5;
        y += k / SIDE + 0.5;
    }
    t->x += (int)floor(x / n - SIDE / 2 + 0.5);
    t->y += (int)floor(y / n - SIDE / 2 + 0.5);
    t->rows = SIDE;
}

void twin_motion(const shade_run *run, int x, int y, double *out)
{
    const frame_t *f = &run->frame;
    int down = (y + f->origin[1]) & (SIDE - 1);
    tile t = {.run = run, .x = x & ~(SIDE - 1), .y = y > down ? y - down : 0};
    double s[UNKNOWNS], terms[TERMS], then;
    uint32_t id = id_at(run, TAA_STENCIL, x, y);
    t.rows = SIDE - ((t.y + f->origin[1]) & (SIDE - 1));
    twin_follow(f, x, y, twin_depth(run, TAA_DEPTH, x, y), out, &then);
    if (twin_depth(run, TAA_DEPTH, x, y) >= 1e18 || fmax(fabs(out[0]), fabs(out[1])) >= 16384)
        return;
    int what = 0;
    for (t.skip = 3;; t.skip = 0) { /* every fourth row; all of them when those tell nothing, or of motion */
        look_at(&t, id);
        what = t.lanes < LEAST ? 0 : has_moved(&t);
        if (!t.skip || (!what && t.lanes >= LEAST))
            break;
    }
    if (!t.skip && t.lanes < FEW && (what || t.lanes < LEAST)) {
        tile near = t;
        centre(&near);
        look_at(&near, id);
        if (near.lanes > t.lanes) {
            t = near;
            what = t.lanes < LEAST ? 0 : has_moved(&t);
        }
    }
    if (!what)
        return;
    if (search(&t, s) > 0.5) {
        out[0] += what == 2 ? 1e9 : 0;
        return;
    }
    terms_of(&t, x - t.x, y - t.y, then, terms);
    out[0] += sum_of(s, terms);
    out[1] += sum_of(s + TERMS, terms);
}
