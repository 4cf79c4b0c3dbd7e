#include "graph/run/checkpoint.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"

static const char suffix[] = ".checkpoint";

/* In front of every file; the bytes of the machine that wrote it, which `order` tells. */
typedef struct header {
    char magic[8];
    uint32_t order, size; /* 0x01020304; of this header */
    rl_identity identity;
    uint64_t chain;
    int64_t frame;
    rl_geometry geometry;
    camera_t previous;
    uint64_t bytes, content; /* of the history: its size and hash */
    uint64_t check;          /* of the header up to here */
} header;

static const char magic[8] = "rlckpt1";
enum { ORDER = 0x01020304 };

void rl_identity_difference(const rl_identity *a, const rl_identity *b, char *out, size_t size)
{
    static const char *const names[RL_ID_PARTS] = {[RL_ID_VERSION] = "relit's version",
                                                   [RL_ID_PIPELINE] = "the pipeline",
                                                   [RL_ID_CAPTURE] = "the capture's manifest",
                                                   [RL_ID_PLAN] = "the plan",
                                                   [RL_ID_KERNELS] = "the kernels",
                                                   [RL_ID_DEVICE] = "the device"};
    size_t used = 0, n = 0;
    *out = 0;
    for (int i = 0; i < RL_ID_PARTS && used < size; i++)
        if (a->part[i] != b->part[i]) {
            used += (size_t)snprintf(out + used, size - used, "%s%s", n ? ", " : "", names[i]);
            n++;
        }
    if (n && used < size)
        snprintf(out + used, size - used, " differ%s", n == 1 ? "s" : "");
}

void rl_checkpoint_free(rl_checkpoint *c)
{
    rl_free(c->history);
    *c = (rl_checkpoint){0};
}

/* ---- files -----------------------------------------------------------------------------------------------
 */

static uint64_t check_of(const header *h)
{
    return XXH3_64bits(h, offsetof(header, check));
}

static void fill_header(header *h, const rl_checkpoint *c)
{
    memset(h, 0, sizeof *h); /* paddings too: they are hashed */
    memcpy(h->magic, magic, sizeof magic);
    h->order = ORDER;
    h->size = sizeof *h;
    h->identity = c->identity;
    h->chain = c->chain;
    h->frame = c->frame;
    h->geometry = c->geometry;
    h->previous = c->previous;
    h->bytes = c->bytes;
    h->content = XXH3_64bits(c->history, c->bytes);
    h->check = check_of(h);
}

/* Not through rl_file_write: history is large, and there is one copy of it already. */
rl_code rl_checkpoint_write(const char *path, const rl_checkpoint *c, rl_error *err)
{
    char temp[4096];
    header h;
    fill_header(&h, c);
    rl_code code = rl_file_temp(path, temp, sizeof temp, err);
    if (code)
        return code;
    FILE *f = fopen(temp, "wbxe");
    if (f)
        setvbuf(f, NULL, _IONBF, 0);
    bool good =
        f && fwrite(&h, sizeof h, 1, f) == 1 && (!c->bytes || fwrite(c->history, c->bytes, 1, f) == 1);
    int why = errno;
    if (f && fclose(f) && good) {
        good = false;
        why = errno;
    }
    if (good)
        return rl_file_commit(temp, path, err);
    if (f)
        rl_file_discard(temp);
    return rl_fail_file(err, RL_E_IO, path, "cannot be written: %s", strerror(why));
}

static rl_code read_header(FILE *f, const char *path, header *h, rl_error *err)
{
    if (fread(h, sizeof *h, 1, f) != 1 || memcmp(h->magic, magic, sizeof magic) || h->order != ORDER ||
        h->size != sizeof *h || h->check != check_of(h))
        return rl_fail_file(err, RL_E_FORMAT, path, "is no checkpoint of this version, or is damaged");
    return RL_OK;
}

static rl_code read_history(FILE *f, const char *path, const header *h, rl_checkpoint *out, rl_error *err)
{
    if (fseek(f, 0, SEEK_END) || ftell(f) < 0 || (uint64_t)ftell(f) != sizeof *h + h->bytes ||
        fseek(f, sizeof *h, SEEK_SET))
        return rl_fail_file(err, RL_E_FORMAT, path, "is cut short");
    out->history = rl_malloc(h->bytes);
    if (!out->history)
        return rl_fail_memory(err, h->bytes);
    out->bytes = h->bytes;
    if ((h->bytes && fread(out->history, h->bytes, 1, f) != 1) ||
        XXH3_64bits(out->history, h->bytes) != h->content)
        return rl_fail_file(err, RL_E_FORMAT, path, "is damaged");
    return RL_OK;
}

rl_code rl_checkpoint_read(const char *path, bool whole, rl_checkpoint *out, rl_error *err)
{
    header h;
    *out = (rl_checkpoint){0};
    FILE *f = fopen(path, "rbe");
    if (!f)
        return rl_fail_file(err, RL_E_IO, path, "cannot be opened: %s", strerror(errno));
    rl_code code = read_header(f, path, &h, err);
    if (!code) {
        out->identity = h.identity;
        out->chain = h.chain;
        out->frame = (int)h.frame;
        out->geometry = h.geometry;
        out->previous = h.previous;
        out->bytes = h.bytes;
    }
    if (!code && whole)
        code = read_history(f, path, &h, out, err);
    fclose(f);
    if (code)
        rl_checkpoint_free(out);
    return code;
}

/* ---- names -----------------------------------------------------------------------------------------------
 */

char *rl_checkpoint_path(rl_arena *arena, const char *folder, const char *name, int frame)
{
    char *file = rl_arena_printf(arena, "%s.%04d%s", name, frame, suffix);
    return file ? rl_path_join(arena, folder, file) : NULL;
}

/* The frame in a file's name, as rl_checkpoint_path puts it there. */
static bool frame_of(const char *file, const char *name, int *frame)
{
    size_t n = strlen(name), all = strlen(file), end = sizeof suffix - 1;
    char digits[32];
    long long number;
    if (all < n + 2 + end || strncmp(file, name, n) || file[n] != '.' || strcmp(file + all - end, suffix) ||
        all - n - 1 - end >= sizeof digits)
        return false;
    memcpy(digits, file + n + 1, all - n - 1 - end);
    digits[all - n - 1 - end] = 0;
    if (!rl_parse_int(digits, &number) || number < -2000000000 || number > 2000000000)
        return false;
    *frame = (int)number;
    return true;
}

static int ascending(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

rl_code rl_checkpoint_list(rl_arena *arena, const char *folder, const char *name, int **frames, size_t *n,
                           rl_error *err)
{
    size_t room = 0;
    *frames = NULL;
    *n = 0;
    DIR *dir = opendir(folder);
    if (!dir)
        return errno == ENOENT ? RL_OK
                               : rl_fail_file(err, RL_E_IO, folder, "cannot be read: %s", strerror(errno));
    rl_code code = RL_OK;
    for (struct dirent *d = readdir(dir); d && !code; d = readdir(dir)) {
        int frame;
        if (!frame_of(d->d_name, name, &frame))
            continue;
        if (*n == room) {
            room = room ? 2 * room : 16;
            int *grown = rl_arena_array(arena, room, sizeof *grown);
            code = grown ? RL_OK : rl_fail_memory(err, room * sizeof *grown);
            if (!code && *n)
                memcpy(grown, *frames, *n * sizeof *grown);
            *frames = grown;
        }
        if (!code)
            (*frames)[(*n)++] = frame;
    }
    closedir(dir);
    if (*n)
        qsort(*frames, *n, sizeof **frames, ascending);
    return code;
}
