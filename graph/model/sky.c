#include "graph/model/sky.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"

static const double pi = 3.14159265358979323846;

enum { MOST_SAMPLES = 1024, MOST_MIPS = 12 };

/* An octahedral image: side + 2 pixels a row, RGB and one unused float a pixel. */
typedef struct image {
    float *data;
    int side;
} image;

typedef struct sample {
    float l[3]; /* around +z */
    float weight, mip;
} sample;

typedef struct job {
    const rl_ambient *ambient;
    const float *const *plane;
    int width, height;
    const float *matrix;
    image from[MOST_MIPS]; /* the map, then halved again and again */
    int mips;
    image to;
    sample samples[MOST_SAMPLES];
    int n;
} job;

/* ---- octahedral images -----------------------------------------------------------------------------------
 */

static size_t image_floats(int side)
{
    return 4 * (size_t)(side + 2) * (size_t)(side + 2);
}

static float *pixel(const image *m, int x, int y)
{
    return m->data + 4 * ((size_t)(y + 1) * (size_t)(m->side + 2) + (size_t)(x + 1));
}

/* The unit direction of a place from -1 to 1; not normalized length in `length`. */
static void direction(double x, double y, double d[3], double *length)
{
    double z = 1 - fabs(x) - fabs(y), px = x, py = y;
    if (z < 0) {
        px = copysign(1 - fabs(y), x);
        py = copysign(1 - fabs(x), y);
    }
    *length = sqrt(px * px + py * py + z * z);
    d[0] = px / *length;
    d[1] = py / *length;
    d[2] = z / *length;
}

static double place(const image *m, int x)
{
    return 2 * (x + 0.5) / m->side - 1;
}

/* What is across an edge lies mirrored on that edge. */
static void fill_border(const image *m)
{
    int n = m->side;
    for (int i = 0; i < n; i++) {
        memcpy(pixel(m, i, -1), pixel(m, n - 1 - i, 0), 4 * sizeof(float));
        memcpy(pixel(m, i, n), pixel(m, n - 1 - i, n - 1), 4 * sizeof(float));
        memcpy(pixel(m, -1, i), pixel(m, 0, n - 1 - i), 4 * sizeof(float));
        memcpy(pixel(m, n, i), pixel(m, n - 1, n - 1 - i), 4 * sizeof(float));
    }
    for (int c = 0; c < 4; c++) { /* all four corners are straight down */
        int x = c & 1 ? n : -1, y = c & 2 ? n : -1;
        memcpy(pixel(m, x, y), pixel(m, c & 1 ? 0 : n - 1, c & 2 ? 0 : n - 1), 4 * sizeof(float));
    }
}

static void look_up(const image *m, const float d[3], float weight, float out[3])
{
    float sum = 1 / (fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2])), x = d[0] * sum, y = d[1] * sum;
    if (d[2] < 0) {
        float px = x;
        x = copysignf(1 - fabsf(y), px);
        y = copysignf(1 - fabsf(px), y);
    }
    float u = (x * 0.5f + 0.5f) * (float)m->side + 0.5f, v = (y * 0.5f + 0.5f) * (float)m->side + 0.5f;
    int i = (int)u, j = (int)v;
    i = i < 0 ? 0 : i > m->side ? m->side : i;
    j = j < 0 ? 0 : j > m->side ? m->side : j;
    const float *a = m->data + 4 * ((size_t)j * (size_t)(m->side + 2) + (size_t)i),
                *b = a + 4 * (m->side + 2);
    float s = u - (float)i, t = v - (float)j;
    float w[4] = {(1 - s) * (1 - t) * weight, s * (1 - t) * weight, (1 - s) * t * weight, s * t * weight};
    for (int c = 0; c < 3; c++)
        out[c] += w[0] * a[c] + w[1] * a[c + 4] + w[2] * b[c] + w[3] * b[c + 4];
}

/* ---- the map ---------------------------------------------------------------------------------------------
 */

