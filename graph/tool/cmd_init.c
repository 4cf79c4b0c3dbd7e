/* `relit init`: a pipeline to start from. What it prints passes `relit check` as it is. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "graph/model/pass.h"
#include "graph/run/camera_header.h"
#include "graph/run/data_files.h"
#include "graph/run/shim_ocio.h"
#include "graph/tool/capture.h"
#include "graph/tool/tool.h"

/* ---- YAML ------------------------------------------------------------------------------------------------
 */

/* A text, quoted where YAML would take it for something else. */
static void add_text(rl_str *out, const char *text)
{
    rl_value_print(&(rl_value){.kind = RL_TEXT, .text = text}, out);
}

static void add_number(rl_str *out, double v)
{
    char text[32];
    rl_str_add(out, rl_format_double(v, text));
}

static void add_vector(rl_str *out, const char *key, const double v[3])
{
    rl_str_printf(out, ", %s: [", key);
    for (int i = 0; i < 3; i++) {
        rl_str_add(out, i ? ", " : "");
        add_number(out, v[i]);
    }
    rl_str_add(out, "]");
}

/* ---- lights ----------------------------------------------------------------------------------------------
 */

/* A length as a pipeline has it, in the capture's unit (metres); the unit's factor leaves noise behind the
 * digits.
 */
static double in_unit(double metres, double unit)
{
    return round(metres / unit * 1e9) / 1e9;
}

/* What area lights and lights with ies have besides. */
static void add_shape(rl_str *out, const rl_light_spec *l, double unit)
{
    const struct {
        const char *key;
        double metres;
    } lengths[] = {{"radius", l->radius_m}, {"width", l->width_m}, {"height", l->height_m}};
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++)
        if (lengths[i].metres > 0) {
            rl_str_printf(out, ", %s: ", lengths[i].key);
            add_number(out, in_unit(lengths[i].metres, unit));
        }
    if (l->type == RL_LIGHT_RECT || l->ies)
        add_vector(out, "up", l->up);
    if (l->two_sided)
        rl_str_add(out, ", two_sided: true");
    if (l->ies) {
        rl_str_add(out, ", ies: ");
        add_text(out, l->ies);
    }
}

static void add_shadow(rl_str *out, const rl_manifest *m, const rl_light_spec *l)
{
    if (l->shadow != RL_SHADOW_LAYER) {
        rl_str_add(out, l->shadow == RL_SHADOW_SCREEN ? ", shadow: screen" : ", shadow: none");
        return;
    }
    for (int i = 0; i < m->n_layers; i++)
        if (m->layers[i].id == RL_LAYER_SHADOW && !strcmp(m->layers[i].light, l->shadow_layer)) {
            rl_str_add(out, ", shadow: ");
            add_text(out, l->shadow_layer);
            return;
        }
}

static void add_light(rl_str *out, const rl_manifest *m, const rl_light_spec *l)
{
    double position[3];
    for (int i = 0; i < 3; i++)
        position[i] = in_unit(l->position_m[i], m->unit);
    rl_str_add(out, "#  ");
    add_text(out, l->name);
    rl_str_printf(out, ": {type: %s", rl_light_type_names[l->type]);
    if (l->type != RL_LIGHT_DIRECTIONAL)
        add_vector(out, "position", position);
    if (l->direction[0] != 0 || l->direction[1] != 0 || l->direction[2] != 0)
        add_vector(out, "direction", l->direction);
    add_shape(out, l, m->unit);
    if (l->type == RL_LIGHT_SPOT) {
        rl_str_add(out, ", angle: ");
        add_number(out, round(l->angle * 180 / 3.14159265358979323846 * 1e6) / 1e6);
        rl_str_add(out, ", blend: ");
        add_number(out, l->blend);
    }
    if (l->has_amount || l->amount[0] != 1 || l->amount[1] != 1 || l->amount[2] != 1)
        add_vector(out, l->has_amount ? rl_light_unit_names[l->unit] : "color", l->amount);
    if (l->exposure != 0) {
        rl_str_add(out, ", exposure: ");
        add_number(out, l->exposure);
    }
    if ((l->unit >= RL_LIGHT_CANDELA || !l->has_amount) && l->efficacy != 683) {
        rl_str_add(out, ", efficacy: ");
        add_number(out, l->efficacy);
    }
    if (l->kelvin > 0) {
        rl_str_add(out, ", temperature: ");
        add_number(out, l->kelvin);
    }
    if (l->duv != 0) {
        rl_str_add(out, ", tint: ");
        add_number(out, l->duv);
    }
    if (strcmp(l->colorspace, "lin_rec709")) {
        rl_str_add(out, ", colorspace: ");
        add_text(out, l->colorspace);
    }
    if (l->in_camera_space)
        rl_str_add(out, ", space: camera");
    if (!l->enabled)
        rl_str_add(out, ", enabled: false");
    add_shadow(out, m, l);
    rl_str_add(out, "}\n");
}

