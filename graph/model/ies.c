#include "graph/model/ies.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"

static const double pi = 3.14159265358979323846;
static const double most_candela = 1e30;

typedef struct reader {
    const char *at, *name;
    const char *start; /* of the line */
    int line, column;  /* of the word read last */
    bool lamp_factor;  /* before 2002 */
    rl_arena *arena;
    rl_error *err;
} reader;

/* As the file has it: angles in degrees, rising; candela by horizontal angle, then vertical. */
typedef struct raw {
    int vertical, horizontal;
    double *down, *around, *candela;
} raw;

static rl_code wrong(const reader *r, int line, const char *what)
{
    return rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, line, r->column}, "%s", what);
}

static rl_code unfit(const reader *r, const char *what, double found, const char *expected)
{
    return rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, r->line, r->column}, "%s: expected %s, found %g",
                   what, expected, found);
}

/* ---- words -----------------------------------------------------------------------------------------------
 */

/* The line at hand in the arena, without its end; moves to the next. NULL when there is none or memory is
 * out. */
static const char *next_line(reader *r)
{
    if (!*r->at)
        return NULL;
    size_t n = strcspn(r->at, "\r\n");
    char *line = rl_arena_strndup(r->arena, r->at, n);
    r->at += n;
    r->at += *r->at == '\r' && r->at[1] == '\n' ? 2 : *r->at ? 1 : 0;
    r->start = r->at;
    r->line++;
    return line;
}

/* A number, with commas and white space in front. */
static rl_code read_number(reader *r, const char *what, double *out)
{
    char word[64];
    while (*r->at && (isspace((unsigned char)*r->at) || *r->at == ',')) {
        bool ends = *r->at == '\n' || (*r->at == '\r' && r->at[1] != '\n');
        r->line += ends;
        r->start = ends ? r->at + 1 : r->start;
        r->at++;
    }
    size_t n = strcspn(r->at, " \t\r\n\v\f,");
    r->column = (int)(r->at - r->start) + 1;
    rl_where where = {r->name, r->line, r->column};
    if (!n)
        return rl_fail(r->err, RL_E_FORMAT, where, "expected %s, found the end of the file", what);
    memcpy(word, r->at, n < sizeof word ? n : sizeof word - 1);
    word[n < sizeof word ? n : sizeof word - 1] = 0;
    r->at += n;
    if (n >= sizeof word || !rl_parse_double(word, out) || !isfinite(*out))
        return rl_fail(r->err, RL_E_FORMAT, where, "expected %s, found '%s'", what, word);
    return RL_OK;
}

static rl_code read_count(reader *r, const char *what, int *out)
{
    double v = 0;
    rl_code code = read_number(r, what, &v);
    if (!code && !(v >= 1 && v <= RL_IES_MOST_ANGLES && v == floor(v)))
        return rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, r->line, r->column},
                       "%s: expected 1 to %d, found %g", what, RL_IES_MOST_ANGLES, v);
    *out = code ? 0 : (int)v;
    return code;
}

/* ---- the file --------------------------------------------------------------------------------------------
 */

static rl_code read_head(reader *r)
{
    if (!strncmp(r->at, "\xef\xbb\xbf", 3)) /* a byte order mark of some editors */
        r->at += 3;
    const char *line = next_line(r);
    if (!line || (strncmp(line, "IESNA", 5) && strncmp(line, "IES:", 4)))
        return rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, 1, 1},
                       "not a photometric file: its first line is not 'IESNA…' or 'IES:…' (LM-63-1991 or "
                       "later), but '%.40s'",
                       line ? line : "");
    r->lamp_factor = !strncmp(line, "IESNA91", 7) || strstr(line, "LM-63-199");
    while ((line = next_line(r)))
        if (!strncmp(line, "TILT=", 5))
            break;
    if (!line)
        return wrong(r, r->line, "expected a line 'TILT=NONE', found the end of the file");
    const char *tilt = line + 5;
    while (*tilt == ' ')
        tilt++;
    if (strncmp(tilt, "NONE", 4))
        return rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, r->line - 1, 6},
                       "TILT=%s: only files with TILT=NONE can be used", tilt);
    return RL_OK;
}

