/* `relit inspect`: what files hold, and how relit would read them. */
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "graph/base/file.h"
#include "graph/tool/capture.h"
#include "graph/tool/inspect_guess.h"
#include "graph/tool/tool.h"

/* ---- one file -------------------------------------------------------------------------------------------
 */

static void print_window(rl_str *out, const char *name, rl_exr_box b)
{
    rl_str_printf(out, "    %s %d x %d at %d, %d\n", name, b.x1 - b.x0 + 1, b.y1 - b.y0 + 1, b.x0, b.y0);
}

static void print_channels(const rl_exr_part *part, rl_str *out)
{
    size_t width = 0;
    for (size_t i = 0; i < part->n_channels; i++)
        width = strlen(part->channels[i].name) > width ? strlen(part->channels[i].name) : width;
    rl_str_add(out, "    channels\n");
    for (size_t i = 0; i < part->n_channels; i++) {
        const rl_exr_channel *c = &part->channels[i];
        rl_str_printf(out, "      %-*s  %s", (int)width, c->name, rl_exr_pixel_name(c->type));
        if (c->x_sampling != 1 || c->y_sampling != 1)
            rl_str_printf(out, ", every %d x %d pixels (relit cannot read it)", c->x_sampling, c->y_sampling);
        rl_str_add(out, "\n");
    }
}

/* What the lines above have already said. */
static bool is_structure(const char *name)
{
    static const char *const names[] = {"channels", "compression", "dataWindow", "displayWindow",
                                        "tiles",    "type",        "name",       "lineOrder",
                                        "version",  "chunkCount"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(name, names[i]))
            return true;
    return false;
}

static void print_attributes(const rl_exr *file, int part, rl_str *out)
{
    rl_str_add(out, "    metadata\n");
    for (size_t i = 0; i < rl_exr_part_at(file, part)->n_attrs; i++) {
        const char *name, *type;
        rl_exr_attr_at(file, part, i, &name, &type, NULL);
        if (is_structure(name))
            continue;
        rl_str_printf(out, "      %s (%s): ", name, type);
        rl_exr_attr_print(file, part, i, out);
        rl_str_add(out, "\n");
    }
}

/* What files hold is a comment of the manifest that follows: so all that is printed can be saved as one. */
static void add_comment(const rl_str *text, rl_str *out)
{
    const char *line = rl_str_text(text);
    while (*line) {
        size_t n = strcspn(line, "\n");
        rl_str_add(out, n ? "# " : "#");
        rl_str_addn(out, line, n);
        rl_str_add(out, "\n");
        line += n + (line[n] == '\n');
    }
}

static rl_code list_file(const char *path, rl_str *out, rl_error *err)
{
    rl_exr *file = NULL;
    rl_code code = rl_exr_open(path, 0, &file, err);
    if (code)
        return code;
    rl_str_printf(out, "%s\n", path);
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        rl_str_printf(out, "  part %d", p);
        if (*part->name)
            rl_str_printf(out, " '%s'", part->name);
        rl_str_printf(out, ": %s%s, %s compression\n", part->deep ? "deep (relit cannot read it) " : "",
                      part->tiled ? "tiled" : "scanline", rl_exr_compression_name(part->compression));
        if (part->tiled)
            rl_str_printf(out, "    tiles of %d x %d\n", part->tile_width, part->tile_height);
        print_window(out, "data window   ", part->data_window);
        print_window(out, "display window", part->display_window);
        print_channels(part, out);
        print_attributes(file, p, out);
    }
    rl_exr_close(&file);
    return RL_OK;
}

static rl_code print_file(const char *path, rl_str *out, rl_error *err)
{
    rl_str text = {0};
    rl_code code = list_file(path, &text, err);
    if (!code && text.failed)
        code = rl_fail_memory(err, text.room);
    if (!code)
        add_comment(&text, out);
    rl_str_free(&text);
    return code;
}

/* ---- how relit would read it ----------------------------------------------------------------------------
 */

static rl_code print_mapping(rl_tool *tool, const rl_capture *capture, rl_str *out, rl_error *err)
{
    rl_str_add(out, "\n");
    if (!capture->file)
        return rl_inspect_guess(tool, capture, out, err);
    rl_str_printf(out, "# %s, as relit reads it\n", capture->file);
    rl_inspect_look(tool, capture->manifest, out);
    rl_manifest_print(capture->manifest, out);
    return RL_OK;
}

/* The files of the first frame, each once, and the manifest. */
static rl_code print_capture(rl_tool *tool, const char *path, rl_str *out, rl_error *err)
{
    rl_capture capture;
    rl_code code = rl_capture_find(tool->arena, path, &tool->report->log, &capture, err);
    for (int i = 0; !code && i < capture.manifest->n_patterns; i++) {
        char *first = rl_capture_first(tool->arena, capture.manifest, i);
        code = first ? print_file(first, out, err) : rl_fail_memory(err, strlen(path));
    }
    return code ? code : print_mapping(tool, &capture, out, err);
}

/* ---- a folder of files ----------------------------------------------------------------------------------
 */

/* "shot.0012.exr" -> "shot.####.exr": the last number of the name. */
static char *pattern_of(rl_arena *arena, const char *folder, const char *name)
{
    char *text = rl_path_join(arena, folder, name);
    if (!text)
        return NULL;
    char *end = text + strlen(text) - strlen(rl_path_extension(text));
    char *start = (char *)rl_path_name(text);
    while (end > start && !isdigit((unsigned char)end[-1]))
        end--;
    while (end > start && isdigit((unsigned char)end[-1]))
        *--end = '#';
    return text;
}