static void add_lights(rl_str *out, const rl_manifest *m)
{
    if (m->lights.n) {
        rl_str_add(
            out,
            "\n# The capture's own lights are used, as they were recorded. Uncomment to re-light:\n"
            "# intensity in W/sr, lengths in the capture's unit, shadow: a layer, screen (found in the depth "
            "buffer, slower) or none.\n"
            "#lights:\n");
        for (size_t i = 0; i < m->lights.n; i++)
            add_light(out, m, &m->lights.light[i]);
        return;
    }
    rl_str_add(out,
               "\n# The capture has no lights. One to begin with, beside the camera: intensity in W/sr. With "
               "shadow: screen\n"
               "# its shadows are found in the depth buffer, which takes longer (relit passes lighting).\n"
               "lights:\n"
               "  key: {type: point, space: camera");
    const double beside[3] = {in_unit(-0.5, m->unit), in_unit(0.5, m->unit), 0};
    add_vector(out, "position", beside);
    rl_str_add(out, ", intensity: 2, shadow: none}\n");
}

/* ---- materials -------------------------------------------------------------------------------------------
 */

/* Scattering distances d that suit a material of such a name, red, green, blue. */
typedef struct guess {
    const char *word, *profile, *mm;
} guess;

static const guess guesses[] = {
    {"skin", "skin", "[3.0, 1.2, 0.7]"},
    {"face", "skin", "[3.0, 1.2, 0.7]"},
    {"head", "skin", "[3.0, 1.2, 0.7]"},
    {"body", "skin", "[3.0, 1.2, 0.7]"},
    {"wax", "wax", "[6, 5, 3]"},
    {"candle", "wax", "[6, 5, 3]"},
    {"marble", "marble", "[8.5, 5.6, 4.0]"},
};

static const guess *guess_for(const char *name)
{
    for (size_t i = 0; i < sizeof guesses / sizeof *guesses; i++)
        if (strcasestr(name, guesses[i].word))
            return &guesses[i];
    return NULL;
}

static void add_profiles(rl_str *out, const rl_manifest *m)
{
    bool any = false;
    rl_str_add(out, "\n# What scatters, and how far: d = 1/s of Burley's profile, red, green, blue. Nothing "
                    "does until a\n"
                    "# profile is named in materials. These are guesses");
    rl_str_add(out, " from the names of the materials:\n#profiles:\n");
    for (size_t i = 0; i < sizeof guesses / sizeof *guesses; i++) {
        bool wanted = false, repeated = false;
        for (size_t k = 0; k < m->n_stencil_names; k++) {
            const guess *g = guess_for(m->stencil_names[k].name);
            wanted = wanted || (g && g->profile == guesses[i].profile);
        }
        for (size_t k = 0; k < i; k++)
            repeated = repeated || guesses[k].profile == guesses[i].profile;
        if (wanted && !repeated)
            rl_str_printf(out, "#  %s: {scatter_distance_mm: %s}\n", guesses[i].profile, guesses[i].mm);
        any = any || wanted;
    }
    if (!any)
        rl_str_printf(out, "#  skin: {scatter_distance_mm: %s}\n", guesses[0].mm);
}