/* Ten numbers, then three; gives what candela are multiplied with. */
static rl_code read_sizes(reader *r, raw *f, double *scale)
{
    double lamps, lumens, multiplier = 0, type = 0, skip, ballast = 0, factor = 0;
    rl_code code = read_number(r, "the number of lamps", &lamps);
    if (!code)
        code = read_number(r, "lumens per lamp", &lumens);
    if (!code)
        code = read_number(r, "the candela multiplier", &multiplier);
    if (!code && !(multiplier > 0))
        code = unfit(r, "the candela multiplier", multiplier, "above 0");
    if (!code)
        code = read_count(r, "the number of vertical angles", &f->vertical);
    if (!code)
        code = read_count(r, "the number of horizontal angles", &f->horizontal);
    if (!code)
        code = read_number(r, "the photometric type", &type);
    if (!code && type != 1)
        code = rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, r->line, r->column},
                       "photometric type %g (%s): only type C (1) can be used", type,
                       type == 2   ? "B"
                       : type == 3 ? "A"
                                   : "unknown");
    for (int i = 0; i < 4 && !code; i++)
        code = read_number(r, i ? "a size of the lamp" : "the type of units", &skip);
    if (!code)
        code = read_number(r, "the ballast factor", &ballast);
    if (!code && !(ballast > 0))
        code = unfit(r, "the ballast factor", ballast, "above 0");
    if (!code)
        code = read_number(r, "the ballast-lamp factor", &factor);
    if (!code && !(factor >= 0))
        code = unfit(r, "the ballast-lamp factor", factor, "at least 0");
    if (!code)
        code = read_number(r, "the watts", &skip);
    *scale = multiplier * ballast * (r->lamp_factor && factor > 0 ? factor : 1); /* 0 in some files */
    return code;
}

static rl_code read_angles(reader *r, const char *what, int n, double **out)
{
    rl_code code = RL_OK;
    *out = rl_arena_array(r->arena, (size_t)n, sizeof **out);
    if (!*out)
        return rl_fail_memory(r->err, (size_t)n * sizeof **out);
    for (int i = 0; i < n && !code; i++) {
        code = read_number(r, what, &(*out)[i]);
        if (!code && i > 0 && !((*out)[i] > (*out)[i - 1]))
            code = rl_fail(r->err, RL_E_FORMAT, (rl_where){r->name, r->line, r->column},
                           "%s do not rise: %g follows %g", what, (*out)[i], (*out)[i - 1]);
    }
    return code;
}

static bool spans(const double *a, int n, double first, double last)
{
    return fabs(a[0] - first) < 1e-3 && fabs(a[n - 1] - last) < 1e-3;
}

static rl_code check_angles(reader *r, const raw *f)
{
    const double *d = f->down, *h = f->around;
    int v = f->vertical, n = f->horizontal;
    rl_where where = {r->name, r->line, r->column};
    if (v < 2 || !(spans(d, v, 0, 90) || spans(d, v, 90, 180) || spans(d, v, 0, 180)))
        return rl_fail(r->err, RL_E_FORMAT, where,
                       "vertical angles from %g to %g: of type C they go from 0 to 90, 90 to 180 or 0 to 180",
                       d[0], d[v - 1]);
    bool fits =
        n == 1 ? fabs(h[0]) < 1e-3
               : spans(h, n, 0, 90) || spans(h, n, 0, 180) || spans(h, n, 90, 270) || spans(h, n, 0, 360);
    return fits ? RL_OK
                : rl_fail(r->err, RL_E_FORMAT, where,
                          "horizontal angles from %g to %g: of type C they are 0, or go from 0 to 90, 180 or "
                          "360 or "
                          "from 90 to 270",
                          h[0], h[n - 1]);
}

static rl_code read_candela(reader *r, raw *f, double scale, double *most)
{
    size_t n = (size_t)f->vertical * (size_t)f->horizontal;
    f->candela = rl_arena_array(r->arena, n, sizeof *f->candela);
    if (!f->candela)
        return rl_fail_memory(r->err, n * sizeof *f->candela);
    rl_code code = RL_OK;
    *most = 0;
    for (size_t i = 0; i < n && !code; i++) {
        code = read_number(r, "candela", &f->candela[i]);
        if (!code && f->candela[i] < 0)
            code = unfit(r, "candela", f->candela[i], "at least 0");
        f->candela[i] *= scale;
        *most = fmax(*most, f->candela[i]);
    }
    if (!code && !(*most > 0))
        code = wrong(r, r->line, "no candela value is above 0");
    if (!code && !(*most <= most_candela))
        code = unfit(r, "the largest candela times the multiplier", *most, "at most 1e30");
    return code;
}

/* ---- the table -------------------------------------------------------------------------------------------
 */

/* Where x lies among rising angles: index and share of the next. */
static int find(const double *a, int n, double x, double *share)
{
    int i = 0;
    while (i < n - 2 && x >= a[i + 1])
        i++;
    *share = n < 2 ? 0 : fmin(fmax((x - a[i]) / (a[i + 1] - a[i]), 0), 1);
    return i;
}

