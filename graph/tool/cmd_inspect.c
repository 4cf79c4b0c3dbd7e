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

static rl_code print_file(const char *path, rl_str *out, rl_error *err)
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
        rl_str_printf(out, ": %s%s, %s compression\n", part->deep ? "deep " : "",
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

/* ---- how relit would read it ----------------------------------------------------------------------------
 */

/* What no preset has found, to be filled in. */
static void print_gaps(const rl_manifest *m, rl_str *out)
{
    static const char *const forms[] = {
        [RL_LAYER_ALBEDO] = "{channels: [?, ?, ?], colorspace: lin_rec709}",
        [RL_LAYER_NORMAL] = "{channels: [?, ?, ?], space: world, encoding: signed}",
        [RL_LAYER_DEPTH] = "{channels: [?], kind: planar, empty: 1e10}",
        [RL_LAYER_STENCIL] = "{channels: [?]}",
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        if (rl_layer_types[i].required && !rl_manifest_layer(m, rl_layer_types[i].name))
            rl_str_printf(out, "  #%s: %s    # %s\n", rl_layer_types[i].name, forms[i],
                          rl_layer_types[i].help);
}

/* The manifest; behind `layers:` those that it lacks. */
static void print_with_gaps(const rl_manifest *m, rl_str *out)
{
    static const char head[] = "\nlayers:\n";
    rl_str text = {0};
    rl_manifest_print(m, &text);
    const char *at = strstr(rl_str_text(&text), head);
    size_t n = at ? (size_t)(at - rl_str_text(&text)) + sizeof head - 1 : text.length;
    out->failed |= text.failed;
    rl_str_addn(out, rl_str_text(&text), n);
    print_gaps(m, out);
    rl_str_add(out, rl_str_text(&text) + n);
    rl_str_free(&text);
}

static bool has_attribute(const rl_exr *file, const char *name)
{
    rl_exr_value v;
    for (int p = 0; p < rl_exr_parts(file); p++)
        if (rl_exr_attr(file, p, name, &v))
            return true;
    return false;
}

/* Says what a guess takes from the header that is not there, above the manifest. */
static rl_code print_camera_gaps(rl_arena *arena, const rl_manifest *m, rl_str *out, rl_error *err)
{
    rl_exr *file = NULL;
    const char *first = rl_capture_first(arena, m, 0);
    rl_code code = first ? rl_exr_open(first, 0, &file, err) : rl_fail_memory(err, 1);
    if (code)
        return code;
    if (m->camera.matrix_source == RL_SOURCE_HEADER && !has_attribute(file, "worldToCamera"))
        rl_str_add(out,
                   "# the file has no attribute worldToCamera: give camera.matrix, 16 numbers, rows listed, "
                   "for column\n# vectors\n");
    if (m->camera.fov_source == RL_SOURCE_HEADER && !has_attribute(file, "camera:fovx"))
        rl_str_add(out, "# the file has no attribute camera:fovx: give camera.fov_x, in degrees, if its "
                        "screenWindowWidth is not\n# the true one\n");
    rl_exr_close(&file);
    return RL_OK;
}

/* A guessed manifest is to be saved beside the files: their names in it are without a folder. */
static rl_code print_guess(rl_arena *arena, const rl_capture *capture, rl_str *out, rl_error *err)
{
    rl_manifest m = *capture->manifest;
    rl_pattern *patterns = rl_arena_array(arena, (size_t)m.n_patterns + 1, sizeof *patterns);
    const char *folder = m.n_patterns ? rl_path_folder(arena, m.patterns[0].path) : ".";
    if (!patterns || !folder)
        return rl_fail_memory(err, sizeof *patterns);
    for (int i = 0; i < m.n_patterns; i++) {
        patterns[i] = m.patterns[i];
        patterns[i].path = rl_path_name(m.patterns[i].path);
    }
    m.patterns = patterns;
    if (capture->missing)
        rl_str_printf(
            out,
            "# no preset finds all that relit needs: %s missing%s%s%s\n"
            "# to start from: fill in the channels (part: NAME too, where files have parts), take the # "
            "away,\n# check units and spaces, then save it as %s/capture.yaml\n",
            capture->missing, capture->preset ? " in '" : "", capture->preset ? capture->preset : "",
            capture->preset ? "', which fits best" : "", folder);
    else
        rl_str_printf(out,
                      "# guessed by preset '%s': check units and spaces, then save it as %s/capture.yaml\n",
                      capture->preset, folder);
    rl_code code = print_camera_gaps(arena, capture->manifest, out, err);
    print_with_gaps(&m, out);
    return code;
}

static rl_code print_mapping(rl_arena *arena, const rl_capture *capture, rl_str *out, rl_error *err)
{
    rl_str_add(out, "\n");
    if (!capture->file)
        return print_guess(arena, capture, out, err);
    rl_str_printf(out, "# %s, as relit reads it\n", capture->file);
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
    return code ? code : print_mapping(tool->arena, &capture, out, err);
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

static rl_code print_folder(rl_tool *tool, const char *folder, rl_str *out, rl_error *err)
{
    const char **patterns;
    size_t n;
    rl_code code = list_patterns(tool->arena, folder, &patterns, &n, err);
    if (!code && !n)
        code = rl_fail_file(err, RL_E_IO, folder, "the folder holds no capture.yaml and no EXR file");
    for (size_t i = 0; !code && i < n; i++) {
        rl_str_printf(out, "%s%s\n", i ? "\n" : "", patterns[i]);
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
    return code ? code : print_mapping(tool->arena, &capture, out, err);
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
