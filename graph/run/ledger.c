#include "graph/run/ledger.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/file_hash.h"

struct rl_ledger {
    rl_arena arena;
    rl_frames frames;
    rl_ledger_line *entries; /* [frames.n] */
    pthread_mutex_t mutex;   /* guards them while one thread writes and another asks for inputs */
    rl_ledger_line none;
    const char *path; /* of this process's file */
    int fd;           /* -1: nothing written yet */
};

static const char suffix[] = ".ledger";

/* ---- lines -----------------------------------------------------------------------------------------------
 */

static const char kinds[] = "-bdf", broken_kinds[] = "-BDF";

/* "TIME KIND FRAME CHAIN STAT CONTENT CHECK", KIND upper case for broken inputs: a line that was cut short
 * does not check. */
static int print_line(char *out, size_t size, int frame, const rl_ledger_line *e)
{
    int n = snprintf(out, size, "%016" PRIx64 " %c %d %016" PRIx64 " %016" PRIx64 " %016" PRIx64, e->time,
                     (e->inputs.broken ? broken_kinds : kinds)[e->kind], frame, e->chain, e->inputs.stat,
                     e->inputs.content);
    unsigned check = (unsigned)XXH3_64bits(out, (size_t)n);
    return n + snprintf(out + n, size - (size_t)n, " %08x\n", check);
}

static bool parse_line(const char *line, size_t length, int *frame, rl_ledger_line *e)
{
    char kind;
    unsigned check;
    *e = (rl_ledger_line){0};
    if (length < 10 || length > 200 ||
        sscanf(line, "%" SCNx64 " %c %d %" SCNx64 " %" SCNx64 " %" SCNx64 " %x", &e->time, &kind, frame,
               &e->chain, &e->inputs.stat, &e->inputs.content, &check) != 7)
        return false;
    e->inputs.broken = kind < 'a';
    const char *all = e->inputs.broken ? broken_kinds : kinds, *at = strchr(all, kind);
    e->kind = at ? (rl_ledger_kind)(at - all) : RL_LEDGER_NONE;
    return e->kind != RL_LEDGER_NONE && check == (unsigned)XXH3_64bits(line, length - 9);
}

static void take_line(rl_ledger *l, const char *line, size_t length)
{
    int frame;
    rl_ledger_line e;
    if (!parse_line(line, length, &frame, &e))
        return;
    long i = rl_frames_find(&l->frames, frame);
    if (i >= 0 && e.time >= l->entries[i].time)
        l->entries[i] = e;
}

static rl_code read_file(rl_ledger *l, const char *path, rl_error *err)
{
    char *text = NULL;
    size_t size;
    rl_code code = rl_file_read(path, &text, &size, err);
    for (char *at = text; !code && *at;) {
        size_t n = strcspn(at, "\n");
        if (at[n] == '\n')
            take_line(l, at, n);
        at += n + (at[n] == '\n');
    }
    rl_free(text);
    return code;
}

/* ---- the folder ------------------------------------------------------------------------------------------
 */

/* "NAME.ledger" and "NAME.TAG.ledger"; a tag has no dot, so that names that begin alike stay apart. */
static bool is_ledger_of(const char *file, const char *name)
{
    size_t n = strlen(name), all = strlen(file), end = sizeof suffix - 1;
    if (all < n + end || strncmp(file, name, n) || strcmp(file + all - end, suffix))
        return false;
    const char *middle = file + n;
    return all == n + end || (*middle == '.' && !memchr(middle + 1, '.', all - n - 1 - end));
}

static rl_code read_folder(rl_ledger *l, const char *folder, const char *name, rl_error *err)
{
    DIR *dir = opendir(folder);
    if (!dir)
        return errno == ENOENT ? RL_OK
                               : rl_fail_file(err, RL_E_IO, folder, "cannot be read: %s", strerror(errno));
    rl_code code = RL_OK;
    for (struct dirent *d = readdir(dir); d && !code; d = readdir(dir)) {
        if (!is_ledger_of(d->d_name, name))
            continue;
        const char *path = rl_path_join(&l->arena, folder, d->d_name);
        code = path ? read_file(l, path, err) : rl_fail_memory(err, strlen(d->d_name));
    }
    closedir(dir);
    return code;
}

