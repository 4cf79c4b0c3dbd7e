#include "graph/tool/capture.h"

#include <ctype.h>
#include <glob.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/run/data_files.h"

static bool is_yaml(const char *path)
{
    const char *extension = rl_path_extension(path);
    return !strcmp(extension, ".yaml") || !strcmp(extension, ".yml");
}

/* The frame number's place in a pattern: a run of '#', or %d, %04d. NULL when there is none. */
static const char *number_in(const char *pattern, size_t *length)
{
    const char *name = rl_path_name(pattern), *at = strchr(name, '#');
    *length = at ? strspn(at, "#") : 0;
    for (const char *percent = strchr(name, '%'); !at && percent; percent = strchr(percent + 1, '%')) {
        size_t n = 1 + strspn(percent + 1, "0123456789");
        if (percent[n] == 'd') {
            at = percent;
            *length = n + 1;
        }
    }
    return at;
}

/* Everything but the number, with glob's own characters taken literally. */
static rl_code glob_text(rl_arena *arena, const char *pattern, const char *number, size_t length,
                         const char **out, rl_error *err)
{
    rl_str text = {0};
    for (const char *c = pattern; *c; c++) {
        if (c == number) {
            rl_str_add(&text, "*[0-9]");
            c += length - 1;
        } else {
            if (strchr("*?[\\", *c))
                rl_str_add(&text, "\\");
            rl_str_addn(&text, c, 1);
        }
    }
    *out = text.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&text));
    rl_str_free(&text);
    return *out ? RL_OK : rl_fail_memory(err, strlen(pattern));
}

/* Whether what stands for the number in a match is one: "*[0-9]" takes too much. */
static bool is_number(const char *match, const char *pattern, const char *number, size_t length)
{
    size_t head = (size_t)(number - pattern), tail = strlen(number + length), n = strlen(match);
    size_t i = head + (match[head] == '-');
    for (; i < n - tail; i++)
        if (!isdigit((unsigned char)match[i]))
            return false;
    return n > head + tail;
}

rl_code rl_capture_first(rl_arena *arena, const char *pattern, const char **out, rl_error *err)
{
    size_t length;
    const char *number = number_in(pattern, &length), *text;
    glob_t found = {0};
    *out = pattern;
    if (!number || rl_path_exists(pattern))
        return RL_OK;
    rl_code code = glob_text(arena, pattern, number, length, &text, err);
    if (code)
        return code;
    *out = NULL;
    long long first = 0;
    if (glob(text, GLOB_NOSORT, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i++) {
            const char *match = found.gl_pathv[i];
            long long value = atoll(match + (number - pattern));
            if (is_number(match, pattern, number, length) && (!*out || value < first)) {
                *out = match;
                first = value;
            }
        }
    }
    if (!*out)
        code = rl_fail_file(err, RL_E_IO, pattern, "there is no file of this pattern");
    else if (!(*out = rl_arena_strdup(arena, *out)))
        code = rl_fail_memory(err, strlen(pattern));
    globfree(&found);
    return code;
}

rl_code rl_capture_channels(rl_arena *arena, const rl_exr *file, rl_channel **out, size_t *n, rl_error *err)
{
    *n = 0;
    for (int p = 0; p < rl_exr_parts(file); p++)
        *n += rl_exr_part_at(file, p)->n_channels;
    *out = rl_arena_array(arena, *n, sizeof **out);
    if (!*out)
        return rl_fail_memory(err, *n * sizeof **out);
    size_t at = 0;
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels; i++, at++) {
            (*out)[at].name = rl_arena_strdup(arena, part->channels[i].name);
            (*out)[at].part = rl_arena_strdup(arena, part->name);
            if (!(*out)[at].name || !(*out)[at].part)
                return rl_fail_memory(err, strlen(part->name));
        }
    }
    return RL_OK;
}

/* Without a manifest: the preset that fits the first file's channels. */
static rl_code find_bare(rl_arena *arena, const char *path, const char *presets, const rl_log *log,
                         rl_capture *out, rl_error *err)
{
    rl_exr *file = NULL;
    const char *first;
    rl_channel *channels;
    size_t n;
    rl_preset_match match = {0};
    rl_code code = rl_capture_first(arena, path, &first, err);
    if (!code)
        code = rl_exr_open(first, 0, &file, err);
    if (!code)
        code = rl_capture_channels(arena, file, &channels, &n, err);
    if (!code)
        code = rl_preset_find(arena, presets, channels, n, &match, err);
    if (code)
        goto done;
    out->preset = match.name;
    out->missing = match.name ? match.missing_required ? match.missing : NULL : "every layer";
    if (!out->missing)
        code = rl_manifest_bare(arena, path, match.name, presets, log, &out->manifest, err);
    if (!code && out->manifest)
        code = rl_manifest_bind(arena, out->manifest, 0, first, channels, n, err);
done:
    rl_exr_close(&file);
    return code;
}

rl_code rl_capture_find(rl_arena *arena, const char *path, const rl_log *log, rl_capture *out, rl_error *err)
{
    const char *presets = rl_data_path(arena, "presets");
    *out = (rl_capture){0};
    if (!rl_path_is_folder(path) && !is_yaml(path)) {
        if (!presets)
            return rl_fail_file(
                err, RL_E_IO, path,
                "a bare EXR needs relit's presets, which are not found; set $RELIT_DATA to the "
                "folder that holds presets/, or write a capture.yaml");
        return find_bare(arena, path, presets, log, out, err);
    }
    out->file = is_yaml(path) ? path : rl_path_join(arena, path, "capture.yaml");
    if (!out->file)
        return rl_fail_memory(err, strlen(path));
    return rl_manifest_load(arena, path, presets, log, &out->manifest, err);
}
