/* What the tables of every registered pass promise (graph/model/pass.h): texts for people, defaults within
 * ranges, rows and ports that fit together. Their kernels: test_registry_kernels.c. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "graph/model/pass.h"

/* ---- texts -----------------------------------------------------------------------------------------------
 */

/* One line, lower case (but for names such as "GGX", "Burley's", "SG" further on), no full stop. */
static void check_help(const char *pass, const char *name, const char *help)
{
    size_t n = help ? strlen(help) : 0;
    bool good = n > 0 && help[n - 1] != '.' && !strchr(help, '\n') && n < 110;
    if (good && isupper((unsigned char)help[0]) && !isupper((unsigned char)help[1]))
        good = strstr(help, "'s ") != NULL; /* a person's name may begin it */
    if (!good)
        fail_msg("%s, %s: the help '%s' is not one lower-case line without a full stop", pass, name,
                 help ? help : "");
}

static void test_texts(void **state)
{
    (void)state;
    assert_true(rl_pass_count() > 0);
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        assert_non_null(p->name);
        check_help(p->name, "pass", p->help);
        if (!p->source || strlen(p->source) <= 3)
            fail_msg("%s: no .source: which paper or program it is from", p->name);
        assert_true(strspn(p->name, "abcdefghijklmnopqrstuvwxyz0123456789_") == strlen(p->name));
        assert_ptr_equal(rl_pass_find(p->name), p); /* so names differ, too */
        assert_string_not_equal(p->name, "kernel"); /* stands for a user's own */
        assert_true(!p->kernel != !p->kernel_text);
        assert_true(p->steps.n > 0);
    }
}

/* ---- parameters ------------------------------------------------------------------------------------------
 */

static int word_count(const char *words)
{
    int n = 1;
    for (const char *c = words; *c; c++)
        n += *c == '|';
    return n;
}

static void check_words(const rl_param *row)
{
    const char *w = row->words;
    assert_true(*w && *w != '|' && w[strlen(w) - 1] != '|' && !strstr(w, "||"));
    assert_null(strpbrk(w, " \t,'\""));
}

/* A default that the row's own reader would refuse is a value that no user can write. */
static void check_default(const char *pass, const rl_param *row)
{
    int lanes = row->type == RL_RGBF ? 3 : 1;
    if (row->no_default || row->required)
        return;
    for (int i = 0; i < lanes; i++) {
        double d = row->def[i];
        bool word = row->words && d < 0 && row->type == RL_I32 && -1 - d < word_count(row->words);
        bool in = d >= row->min && d <= row->max;
        if (row->type == RL_ENUM)
            in = d >= 0 && d < word_count(row->words);
        if (row->type != RL_F32 && row->type != RL_RGBF)
            in = in && d == rint(d);
        if (!in && !word)
            fail_msg("%s.%s: the default %g is not within %g … %g", pass, row->name, d, row->min, row->max);
    }
}

static void check_row(const char *pass, const rl_param *row, bool of_struct)
{
    check_help(pass, row->name, row->help);
    assert_non_null(row->unit);
    assert_true(isfinite(row->min) && isfinite(row->max) && row->min <= row->max);
    assert_true((row->type == RL_ENUM) <= (row->words != NULL));
    assert_true(!row->words || row->type == RL_ENUM || row->type == RL_I32);
    if (row->words)
        check_words(row);
    if (row->words && row->type == RL_I32)
        assert_true(row->min >= 0); /* words take the negative numbers */
    if (row->no_default)
        assert_true(!of_struct && row->min >= 0); /* the device sees -1 */
    if (row->required)
        assert_false(of_struct);
    if (row->structural)
        assert_true(of_struct && row->type != RL_F32 && row->type != RL_RGBF);
    check_default(pass, row);
}

static void check_unique(const char *pass, rl_params rows)
{
    for (size_t i = 0; i < rows.n; i++)
        for (size_t k = 0; k < i; k++)
            if (!strcmp(rows.rows[i].name, rows.rows[k].name))
                fail_msg("%s has two parameters '%s'", pass, rows.rows[i].name);
}

static void test_params(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        size_t bytes = 0;
        for (size_t k = 0; k < p->params.n; k++) {
            check_row(p->name, &p->params.rows[k], true);
            assert_int_equal(p->params.rows[k].offset,
                             bytes); /* in order, without gaps: as OpenCL lays it out */
            bytes += RL_PARAM_BYTES(p->params.rows[k].type);
        }
        if (p->params_size != bytes)
            fail_msg("%s: .params_size is %zu, but its rows take %zu bytes", p->name, p->params_size, bytes);
        check_unique(p->name, p->params);
        const rl_params groups[] = {p->profile_keys, p->material_keys, p->shading_keys};
        for (int g = 0; g < 3; g++) {
            for (size_t k = 0; k < groups[g].n; k++)
                check_row(p->name, &groups[g].rows[k], false);
            check_unique(p->name, groups[g]);
        }
    }
}

