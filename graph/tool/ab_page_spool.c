/* Where frames wait for the page: a file without a name, used again and again. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/tool/ab_page_parts.h"

static rl_code failed(rl_error *err, const char *what)
{
    return rl_fail(err, RL_E_IO, RL_NOWHERE, "the report's temporary file cannot be %s: %s", what,
                   strerror(errno));
}

/* File systems without O_TMPFILE get a name that lives for an instant. */
static int open_named(const char *folder)
{
    rl_str name = {0};
    rl_str_printf(&name, "%s/.report-XXXXXX", folder);
    int fd = name.failed ? -1 : mkostemp(name.text, O_CLOEXEC);
    if (fd >= 0)
        unlink(name.text);
    rl_str_free(&name);
    return fd;
}

rl_code rl_page_spool_open(const char *folder, rl_page_spool *out, rl_error *err)
{
    *out = (rl_page_spool){.fd = open(folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)};
    if (out->fd < 0)
        out->fd = open_named(folder);
    return out->fd < 0
               ? rl_fail_file(err, RL_E_IO, folder, "no temporary file can be made here: %s", strerror(errno))
               : RL_OK;
}

void rl_page_spool_close(rl_page_spool *spool)
{
    if (spool->fd >= 0)
        close(spool->fd);
    rl_free(spool->free);
    *spool = (rl_page_spool){.fd = -1};
}

rl_code rl_page_spool_take(rl_page_spool *spool, size_t room, rl_page_extent *out, rl_error *err)
{
    for (size_t i = 0; i < spool->n_free; i++) {
        if (spool->free[i].room < room)
            continue;
        *out = spool->free[i];
        spool->free[i] = spool->free[--spool->n_free];
        return RL_OK;
    }
    /* The place that it needs when it comes back, so that giving cannot fail. */
    rl_page_extent *grown = rl_realloc(spool->free, (spool->n_extents + 1) * sizeof *grown);
    if (!grown)
        return rl_fail_memory(err, sizeof *grown);
    spool->free = grown;
    spool->n_extents++;
    *out = (rl_page_extent){spool->end, room};
    spool->end += (off_t)room;
    return RL_OK;
}

void rl_page_spool_give(rl_page_spool *spool, rl_page_extent extent)
{
    if (extent.room)
        spool->free[spool->n_free++] = extent;
}

rl_code rl_page_spool_write(const rl_page_spool *spool, off_t at, const void *data, size_t size,
                            rl_error *err)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = pwrite(spool->fd, (const char *)data + done, size - done, at + (off_t)done);
        if (n < 0 && errno != EINTR)
            return failed(err, "written");
        if (n > 0)
            done += (size_t)n;
    }
    return RL_OK;
}

rl_code rl_page_spool_read(const rl_page_spool *spool, off_t at, void *data, size_t size, rl_error *err)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = pread(spool->fd, (char *)data + done, size - done, at + (off_t)done);
        if (n == 0)
            return rl_fail(err, RL_E_IO, RL_NOWHERE, "the report's temporary file is too short");
        if (n < 0 && errno != EINTR)
            return failed(err, "read");
        if (n > 0)
            done += (size_t)n;
    }
    return RL_OK;
}