char *rl_ledger_name(rl_arena *arena, const char *capture)
{
    char *name = rl_arena_printf(arena, "%s%s", capture[0] == '.' || !capture[0] ? "_" : "", capture);
    for (char *c = name; c && *c; c++)
        if (*c == '/')
            *c = '_';
    return name;
}

rl_code rl_ledger_open(const char *folder, const char *name, const char *tag, const rl_frames *frames,
                       rl_ledger **out, rl_error *err)
{
    rl_ledger *l = rl_calloc(1, sizeof *l);
    *out = l;
    if (!l)
        return rl_fail_memory(err, sizeof *l);
    pthread_mutex_init(&l->mutex, NULL);
    l->fd = -1;
    l->frames = *frames;
    l->entries = rl_arena_array(&l->arena, frames->n + 1, sizeof *l->entries);
    const char *file = rl_arena_printf(&l->arena, "%s%s%s%s", name, *tag ? "." : "", tag, suffix);
    l->path = file ? rl_path_join(&l->arena, folder, file) : NULL;
    rl_code code = l->entries && l->path ? read_folder(l, folder, name, err) : rl_fail_memory(err, frames->n);
    if (code)
        rl_ledger_close(out);
    return code;
}

void rl_ledger_close(rl_ledger **ledger)
{
    rl_ledger *l = *ledger;
    *ledger = NULL;
    if (!l)
        return;
    if (l->fd >= 0)
        close(l->fd);
    pthread_mutex_destroy(&l->mutex);
    rl_arena_free(&l->arena);
    rl_free(l);
}

const rl_ledger_line *rl_ledger_find(const rl_ledger *l, int frame)
{
    long i = rl_frames_find(&l->frames, frame);
    return i < 0 ? &l->none : &l->entries[i];
}

static uint64_t wall_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

rl_code rl_ledger_write(rl_ledger *l, int frame, rl_ledger_kind kind, uint64_t chain, const rl_inputs *inputs,
                        rl_error *err)
{
    char line[256];
    long i = rl_frames_find(&l->frames, frame);
    if (i < 0)
        return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "frame %d is not of this capture", frame);
    rl_ledger_line *e = &l->entries[i];
    uint64_t now = wall_ns();
    pthread_mutex_lock(&l->mutex);
    *e = (rl_ledger_line){kind, now > e->time ? now : e->time + 1, chain, *inputs};
    pthread_mutex_unlock(&l->mutex);
    if (l->fd < 0)
        l->fd = open(l->path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    int n = print_line(line, sizeof line, frame, e);
    /* One call: a process that is killed leaves a whole line or none. A line that a full disk cut short does
     * not check, and neither does the one that is appended to it: the frame is then made again. */
    if (l->fd < 0 || write(l->fd, line, (size_t)n) != n)
        return rl_fail_file(err, RL_E_IO, l->path, "cannot be written: %s", strerror(errno));
    return RL_OK;
}

/* ---- inputs ----------------------------------------------------------------------------------------------
 */

rl_inputs rl_ledger_inputs(rl_ledger *l, int frame, const char *const *paths, size_t n)
{
    rl_inputs in = {.stat = n};
    for (size_t i = 0; i < n; i++) {
        struct stat st;
        if (stat(paths[i], &st))
            return (rl_inputs){.missing = true};
        int64_t of_file[3] = {(int64_t)st.st_size, (int64_t)st.st_mtim.tv_sec, (int64_t)st.st_mtim.tv_nsec};
        in.stat = XXH3_64bits_withSeed(of_file, sizeof of_file, in.stat);
    }
    pthread_mutex_lock(&l->mutex);
    rl_inputs known = rl_ledger_find(l, frame)->inputs;
    pthread_mutex_unlock(&l->mutex);
    if (known.stat == in.stat && known.content) {
        in.content = known.content;
        return in;
    }
    in.missing = !rl_files_hash(paths, n, &in.content);
    return in;
}