static bool same_text(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

static bool same_row(const rl_param *a, const rl_param *b)
{
    return a->type == b->type && a->min == b->min && a->max == b->max &&
           !memcmp(a->def, b->def, sizeof a->def) && same_text(a->words, b->words) &&
           same_text(a->unit, b->unit) && same_text(a->help, b->help) &&
           a->no_default ==
               b->no_default; /* .required is each pass's own: lighting needs d only for transmission */
}

/* material_t takes the first of equal names: the others must be the same row. */
static void test_shared_rows(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        for (size_t j = 0; j < i; j++) {
            const rl_pass *a = rl_pass_at(i), *b = rl_pass_at(j);
            const rl_params one[] = {a->profile_keys, a->material_keys, a->shading_keys};
            const rl_params two[] = {b->profile_keys, b->material_keys, b->shading_keys};
            for (int g = 0; g < 3; g++)
                for (size_t k = 0; k < one[g].n; k++)
                    for (size_t m = 0; m < two[g].n; m++)
                        if (!strcmp(one[g].rows[k].name, two[g].rows[m].name) &&
                            !same_row(&one[g].rows[k], &two[g].rows[m]))
                            fail_msg("%s and %s differ in '%s'", a->name, b->name, one[g].rows[k].name);
        }
    }
}

/* ---- ports -----------------------------------------------------------------------------------------------
 */

/* Own output first, else own input. */
static const rl_port *past_of(const rl_pass *p, const char *name)
{
    for (int writes = 1; writes >= 0; writes--)
        for (size_t i = 0; i < p->ports.n; i++)
            if (!strcmp(p->ports.rows[i].name, name) &&
                p->ports.rows[i].role == (writes ? RL_WRITE : RL_READ))
                return &p->ports.rows[i];
    return NULL;
}

static bool has_reduction(const rl_pass *p, const char *name)
{
    for (size_t i = 0; i < p->ports.n; i++)
        if (p->ports.rows[i].role == RL_REDUCTION && !strcmp(p->ports.rows[i].name, name))
            return true;
    return false;
}

static bool has_word(const char *words, const char *word, size_t length)
{
    for (; words; words = strchr(words, '|') ? strchr(words, '|') + 1 : NULL)
        if (strcspn(words, "|") == length && !strncmp(words, word, length))
            return true;
    return false;
}

/* "KEY: a|b" is of a profile key and of words that it has; the port instead of it is one that is read. */
static void check_missed(const rl_pass *p, const rl_port *port)
{
    bool key = false, instead = !port->instead;
    size_t n = strcspn(port->missed_by, ":");
    assert_true(port->role == RL_READ && port->optional);
    check_help(p->name, port->name, port->if_missed);
    for (size_t i = 0; i < p->ports.n && port->instead; i++)
        instead |= p->ports.rows[i].role == RL_READ && !strcmp(p->ports.rows[i].name, port->instead);
    for (size_t i = 0; i < p->profile_keys.n; i++) {
        const rl_param *row = &p->profile_keys.rows[i];
        if (strncmp(row->name, port->missed_by, n) || row->name[n])
            continue;
        key = true;
        for (const char *w = port->missed_by + n + 2; w; w = strchr(w, '|') ? strchr(w, '|') + 1 : NULL)
            assert_true(has_word(row->words, w, strcspn(w, "|")));
    }
    assert_true(key && instead);
}

static void check_port(const rl_pass *p, size_t which)
{
    const rl_port *a = &p->ports.rows[which];
    check_help(p->name, a->name, a->help);
    if (a->missed_by)
        check_missed(p, a);
    assert_true(strspn(a->name, "abcdefghijklmnopqrstuvwxyz0123456789_") == strlen(a->name));
    assert_true((a->of != NULL) == (a->role == RL_HISTORY));
    if (a->of) {
        const rl_port *past = past_of(p, a->of);
        assert_non_null(past);
        assert_int_equal(past->format, a->format);
        assert_true(a->optional || !past->optional);
    }
    if (a->optional)
        assert_true(a->role == RL_READ || a->role == RL_HISTORY);
    if (a->role == RL_REDUCTION)
        assert_true(a->format == RL_SUMS && !a->with);
    if (a->format == RL_SUMS)
        assert_true(a->role == RL_REDUCTION);
    if (a->with) {
        assert_true(a->role == RL_SCRATCH);
        assert_true(has_reduction(p, a->with));
    }
    if (a->any_layout)
        assert_true(a->role == RL_WRITE && a->layout == RL_LINEAR);
    if (a->format == RL_LIGHTS)
        assert_true(a->role == RL_READ && a->layout == RL_LINEAR && p->lights);
    for (size_t k = 0; k < which; k++) { /* a pass may read and write under one name */
        const rl_port *b = &p->ports.rows[k];
        if (!strcmp(a->name, b->name) && !((a->role == RL_WRITE) ^ (b->role == RL_WRITE)))
            fail_msg("%s has two ports '%s'", p->name, a->name);
    }
}

static void test_ports(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *p = rl_pass_at(i);
        bool phases = false, writes = false;
        for (size_t k = 0; k < p->steps.n; k++)
            phases |= p->steps.rows[k].domain == RL_EVERY_PHASE;
        for (size_t k = 0; k < p->steps.n; k++)
            assert_true(!p->steps.rows[k].with || has_reduction(p, p->steps.rows[k].with));
        for (size_t k = 0; k < p->ports.n; k++) {
            check_port(p, k);
            writes |= p->ports.rows[k].role == RL_WRITE;
            if (p->ports.rows[k].layout == RL_PHASE4 && !phases)
                fail_msg("%s wants '%s' in phases, but no step of it runs by phases", p->name,
                         p->ports.rows[k].name);
        }
        assert_true(writes);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_texts),
        cmocka_unit_test(test_params),
        cmocka_unit_test(test_shared_rows),
        cmocka_unit_test(test_ports),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
