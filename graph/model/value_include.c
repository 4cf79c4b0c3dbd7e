/* Configuration files that include others. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/value.h"

enum { MOST_FILES = 1000 }; /* diamonds of includes would otherwise double with every level */

/* A file that is being loaded, and the one that includes it. */
typedef struct opened {
    const char *path;
    dev_t device;
    ino_t inode;
    const struct opened *by;
} opened;

typedef struct loader {
    rl_arena *arena;
    rl_error *err;
    int files;
} loader;

static rl_code load(loader *l, const char *path, const rl_value *named_by, const opened *by, rl_value **out);

/* "a.yaml -> b.yaml -> a.yaml" */
static void print_chain(rl_str *s, const opened *last)
{
    if (!last)
        return;
    print_chain(s, last->by);
    rl_str_printf(s, "%s -> ", last->path);
}

static rl_code check_loop(loader *l, const opened *self, const rl_value *named_by)
{
    for (const opened *o = self->by; o; o = o->by) {
        if (o->device != self->device || o->inode != self->inode)
            continue;
        rl_str chain = {0};
        print_chain(&chain, self->by);
        rl_str_add(&chain, self->path);
        rl_code code = rl_fail(l->err, RL_E_CONFIG, named_by->where, "the includes go in a circle: %s",
                               rl_str_text(&chain));
        rl_str_free(&chain);
        return code;
    }
    return RL_OK;
}

/* What a file holds, a missing one reported where it is named. */
static rl_code load_one(loader *l, const char *path, const rl_value *named_by, rl_value **out)
{
    rl_error inner = {0};
    rl_code code = rl_yaml_load(l->arena, path, out, &inner);
    if (code == RL_E_IO && named_by)
        return rl_fail(l->err, RL_E_CONFIG, named_by->where, "cannot include '%s' (%s): %s", named_by->text,
                       path, inner.text);
    if (code)
        return rl_fail(l->err, code, (rl_where){inner.file[0] ? inner.file : NULL, inner.line, inner.column},
                       "%s", inner.text);
    if (named_by && (*out)->kind != RL_MAP && (*out)->kind != RL_NULL)
        return rl_value_wrong(*out, "include", "a file that holds a map", l->err);
    return RL_OK;
}

static rl_code add_include(loader *l, const rl_value *named, const opened *self, rl_value **sum)
{
    if (named->kind != RL_TEXT)
        return rl_value_wrong(named, "include", "a path", l->err);
    char *folder = rl_path_folder(l->arena, self->path);
    char *path = folder ? rl_path_join(l->arena, folder, named->text) : NULL;
    if (!path)
        return rl_fail_memory(l->err, strlen(self->path));
    rl_value *v;
    rl_code code = load(l, path, named, self, &v);
    if (code || v->kind == RL_NULL)
        return code;
    *sum = rl_value_merge(l->arena, *sum, v);
    return *sum ? RL_OK : rl_fail_memory(l->err, sizeof *v);
}

static rl_code load(loader *l, const char *path, const rl_value *named_by, const opened *by, rl_value **out)
{
    struct stat st = {0};
    opened self = {.path = path, .by = by};
    if (++l->files > MOST_FILES)
        return rl_fail(l->err, RL_E_CONFIG, named_by->where, "more than %d files are included", MOST_FILES);
    if (!stat(path, &st)) { /* one that is missing is reported when it is read */
        self.device = st.st_dev;
        self.inode = st.st_ino;
        if (check_loop(l, &self, named_by))
            return RL_E_CONFIG;
    }
    rl_code code = load_one(l, path, named_by, out);
    const rl_value *include = code ? NULL : rl_value_get(*out, "include");
    if (!include)
        return code;
    rl_value *sum = NULL;
    if (include->kind != RL_LIST)
        code = add_include(l, include, &self, &sum);
    for (size_t i = 0; !code && include->kind == RL_LIST && i < include->n; i++)
        code = add_include(l, include->items[i], &self, &sum);
    if (code)
        return code;
    rl_value gone = {.kind = RL_NULL};
    code = rl_value_set(l->arena, out, "include", &gone, l->err);
    if (code)
        return code;
    *out = rl_value_merge(l->arena, sum, *out);
    return *out ? RL_OK : rl_fail_memory(l->err, sizeof **out);
}

rl_code rl_config_load(rl_arena *arena, const char *path, rl_value **out, rl_error *err)
{
    loader l = {.arena = arena, .err = err};
    *out = NULL;
    rl_value *v = NULL;
    rl_code code = load(&l, path, NULL, NULL, &v);
    if (!code)
        *out = v;
    return code;
}
