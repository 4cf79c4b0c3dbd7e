/* A frame into the spool: half-float pixels of the variants and the reference, ids of the materials, maps. */
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/exr_core.h"
#include "graph/tool/ab_page_parts.h"
#include "graph/tool/metric_color.h"

const rl_metric rl_page_maps[RL_PAGE_MAPS] = {RL_METRIC_FLIP, RL_METRIC_HDRFLIP};

/* One block of a frame: packed by any thread of the pool. */
typedef struct job {
    const rl_compared_image *image; /* half floats; or */
    bool encoded;                   /* the image is: it is decoded from sRGB */
    const rl_compared_image *base;  /* its bits may be taken as differences to this one's */
    const float *map;               /* 0 … 1; or */
    const uint32_t *ids;
    size_t stride;
    int bits, planes, width, height;
    bool based;      /* that was smaller */
    uint8_t *packed; /* owned */
    size_t size;
    rl_error error;
} job;

static rl_code fill_halves(const job *j, const rl_compared_image *image, uint16_t *out, rl_error *err)
{
    const rl_exr_kernels *kernels = rl_exr_kernels_best();
    size_t width = (size_t)j->width;
    float *row = rl_malloc(width * sizeof *row);
    if (!row)
        return rl_fail_memory(err, width * sizeof *row);
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < (size_t)j->height; y++, out += width) {
            const float *in = image->plane[c] + y * image->stride;
            for (size_t x = 0; j->encoded && x < width; x++)
                row[x] = (float)rl_srgb_decode((double)in[x]);
            kernels->float_to_half(j->encoded ? row : in, out, width);
        }
    rl_free(row);
    return RL_OK;
}

static void fill_map(const job *j, uint8_t *out)
{
    size_t n = (size_t)j->width * (size_t)j->height;
    for (size_t i = 0; i < n; i++)
        out[i] = (uint8_t)(fminf(fmaxf(j->map[i], 0), 1) * 255 + 0.5f);
}

static void fill_ids(const job *j, void *out)
{
    size_t width = (size_t)j->width, i = 0;
    for (size_t y = 0; y < (size_t)j->height; y++)
        for (size_t x = 0; x < width; x++, i++) {
            uint32_t id = j->ids[y * j->stride + x];
            if (j->bits == 8)
                ((uint8_t *)out)[i] = (uint8_t)id;
            else
                ((uint16_t *)out)[i] = (uint16_t)id;
        }
}

/* Variants are often alike: their differences may be packed instead. */
static void pack_difference(job *j, uint16_t *halves)
{
    size_t n = 3 * (size_t)j->width * (size_t)j->height, size = 0;
    uint16_t *base = rl_malloc(n * sizeof *base);
    uint8_t *packed = NULL;
    if (!base) {
        rl_fail_memory(&j->error, n * sizeof *base);
        return;
    }
    job plain = *j;
    plain.encoded = false;
    if (!fill_halves(&plain, j->base, base, &j->error)) {
        for (size_t i = 0; i < n; i++)
            base[i] = (uint16_t)(halves[i] - base[i]);
        rl_page_plain difference = {j->bits, j->planes, j->width, j->height, base};
        rl_page_pack(&difference, &packed, &size, &j->error);
    }
    if (packed && size < j->size) {
        rl_free(j->packed);
        j->packed = packed;
        j->size = size;
        j->based = true;
        packed = NULL;
    }
    rl_free(packed);
    rl_free(base);
}

static void pack_job(void *ctx, int i)
{
    job *j = (job *)ctx + i;
    if (!j->image && !j->map && !j->ids)
        return;
    size_t bytes = (size_t)j->width * (size_t)j->height * (size_t)(j->planes * j->bits / 8);
    void *data = rl_malloc(bytes);
    if (!data) {
        rl_fail_memory(&j->error, bytes);
        return;
    }
    if (j->image)
        fill_halves(j, j->image, data, &j->error);
    else if (j->map)
        fill_map(j, data);
    else
        fill_ids(j, data);
    rl_page_plain plain = {j->bits, j->planes, j->width, j->height, data};
    if (!j->error.code)
        rl_page_pack(&plain, &j->packed, &j->size, &j->error);
    if (!j->error.code && j->base)
        pack_difference(j, data);
    rl_free(data);
}

/* 8, or 16, or 0: ids do not fit. */
static int id_bits(const rl_experiment_frame *f)
{
    uint32_t largest = 0;
    for (int y = 0; y < f->height; y++)
        for (int x = 0; x < f->width; x++) {
            uint32_t id = f->stencil[(size_t)y * f->stencil_stride + (size_t)x];
            largest = id > largest ? id : largest;
        }
    return largest < 256 ? 8 : largest < 65536 ? 16 : 0;
}

