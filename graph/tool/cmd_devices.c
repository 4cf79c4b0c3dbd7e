/* `relit devices`: what OpenCL offers, and which device a run would take. */
#include <string.h>

#include "graph/run/device.h"
#include "graph/tool/json_print.h"
#include "graph/tool/tool.h"

static bool same(const rl_device_info *a, const rl_device_info *b)
{
    return !strcmp(a->name, b->name) && !strcmp(a->platform, b->platform) && a->cpu == b->cpu &&
           a->units == b->units && a->memory == b->memory;
}

static void print_text(const rl_device_info *d, size_t i, bool taken, rl_str *out)
{
    char memory[32], largest[32];
    rl_str_printf(out, "%c %zu  %s\n", taken ? '*' : ' ', i, d->name);
    rl_str_printf(out, "     %s, %s, %s\n", d->platform, d->version, d->driver);
    rl_str_printf(out, "     %s, %u %s, %s%s, largest buffer %s\n", d->cpu ? "cpu" : "gpu or other", d->units,
                  d->units == 1 ? "unit" : "units", rl_format_bytes(d->memory, memory),
                  d->host_memory ? " shared with the host (nothing is copied)" : " of its own",
                  rl_format_bytes(d->largest, largest));
}

static json_t *as_json(const rl_device_info *d, size_t i, bool taken)
{
    return json_pack("{s:I, s:s, s:s, s:s, s:s, s:b, s:b, s:I, s:I, s:I, s:b}", "number", (json_int_t)i,
                     "name", d->name, "platform", d->platform, "version", d->version, "driver", d->driver,
                     "cpu", (int)d->cpu, "host_memory", (int)d->host_memory, "units", (json_int_t)d->units,
                     "memory_bytes", (json_int_t)d->memory, "largest_bytes", (json_int_t)d->largest, "taken",
                     (int)taken);
}

static void print_all(const rl_tool *tool, const rl_device_info *all, size_t n, const rl_device_info *taken,
                      rl_str *out)
{
    json_t *list = tool->args.json ? json_array() : NULL;
    bool found = false; /* of two that are alike, the first is taken */
    for (size_t i = 0; i < n; i++) {
        bool this = !found && taken && same(&all[i], taken);
        found = found || this;
        if (tool->args.json)
            json_array_append_new(list, as_json(&all[i], i, this));
        else
            print_text(&all[i], i, this, out);
    }
    if (tool->args.json)
        rl_json_print(list, JSON_INDENT(1), out);
    else
        rl_str_add(out, "\n* a run takes this one\n");
}

int rl_cmd_devices(rl_tool *tool, rl_error *err)
{
    rl_device *device = NULL;
    rl_device_info *all = NULL;
    size_t n = 0;
    rl_str text = {0};
    int status = RL_EXIT_WRONG;
    if (rl_device_list(tool->arena, &all, &n, err) ||
        rl_device_open(tool->args.run.device, 0, &tool->report->log, &device, err))
        goto done;
    print_all(tool, all, n, rl_device_about(device), &text);
    status = rl_tool_print(tool, &text, err);
done:
    rl_device_close(&device);
    return status;
}