/* A stencil name may hold what a material's name may not. */
static bool is_name(const char *text)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    static const char all[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    return text[0] && strchr(letters, text[0]) && !text[strspn(text, all)] && strcmp(text, "default");
}

/* The ids of the i-th name and of those behind it that are called the same: "6", "[6, 7]". */
static void add_ids(rl_str *out, const rl_manifest *m, size_t i)
{
    rl_str ids = {0};
    size_t n = 0;
    for (size_t k = i; k < m->n_stencil_names; k++)
        if (k == i || !strcmp(m->stencil_names[k].name, m->stencil_names[i].name))
            rl_str_printf(&ids, "%s%lld", n++ ? ", " : "", (long long)m->stencil_names[k].id);
    rl_str_printf(out, n > 1 ? "[%s]" : "%s", rl_str_text(&ids));
    out->failed |= ids.failed;
    rl_str_free(&ids);
}

static bool named_before(const rl_manifest *m, size_t i)
{
    for (size_t k = 0; k < i; k++)
        if (!strcmp(m->stencil_names[k].name, m->stencil_names[i].name))
            return true;
    return false;
}

/* `ids`: those of the first frame, for a capture that names none. */
static void add_materials(rl_str *out, const rl_manifest *m, const uint32_t *ids, size_t n_ids)
{
    rl_str_add(out, "\n# Stencil ids and how they are shaded. roughness and specular here win over the "
                    "capture's layers.\n"
                    "materials:\n");
    for (size_t i = 0; i < m->n_stencil_names; i++) {
        const char *name = m->stencil_names[i].name;
        long long id = (long long)m->stencil_names[i].id;
        const guess *g = guess_for(name);
        if (named_before(m, i))
            continue;
        rl_str_add(out, "  ");
        if (is_name(name))
            add_text(out, name);
        else
            rl_str_printf(out, "id-%lld", id);
        rl_str_add(out, ": {stencil: ");
        add_ids(out, m, i);
        rl_str_add(out, "}");
        if (g) {
            rl_str_add(out, "    # {stencil: ");
            add_ids(out, m, i);
            rl_str_printf(out, ", profile: %s}", g->profile);
        }
        if (!is_name(name)) {
            rl_str_add(out, g ? ", " : "    # ");
            add_text(out, name);
        }
        rl_str_add(out, "\n");
    }
    for (size_t i = 0; i < n_ids; i++)
        rl_str_printf(out, "  id-%u: {stencil: %u}\n", ids[i], ids[i]);
    rl_str_add(out, "  default: {}    # every other id\n");
}

/* ---- outputs ---------------------------------------------------------------------------------------------
 */

/* The display and view of the preview, from the config that a run would take. */
static rl_code choose_view(rl_arena *arena, const char **display, const char **view, rl_error *err)
{
    const char *env = getenv("OCIO");
    const char *path = env && *env ? env : rl_data_path(arena, "color/relit.ocio");
    rl_ocio *ocio = NULL;
    rl_ocio_names names = {0};
    if (!path)
        return rl_fail(
            err, RL_E_COLOR, RL_NOWHERE,
            "relit's own colour config color/relit.ocio is not found; set $RELIT_DATA to the folder "
            "that holds it, or $OCIO to a config");
    rl_code code = rl_ocio_open(path, &ocio, err);
    if (!code)
        code = rl_ocio_list_names(ocio, RL_OCIO_DISPLAYS, NULL, arena, &names, err);
    *display = !code && names.n ? names.names[0] : NULL;
    if (!code && *display)
        code = rl_ocio_list_names(ocio, RL_OCIO_VIEWS, *display, arena, &names, err);
    *view = !code && *display && names.n ? names.names[0] : NULL;
    rl_ocio_free(&ocio);
    return code;
}