static void list_jobs(const rl_ab_page *page, const rl_ab_page_input *input, job *jobs, size_t n)
{
    const rl_experiment_frame *f = input->frame;
    size_t listed = page->plan->n_listed;
    for (size_t i = 0; i < n; i++)
        jobs[i] = (job){.bits = 8, .planes = 1, .width = f->width, .height = f->height};
    for (size_t i = 0; i <= listed; i++) {
        jobs[i].bits = 16;
        jobs[i].planes = 3;
        jobs[i].image = i < listed ? &f->images[i][RL_COMPARED_LINEAR] : NULL;
        jobs[i].base = i ? &f->images[0][RL_COMPARED_LINEAR] : NULL;
    }
    for (int k = RL_COMPARED; input->reference && k-- > 0;)
        if (input->reference[k].plane[0]) { /* LINEAR is looked at last, and is better */
            jobs[listed].image = &input->reference[k];
            jobs[listed].encoded = k == RL_COMPARED_DISPLAY;
        }
    job *ids = &jobs[listed + 1];
    ids->stride = f->stencil_stride;
    ids->bits = f->stencil ? id_bits(f) : 0;
    ids->ids = ids->bits ? f->stencil : NULL;
    for (size_t p = 0; p < page->plan->n_pairs; p++)
        for (size_t m = 0; m < RL_PAGE_MAPS; m++)
            ids[1 + p * RL_PAGE_MAPS + m].map =
                input->map ? input->map(input->ctx, p, rl_page_maps[m]) : NULL;
}

/* The room of a frame is the most that its blocks can take: frames of one size take turns in one part. */
static size_t room_of(const job *jobs, size_t n)
{
    size_t room = 0;
    for (size_t i = 0; i < n; i++) {
        rl_page_plain plain = {16, jobs[i].planes, jobs[i].width, jobs[i].height, NULL};
        if (__builtin_add_overflow(room, rl_page_pack_bound(&plain), &room))
            return 0;
    }
    return room;
}

static rl_code store(rl_ab_page *page, const job *jobs, size_t n, rl_page_held *out, rl_error *err)
{
    size_t room = room_of(jobs, n);
    rl_code code = room ? rl_page_spool_take(&page->spool, room, &out->extent, err)
                        : rl_fail_memory(err, (unsigned long long)-1);
    off_t at = out->extent.at;
    for (size_t i = 0; i < n && !code; i++) {
        const job *j = &jobs[i];
        out->blocks[i] = (rl_page_block){at, j->size, j->bits, j->planes, j->width, j->height, j->based};
        if (j->size)
            code = rl_page_spool_write(&page->spool, at, j->packed, j->size, err);
        at += (off_t)j->size;
    }
    return code;
}

rl_code rl_page_hold(rl_ab_page *page, const rl_ab_page_input *input, rl_page_held *out, rl_error *err)
{
    size_t n = page->plan->n_listed + 2 + page->plan->n_pairs * RL_PAGE_MAPS;
    job *jobs = rl_calloc(n, sizeof *jobs);
    *out = (rl_page_held){.blocks = rl_calloc(n, sizeof *out->blocks), .n_blocks = n};
    rl_code code = RL_OK;
    if (!jobs || !out->blocks) {
        code = rl_fail_memory(err, n * sizeof *jobs);
        goto done;
    }
    list_jobs(page, input, jobs, n);
    if (page->options.pool)
        rl_pool_for(page->options.pool, (int)n, pack_job, jobs);
    for (size_t i = 0; i < n && !code; i++) {
        if (!page->options.pool)
            pack_job(jobs, (int)i);
        if (jobs[i].error.code)
            code = rl_fail(err, jobs[i].error.code, RL_NOWHERE, "%s", jobs[i].error.text);
    }
    if (!code)
        code = store(page, jobs, n, out, err);
    out->encoded = jobs[page->plan->n_listed].encoded;
done:
    for (size_t i = 0; jobs && i < n; i++)
        rl_free(jobs[i].packed);
    rl_free(jobs);
    if (code)
        rl_page_release(page, out);
    return code;
}

void rl_page_release(rl_ab_page *page, rl_page_held *held)
{
    rl_page_spool_give(&page->spool, held->extent);
    rl_free(held->blocks);
    *held = (rl_page_held){0};
}

unsigned long long rl_page_held_bytes(const rl_page_held *held)
{
    enum { MARKUP = 160 }; /* the element around a block, and its line in the list */
    unsigned long long bytes = 0;
    for (size_t i = 0; i < held->n_blocks; i++)
        if (held->blocks[i].size)
            bytes += rl_page_base64_size(held->blocks[i].size) + MARKUP;
    return bytes;
}
