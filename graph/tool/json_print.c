#include "graph/tool/json_print.h"

#include <stdlib.h>

void rl_json_print(json_t *taken, size_t flags, rl_str *out)
{
    char *text = taken ? json_dumps(taken, flags) : NULL;
    if (text)
        rl_str_printf(out, "%s\n", text);
    else
        out->failed = true;
    free(text);
    json_decref(taken);
}
