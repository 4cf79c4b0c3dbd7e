/* Attributes of EXR files as text, for people. */
#include "graph/run/exr_core.h"

#include <string.h>

static void print_number(rl_exr_type type, double v, rl_str *out)
{
    char text[32];
    switch (type) {
    case RL_EXR_T_INT:
    case RL_EXR_T_V2I:
    case RL_EXR_T_V3I:
    case RL_EXR_T_BOX2I:
        rl_str_printf(out, "%.0f", v);
        break;
    case RL_EXR_T_DOUBLE:
    case RL_EXR_T_V2D:
    case RL_EXR_T_V3D:
    case RL_EXR_T_M33D:
    case RL_EXR_T_M44D:
        rl_str_add(out, rl_format_double(v, text));
        break;
    default:
        rl_str_add(out, rl_format_float((float)v, text));
    }
}

static void print_numbers(const rl_exr_value *v, rl_str *out)
{
    int n = rl_exr_type_numbers(v->type);
    rl_str_add(out, n > 1 ? "[" : "");
    for (int i = 0; i < n; i++) {
        rl_str_add(out, i ? " " : "");
        print_number(v->type, v->v[i], out);
    }
    rl_str_add(out, n > 1 ? "]" : "");
}

/* SMPTE 12M: binary-coded decimal digits between flags. */
static void print_timecode(uint32_t t, rl_str *out)
{
    unsigned frame = (t >> 4 & 3) * 10 + (t & 15), second = (t >> 12 & 7) * 10 + (t >> 8 & 15);
    unsigned minute = (t >> 20 & 7) * 10 + (t >> 16 & 15), hour = (t >> 28 & 3) * 10 + (t >> 24 & 15);
    rl_str_printf(out, "%02u:%02u:%02u%s%02u", hour, minute, second, t & 64 ? ";" : ":", frame);
}

static void print_text(const char *text, rl_str *out)
{
    size_t n = strlen(text), most = n;
    if (n > 200)
        for (most = 200; ((unsigned char)text[most] & 0xc0) == 0x80 && most > 196; most--)
            ; /* not in the middle of a UTF-8 character */
    for (size_t i = 0; i < most; i++) {
        unsigned char c = (unsigned char)text[i];
        rl_str_addn(out, c < 32 || c == 127 ? " " : text + i, 1); /* one line, and nothing a terminal obeys */
    }
    if (n > most)
        rl_str_printf(out, "… (%zu bytes)", n);
}

static void print_channels(const exr_attr_chlist_t *list, rl_str *out)
{
    for (int c = 0; c < list->num_channels; c++) {
        rl_str_add(out, c ? " " : "");
        print_text(list->entries[c].name.str, out);
        rl_str_printf(out, ":%s", rl_exr_pixel_name((rl_exr_pixel)list->entries[c].pixel_type));
    }
}

static void print_other(const exr_attribute_t *a, rl_str *out)
{
    static const char *const orders[] = {"increasing y", "decreasing y", "random"};
    switch (a->type) {
    case EXR_ATTR_COMPRESSION:
        rl_str_add(out, rl_exr_compression_name((rl_exr_compression)a->uc));
        break;
    case EXR_ATTR_LINEORDER:
        rl_str_add(out, a->uc < 3 ? orders[a->uc] : "unknown");
        break;
    case EXR_ATTR_ENVMAP:
        rl_str_add(out, a->uc == 0 ? "latlong" : "cube");
        break;
    case EXR_ATTR_CHLIST:
        print_channels(a->chlist, out);
        break;
    case EXR_ATTR_TILEDESC:
        rl_str_printf(out, "%u x %u, mode %u", a->tiledesc->x_size, a->tiledesc->y_size,
                      a->tiledesc->level_and_round);
        break;
    case EXR_ATTR_STRING_VECTOR:
        for (int i = 0; i < a->stringvector->n_strings; i++) {
            rl_str_add(out, i ? ", " : "");
            print_text(a->stringvector->strings[i].str, out);
        }
        break;
    case EXR_ATTR_FLOAT_VECTOR:
        rl_str_printf(out, "(%d floats)", a->floatvector->length);
        break;
    case EXR_ATTR_PREVIEW:
        rl_str_printf(out, "(%u x %u pixels)", a->preview->width, a->preview->height);
        break;
    case EXR_ATTR_OPAQUE:
        rl_str_printf(out, "(%d bytes)", a->opaque->size);
        break;
    default:
        rl_str_add(out, "(not shown)");
    }
}

void rl_exr_attr_print(const rl_exr *file, int part, size_t i, rl_str *out)
{
    const exr_attribute_t *a = rl_exr_attr_raw(file, part, i);
    rl_exr_value v;
    if (!a)
        return;
    rl_exr_attr_at(file, part, i, NULL, NULL, &v);
    if (v.type == RL_EXR_T_STRING)
        print_text(v.text, out);
    else if (v.type == RL_EXR_T_TIMECODE)
        print_timecode((uint32_t)v.v[0], out);
    else if (v.type == RL_EXR_T_RATIONAL)
        rl_str_printf(out, "%.0f/%.0f", v.v[0], v.v[1]);
    else if (v.type == RL_EXR_T_OTHER)
        print_other(a, out);
    else
        print_numbers(&v, out);
}