static int by_text(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* The patterns of the EXR files in a folder, sorted, each once. */
static rl_code list_patterns(rl_arena *arena, const char *folder, const char ***out, size_t *n, rl_error *err)
{
    DIR *dir = opendir(folder);
    size_t room = 0;
    rl_code code = RL_OK;
    *n = 0;
    *out = NULL;
    if (!dir)
        return rl_fail_file(err, RL_E_IO, folder, "cannot be read: %s", strerror(errno));
    for (struct dirent *entry; !code && (entry = readdir(dir));) {
        if (strcasecmp(rl_path_extension(entry->d_name), ".exr"))
            continue;
        const char **grown = *out;
        if (*n == room) {
            room = room ? 2 * room : 64;
            grown = rl_arena_array(arena, room, sizeof *grown);
            if (grown && *n)
                memcpy(grown, *out, *n * sizeof *grown);
        }
        char *pattern = grown ? pattern_of(arena, folder, entry->d_name) : NULL;
        if (!pattern)
            code = rl_fail_memory(err, room * sizeof *grown);
        else
            (*out = grown)[(*n)++] = pattern;
    }
    closedir(dir);
    if (code || !*n)
        return code;
    qsort(*out, *n, sizeof **out, by_text);
    size_t kept = 1;
    for (size_t i = 1; i < *n; i++)
        if (strcmp((*out)[i], (*out)[kept - 1]))
            (*out)[kept++] = (*out)[i];
    *n = kept;
    return RL_OK;
}

/* Whether a capture is torn into several sequences: none has all that relit needs. */
static rl_code find_torn(rl_tool *tool, const char *const *patterns, size_t n, bool *torn, rl_error *err)
{
    rl_code code = RL_OK;
    *torn = n > 1;
    for (size_t i = 0; i < n && !code && *torn; i++) {
        rl_capture capture;
        code = rl_capture_find(tool->arena, patterns[i], NULL, &capture, err);
        *torn = !code && capture.missing;
    }
    return code;
}

/* The first file of each sequence, and one manifest. */
static rl_code print_torn(rl_tool *tool, const char *const *patterns, size_t n, rl_str *out, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++) {
        rl_capture capture;
        code = rl_capture_find(tool->arena, patterns[i], NULL, &capture, err);
        char *first = code ? NULL : rl_capture_first(tool->arena, capture.manifest, 0);
        if (!code)
            code = first ? print_file(first, out, err) : rl_fail_memory(err, 1);
    }
    rl_str_add(out, "\n");
    return code ? code : rl_inspect_guess_files(tool, patterns, n, out, err);
}

static rl_code print_folder(rl_tool *tool, const char *folder, rl_str *out, rl_error *err)
{
    const char **patterns;
    size_t n;
    bool torn = false;
    rl_code code = list_patterns(tool->arena, folder, &patterns, &n, err);
    if (!code && !n)
        code = rl_fail_file(err, RL_E_IO, folder, "the folder holds no capture.yaml and no EXR file");
    if (!code)
        code = find_torn(tool, patterns, n, &torn, err);
    if (!code && torn)
        return print_torn(tool, patterns, n, out, err);
    for (size_t i = 0; !code && i < n; i++) {
        rl_str_printf(out, "%s# %s\n", i ? "\n" : "", patterns[i]);
        code = print_capture(tool, patterns[i], out, err);
    }
    return code;
}

/* One file: what it holds, and the manifest of the sequence that its number belongs to. */
static rl_code print_one(rl_tool *tool, const char *path, rl_str *out, rl_error *err)
{
    const char *folder = rl_path_folder(tool->arena, path);
    const char *pattern = folder ? pattern_of(tool->arena, folder, rl_path_name(path)) : NULL;
    rl_capture capture;
    if (!pattern)
        return rl_fail_memory(err, strlen(path));
    rl_code code = print_file(path, out, err);
    if (!code)
        code = rl_capture_find(tool->arena, pattern, &tool->report->log, &capture, err);
    return code ? code : print_mapping(tool, &capture, out, err);
}

/* `relit inspect DIR > DIR/capture.yaml`: the shell has made the file, and nothing is in it yet. */
static bool is_empty_file(const char *path)
{
    struct stat about;
    return !stat(path, &about) && S_ISREG(about.st_mode) && about.st_size == 0;
}

int rl_cmd_inspect(rl_tool *tool, rl_error *err)
{
    rl_str text = {0};
    const char *path = tool->args.operand;
    bool folder = rl_path_is_folder(path);
    char *manifest = folder ? rl_path_join(tool->arena, path, "capture.yaml") : NULL;
    rl_code code;
    if (folder && !manifest)
        code = rl_fail_memory(err, strlen(path));
    else if (folder && (!rl_path_exists(manifest) || is_empty_file(manifest)))
        code = print_folder(tool, path, &text, err);
    else if (!strcasecmp(rl_path_extension(path), ".exr") && rl_path_exists(path))
        code = print_one(tool, path, &text, err);
    else
        code = print_capture(tool, path, &text, err);
    if (!code)
        return rl_tool_print(tool, &text, err);
    rl_str_free(&text);
    return RL_EXIT_WRONG;
}
