#include "graph/tool/guess.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

/* What renderers call a layer, letters and digits only, in lower case; the likelier first. A leading '='
 * wants the whole name, else it may be a part of it. */
static const char *const words[RL_LAYER_COUNT + 1][14] = {
    [RL_LAYER_ALBEDO] = {"albedo", "diffcol", "diffusecol", "diffusefilter", "basecolor", "=diffuse", "=kd"},
    [RL_LAYER_NORMAL] = {"worldnormal", "normalworld", "nworld", "=n", "=nn", "=ns", "=normal", "=normals",
                         "=shnormal", "=hitn", "=samplerinfo", "=vraysamplerinfo", "normal"},
    [RL_LAYER_DEPTH] = {"=depth", "=z", "zdepth", "worlddepth", "viewdepth", "depth", "=zbuffer"},
    [RL_LAYER_STENCIL] = {"indexma", "materialid", "materialindex", "mtlid", "indexob", "objectid",
                          "objectindex", "stencil", "instanceid", "shapeindex", "=id", "crypto",
                          "actorhitproxymask"},
    [RL_LAYER_THICKNESS] = {"thickness"},
    [RL_LAYER_MOTION] = {"=motion", "motionvector", "=velocity", "=vector"},
    [RL_LAYER_ROUGHNESS] = {"=roughness"},
    [RL_LAYER_METALLIC] = {"=metallic", "=metalness"},
    [RL_LAYER_EMISSION] = {"=emission", "=emit"},
    [RL_LAYER_COUNT] = {"pworld", "worldposition", "=position", "=p", "=pos"},
};

static const char *const thirds[][3] = {{"R", "G", "B"}, {"X", "Y", "Z"}, {"red", "green", "blue"}};
static const char *const singles[] = {"", "Z", "X", "R", "V", "Y", "A", "ID", "red"};

/* A channel's name in two: "ViewLayer.DiffCol" and "R"; a name without a dot is all layer. */
static size_t layer_length(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot ? (size_t)(dot - name) : strlen(name);
}

/* The last part of the layer's name, bare. */
static void bare(const char *name, char out[64])
{
    size_t end = layer_length(name), start = end, n = 0;
    while (start > 0 && name[start - 1] != '.')
        start--;
    for (size_t i = start; i < end && n + 1 < 64; i++)
        if (isalnum((unsigned char)name[i]))
            out[n++] = (char)tolower((unsigned char)name[i]);
    out[n] = 0;
}

static bool is_like(const char *name, const char *word)
{
    char text[64];
    bare(name, text);
    return word[0] == '=' ? !strcmp(text, word + 1) : strstr(text, word) != NULL;
}

static const char *suffix(const char *name)
{
    return name[layer_length(name)] ? strrchr(name, '.') + 1 : "";
}

static const rl_channel *find(const rl_channel *channels, size_t n, const rl_channel *like, const char *end)
{
    size_t length = layer_length(like->name);
    for (size_t i = 0; i < n; i++) {
        const rl_channel *c = &channels[i];
        bool same_part = !strcmp(c->part ? c->part : "", like->part ? like->part : "");
        if (same_part && layer_length(c->name) == length && !strncmp(c->name, like->name, length) &&
            !strcasecmp(suffix(c->name), end))
            return c;
    }
    return NULL;
}

/* The channels of the layer that `first` belongs to, when it has as many as are wanted. */
static bool take(const rl_channel *channels, size_t n, const rl_channel *first, int wanted, rl_guess *out)
{
    *out = (rl_guess){.part = first->part && first->part[0] ? first->part : NULL};
    if (wanted == 1) {
        for (size_t i = 0; i < sizeof singles / sizeof *singles; i++)
            if (!strcasecmp(suffix(first->name), singles[i])) {
                out->names[0] = first->name;
                return true;
            }
        return false;
    }
    for (size_t t = 0; t < sizeof thirds / sizeof *thirds; t++) {
        int have = 0;
        for (; have < wanted; have++) {
            const rl_channel *c = find(channels, n, first, thirds[t][have]);
            if (!c)
                break;
            out->names[have] = c->name;
        }
        if (have == wanted)
            return true;
    }
    return false;
}

bool rl_guess_layer(rl_layer_id id, const rl_channel *channels, size_t n, rl_guess *out)
{
    int wanted = id == RL_LAYER_COUNT ? 3 : rl_layer_types[id].channels;
    for (const char *const *word = words[id]; *word && word < words[id] + 14; word++) {
        bool hashed = !strcmp(*word, "crypto") || !strcmp(*word, "actorhitproxymask");
        for (size_t i = 0; i < n; i++) {
            if (!is_like(channels[i].name, *word))
                continue;
            size_t length =
                layer_length(channels[i].name); /* Cryptomatte's first rank is layer00, its id in R */
            if (hashed && (length < 2 || strncmp(channels[i].name + length - 2, "00", 2) ||
                           strcasecmp(suffix(channels[i].name), "R")))
                continue;
            if (!take(channels, n, &channels[i], wanted, out))
                continue;
            out->hashed = hashed;
            return true;
        }
    }
    return false;
}