/* Bilinear in the latitude-longitude image. */
static void read_map(const job *j, double u, double v, double out[3])
{
    double x = u * j->width - 0.5, y = fmin(fmax(v * j->height - 0.5, 0), j->height - 1.0);
    int x0 = (int)floor(x), y0 = (int)y, y1 = y0 + 1 < j->height ? y0 + 1 : y0;
    double s = x - x0, t = y - y0;
    int left = ((x0 % j->width) + j->width) % j->width, right = (left + 1) % j->width;
    for (int c = 0; c < 3; c++) {
        const float *p = j->plane[c], *a = p + (size_t)y0 * (size_t)j->width,
                    *b = p + (size_t)y1 * (size_t)j->width;
        double l = (1 - t) * ((1 - s) * (double)a[left] + s * (double)a[right]) +
                   t * ((1 - s) * (double)b[left] + s * (double)b[right]);
        out[c] += isfinite(l) ? l : 0;
    }
}

/* A row of the map's octahedral image: as many places a pixel as the map has pixels there, at the equator. */
static void convert_row(void *ctx, int y)
{
    const job *j = ctx;
    const image *m = &j->from[0];
    int fine = 1 + j->width / (2 * m->side);
    for (int x = 0; x < m->side; x++) {
        double sum[3] = {0, 0, 0};
        float *out = pixel(m, x, y);
        for (int k = 0; k < fine * fine; k++) {
            double d[3], length, u, v;
            direction(2 * (x + (k % fine + 0.5) / fine) / m->side - 1,
                      2 * (y + (k / fine + 0.5) / fine) / m->side - 1, d, &length);
            rl_ambient_place(j->ambient, d, &u, &v);
            read_map(j, u, v, sum);
        }
        for (int c = 0; c < 3; c++)
            out[c] = (float)(((double)j->matrix[3 * c] * sum[0] + (double)j->matrix[3 * c + 1] * sum[1] +
                              (double)j->matrix[3 * c + 2] * sum[2]) /
                             (fine * fine));
    }
}

/* Four pixels become one, weighted with their solid angles, which go as 1/length^3. */
static void halve(const image *from, const image *to)
{
    for (int y = 0; y < to->side; y++)
        for (int x = 0; x < to->side; x++) {
            double sum[3] = {0, 0, 0}, all = 0, d[3], length;
            for (int k = 0; k < 4; k++) {
                int fx = 2 * x + (k & 1), fy = 2 * y + (k >> 1);
                const float *p = pixel(from, fx, fy);
                direction(place(from, fx), place(from, fy), d, &length);
                double w = 1 / (length * length * length);
                all += w;
                for (int c = 0; c < 3; c++)
                    sum[c] += w * (double)p[c];
            }
            for (int c = 0; c < 3; c++)
                pixel(to, x, y)[c] = (float)(sum[c] / all);
        }
    fill_border(to);
}

/* ---- the lobe --------------------------------------------------------------------------------------------
 */

/* Directions of GGX's normals as seen from along the axis, mirrored, weighted with the cosine and the
 * height-correlated Smith term: the lobe at normal incidence. The mip level is that whose pixels cover the
 * share of a sample. */
static void make_samples(job *j, double roughness, int wanted)
{
    double alpha2 = pow(roughness, 4), all = 0, pixels = 4 * pi / ((double)j->from[0].side * j->from[0].side);
    j->n = 0;
    for (int i = 0; i < wanted; i++) {
        double a = (i + 0.5) / wanted, turn = 2 * pi * i * 0.6180339887498949;
        double c2 = (1 - a) / (1 + (alpha2 - 1) * a), z = 2 * c2 - 1, h = 1 + (alpha2 - 1) * c2;
        if (z <= 0) /* below the surface */
            continue;
        double across = 2 * sqrt(fmax(c2 * (1 - c2), 0)), density = alpha2 / (4 * pi * h * h);
        double weight = z / (z + sqrt(z * z * (1 - alpha2) + alpha2));
        sample *s = &j->samples[j->n++];
        *s = (sample){{(float)(across * cos(turn)), (float)(across * sin(turn)), (float)z}, (float)weight, 0};
        s->mip = (float)fmin(fmax(0.5 * log2(1 / (wanted * density) / pixels) + 0.5, 0), j->mips - 1.001);
        all += weight;
    }
    for (int i = 0; i < j->n; i++)
        j->samples[i].weight = (float)((double)j->samples[i].weight / all);
}

