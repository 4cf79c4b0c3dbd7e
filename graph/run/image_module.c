#include "graph/run/image_module.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/file.h"
#include "graph/base/text.h"

#define NAME "relit_oiio.so"

#ifndef RL_MODULE_DIR
#define RL_MODULE_DIR "/usr/local/lib/relit"
#endif

/* What was tried, kept for the error message, and what was found. */
typedef struct search {
    const rl_oiio_module *module;
    rl_str tried;   /* folders */
    rl_str refusal; /* of a module that is there but does not load */
} search;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static search found;
static bool searched;

/* folder/NAME, when it is there. */
static void try_folder(search *s, const char *folder, size_t length, const char *below)
{
    typedef const rl_oiio_module *getter(void);
    rl_str path = {0};
    if (s->module || length == 0)
        return;
    rl_str_addn(&path, folder, length);
    rl_str_add(&path, below);
    rl_str_printf(&s->tried, "%s%s", s->tried.length ? ", " : "", rl_str_text(&path));
    rl_str_add(&path, "/" NAME);
    if (!path.failed && rl_path_exists(path.text)) {
        void *handle = dlopen(path.text, RTLD_NOW | RTLD_LOCAL);
        void *symbol = handle ? dlsym(handle, RL_OIIO_SYMBOL) : NULL;
        getter *get;
        memcpy(&get, &symbol, sizeof get); /* ISO C has no cast for this */
        const rl_oiio_module *module = symbol ? get() : NULL;
        if (module && module->version == RL_OIIO_VERSION)
            s->module = module;
        else
            rl_str_printf(&s->refusal, "; %s: %s", path.text, handle ? "is of another version" : dlerror());
    }
    rl_str_free(&path);
}

static void try_around(search *s, const char *file)
{
    const char *slash = strrchr(file, '/');
    if (!slash)
        return;
    size_t length = (size_t)(slash - file);
    try_folder(s, file, length, "");
    try_folder(s, file, length, "/..");
    try_folder(s, file, length, "/../lib/relit");
    try_folder(s, file, length, "/relit");
}

static void search_all(search *s)
{
    const char *list = getenv("RELIT_MODULES");
    while (list && *list) {
        size_t length = strcspn(list, ":");
        try_folder(s, list, length, "");
        list += length + (list[length] == ':');
    }
    char self[4096];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    if (n > 0) {
        self[n] = 0;
        try_around(s, self);
    }
    Dl_info library; /* where this code is from: librelit.so in somebody's program */
    if (dladdr(&found, &library) && library.dli_fname)
        try_around(s, library.dli_fname);
    try_folder(s, RL_MODULE_DIR, strlen(RL_MODULE_DIR), "");
}

const rl_oiio_module *rl_image_module(rl_error *err)
{
    pthread_mutex_lock(&lock);
    if (!searched)
        search_all(&found);
    searched = true;
    pthread_mutex_unlock(&lock);
    if (!found.module)
        rl_fail(err, RL_E_IO, RL_NOWHERE,
                "the module " NAME
                " (OpenImageIO: every image format but EXR) is not in %s%s; set RELIT_MODULES to "
                "its folder",
                rl_str_text(&found.tried), rl_str_text(&found.refusal));
    return found.module;
}