static void add_graph(rl_str *out, const rl_manifest *m, const char *display, const char *view)
{
    bool backs = rl_manifest_layer(m, "back_depth") && rl_manifest_layer(m, "back_normal");
    rl_str_add(out, "\ngraph:\n"
                    "  light: {pass: lighting}\n"
                    "  sss:   {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: auto}\n"
                    "  aa:    {pass: taa, in: {color: sss.color}}\n");
    if (backs)
        rl_str_add(out,
                   "# The capture has back faces. To gather the light that comes through from behind, give "
                   "profiles\n"
                   "# `transmission: gather`, uncomment these two, and let sss take `lit: through.lit`:\n"
                   "#  behind:  {pass: back_lighting}\n"
                   "#  through: {pass: translucency, in: {back: behind.diffuse, lit: light.lit}}\n");
    rl_str_add(
        out,
        "\noutputs:\n"
        "  beauty:  {image: aa.color, file: \"{capture}.{frame:04}.exr\", type: half, compression: zip}\n"
        "  preview: {image: aa.color, file: \"{capture}.{frame:04}.png\"");
    if (view) {
        rl_str_add(out, ", display: ");
        add_text(out, display);
        rl_str_add(out, ", view: ");
        add_text(out, view);
    }
    rl_str_add(out, "}\n");
}

/* A bare file whose header does not say where the camera is: no pipeline would run on it. */
static rl_code says_no_camera(rl_arena *arena, const rl_capture *capture, rl_error *err)
{
    double matrix[16];
    rl_exr *file = NULL;
    const rl_manifest *m = capture->manifest;
    if (capture->file || m->camera.matrix_source != RL_SOURCE_HEADER)
        return RL_OK;
    char *path = rl_capture_first(arena, m, 0);
    rl_code code = path ? rl_exr_open(path, 0, &file, err) : rl_fail_memory(err, 1);
    bool found = false;
    for (int p = 0; !code && p < rl_exr_parts(file); p++)
        found = found || rl_camera_header_matrix(file, p, m->camera.forward_z, matrix);
    if (!code && !found)
        code = rl_fail_file(
            err, RL_E_CONFIG, path,
            "the file does not say where its camera is; `relit inspect %s` prints a capture.yaml to "
            "begin with: save it, write camera.matrix and camera.fov_x there, and name it here",
            path);
    rl_exr_close(&file);
    return code;
}

int rl_cmd_init(rl_tool *tool, rl_error *err)
{
    const char *path = tool->args.operand, *display = NULL, *view = NULL;
    enum { MOST_IDS = 64 }; /* more would not be read; `default` catches them */
    uint32_t ids[MOST_IDS];
    size_t n_ids = 0;
    rl_capture capture;
    rl_str text = {0};
    if (rl_capture_find(tool->arena, path, &tool->report->log, &capture, err))
        return RL_EXIT_WRONG;
    if (!capture.missing && says_no_camera(tool->arena, &capture, err))
        return RL_EXIT_WRONG;
    if (capture.missing) {
        rl_fail_file(
            err, RL_E_CONFIG, path,
            "no preset finds all that relit needs (%s missing); `relit inspect %s` prints a capture.yaml to "
            "begin with: save it, complete it, and name it here",
            capture.missing, path);
        return RL_EXIT_WRONG;
    }
    if (!capture.manifest->n_stencil_names &&
        rl_capture_ids(tool->arena, capture.manifest, MOST_IDS, ids, &n_ids, err))
        return RL_EXIT_WRONG;
    if (choose_view(tool->arena, &display, &view, err))
        return RL_EXIT_WRONG;
    rl_str_add(
        &text,
        "# A pipeline to start from, printed by `relit init`. `relit passes` lists what a graph can hold.\n"
        "relit: 1\ncapture: ");
    add_text(&text, path);
    rl_str_add(&text, "    # relative to this file\n");
    add_profiles(&text, capture.manifest);
    add_materials(&text, capture.manifest, ids, n_ids);
    add_lights(&text, capture.manifest);
    add_graph(&text, capture.manifest, display, view);
    return rl_tool_print(tool, &text, err);
}