static void blur_row(void *ctx, int y)
{
    const job *j = ctx;
    for (int x = 0; x < j->to.side; x++) {
        double r[3], length, t[3], b[3];
        float sum[3] = {0, 0, 0}, *out = pixel(&j->to, x, y);
        direction(place(&j->to, x), place(&j->to, y), r, &length);
        double sign = r[2] < 0 ? -1 : 1, k = -1 / (sign + r[2]), xy = r[0] * r[1] * k; /* Duff et al. 2017 */
        t[0] = 1 + sign * r[0] * r[0] * k;
        t[1] = sign * xy;
        t[2] = -sign * r[0];
        b[0] = xy;
        b[1] = sign + r[1] * r[1] * k;
        b[2] = -r[1];
        for (int i = 0; i < j->n; i++) {
            const sample *s = &j->samples[i];
            float d[3];
            for (int c = 0; c < 3; c++)
                d[c] = s->l[0] * (float)t[c] + s->l[1] * (float)b[c] + s->l[2] * (float)r[c];
            int mip = (int)s->mip;
            float share = s->mip - (float)mip;
            look_up(&j->from[mip], d, s->weight * (1 - share), sum);
            look_up(&j->from[mip + 1], d, s->weight * share, sum);
        }
        memcpy(out, sum, sizeof sum);
    }
}

/* ---- all of it -------------------------------------------------------------------------------------------
 */

/* The map's own, 64 to 1024; then about four pixels to the lobe's width. */
static void choose_sides(int width, rl_sky *sky)
{
    static const int most[RL_SKY_LEVELS] = {1024, 256, 128, 64, 64, 32, 32, 32, 32, 32, 32};
    int own = 64;
    while (own < 1024 && 4 * own <= width)
        own *= 2;
    sky->n = 0;
    for (int i = 0; i < RL_SKY_LEVELS; i++) {
        sky->side[i] = most[i] < own ? most[i] : own;
        sky->at[i] = (int)sky->n;
        sky->n += image_floats(sky->side[i]);
    }
}

static rl_code make_mips(job *j, rl_error *err)
{
    for (j->mips = 1; j->from[j->mips - 1].side > 2; j->mips++) {
        image *m = &j->from[j->mips];
        m->side = j->from[j->mips - 1].side / 2;
        m->data = rl_calloc(image_floats(m->side), sizeof(float));
        if (!m->data)
            return rl_fail_memory(err, image_floats(m->side) * sizeof(float));
        halve(&j->from[j->mips - 1], m);
    }
    return RL_OK;
}

rl_code rl_sky_make(const rl_ambient *a, const float *const plane[3], int width, int height,
                    const float to_working[9], rl_pool *pool, rl_sky *out, rl_error *err)
{
    rl_code code = RL_OK;
    job *j = rl_calloc(1, sizeof *j);
    choose_sides(width, out);
    out->data = rl_calloc(out->n, sizeof *out->data);
    if (!j || !out->data) {
        code = rl_fail_memory(err, out->n * sizeof *out->data);
        goto done;
    }
    *j = (job){.ambient = a, .plane = plane, .width = width, .height = height, .matrix = to_working};
    j->from[0] = (image){out->data + out->at[0], out->side[0]};
    rl_pool_for(pool, out->side[0], convert_row, j);
    fill_border(&j->from[0]);
    code = make_mips(j, err);
    for (int i = 1; i < RL_SKY_LEVELS && !code; i++) {
        j->to = (image){out->data + out->at[i], out->side[i]};
        make_samples(j, (double)i / (RL_SKY_LEVELS - 1), i == 1 ? 256 : MOST_SAMPLES);
        rl_pool_for(pool, j->to.side, blur_row, j);
        fill_border(&j->to);
    }
done:
    for (int i = 1; j && i < MOST_MIPS; i++)
        rl_free(j->from[i].data);
    rl_free(j);
    if (code) {
        rl_free(out->data);
        out->data = NULL;
        out->n = 0;
    }
    return code;
}