/* The horizontal angle of the file that stands for x in 0 … 360. */
static double fold(const raw *f, double x)
{
    double first = f->around[0], last = f->around[f->horizontal - 1];
    if (first > 45) /* 90 … 270: the same at 180 - x */
        return x < 90 ? 180 - x : x > 270 ? 540 - x : x;
    x = last < 270 && x > 180 ? 360 - x : x;
    return last < 135 && x > 90 ? 180 - x : x;
}

static double candela_at(const raw *f, double down, double around)
{
    double s, t;
    if (down < f->down[0] - 1e-6 || down > f->down[f->vertical - 1] + 1e-6)
        return 0;
    int i = find(f->down, f->vertical, down, &s), j = find(f->around, f->horizontal, around, &t);
    const double *a = f->candela + (size_t)j * (size_t)f->vertical + i,
                 *b = f->horizontal > 1 ? a + f->vertical : a;
    return (1 - t) * (a[0] + s * (a[1] - a[0])) + t * (b[0] + s * (b[1] - b[0]));
}

/* Steps that the table takes over `span`. */
static int steps(const double *a, int n, double span, double least)
{
    double step = span;
    for (int i = 1; i < n; i++)
        step = fmin(step, a[i] - a[i - 1]);
    return (int)ceil(span / fmax(step, least) - 1e-6);
}

static rl_code make_table(rl_arena *arena, const raw *f, double most, rl_ies *out, rl_error *err)
{
    int down = steps(f->down, f->vertical, 180, 0.5);
    if (!spans(f->down, f->vertical, 0,
               180)) /* finer, so that the slope to the dark half is at most a degree */
        down *= (180 + down - 1) / down;
    out->vertical = down + 1;
    out->horizontal = f->horizontal > 1 ? steps(f->around, f->horizontal, 360, 2.5) + 1 : 1;
    out->candela = most;
    size_t n = (size_t)out->vertical * (size_t)out->horizontal;
    float *value = rl_arena_array(arena, n, sizeof *value);
    if (!value)
        return rl_fail_memory(err, n * sizeof *value);
    for (int i = 0; i < out->vertical; i++)
        for (int j = 0; j < out->horizontal; j++) {
            double around = out->horizontal > 1 ? 360.0 * j / (out->horizontal - 1) : 0;
            double c =
                candela_at(f, 180.0 * i / (out->vertical - 1), out->horizontal > 1 ? fold(f, around) : 0);
            value[i * out->horizontal + j] = (float)(c / most);
        }
    out->value = value;
    return RL_OK;
}

rl_code rl_ies_parse(rl_arena *arena, const char *text, const char *name, const rl_ies **out, rl_error *err)
{
    reader r = {.at = text, .name = name, .start = text, .line = 1, .column = 1, .arena = arena, .err = err};
    raw f = {0};
    double scale = 0, most = 0;
    rl_ies *ies = rl_arena_alloc(arena, sizeof *ies);
    *out = NULL;
    if (!ies)
        return rl_fail_memory(err, sizeof *ies);
    rl_code code = read_head(&r);
    if (!code)
        code = read_sizes(&r, &f, &scale);
    if (!code)
        code = read_angles(&r, "vertical angles", f.vertical, &f.down);
    if (!code)
        code = read_angles(&r, "horizontal angles", f.horizontal, &f.around);
    if (!code)
        code = check_angles(&r, &f);
    if (!code)
        code = read_candela(&r, &f, scale, &most);
    if (!code)
        code = make_table(arena, &f, most, ies, err);
    *out = code ? NULL : ies;
    return code;
}

rl_code rl_ies_load(rl_arena *arena, const char *path, const rl_ies **out, rl_error *err)
{
    char *text = NULL;
    size_t size;
    *out = NULL;
    rl_code code = rl_file_read(path, &text, &size, err);
    if (!code)
        code = rl_ies_parse(arena, text, path, out, err);
    rl_free(text);
    return code;
}

/* At least 16 points between two rows and 2048 in all: their sum is good to 1e-6. */
double rl_ies_integral(const rl_ies *ies, double angle)
{
    int fine = 16 * (ies->vertical > 129 ? ies->vertical - 1 : 128),
        columns = ies->horizontal > 1 ? ies->horizontal - 1 : 1;
    double sum = 0, end = fmin(angle, pi);
    for (int i = 0; i < fine; i++) {
        double down = end * (i + 0.5) / fine, row = down / pi * (ies->vertical - 1), mean = 0;
        int k = (int)row;
        for (int j = 0; j < columns; j++) {
            const float *v = ies->value + k * ies->horizontal + j;
            mean += (1 - (row - k)) * (double)v[0] + (row - k) * (double)v[ies->horizontal];
        }
        sum += mean / columns * sin(down) * end / fine;
    }
    return 2 * pi * sum;
}
