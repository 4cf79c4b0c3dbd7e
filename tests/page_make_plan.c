#include "graph/base/file.h"
#include "graph/tool/page_source.h"
#include "graph/tool/plan_page.h"
#include "tests/page_make.h"

static void add_plan(rl_str *s, const char *name)
{
    rl_str_add(
        s, "{\"nodes\":[{\"name\":\"light\",\"pass\":\"lighting\",\"ports\":[{\"name\":\"albedo\",\"role\":"
           "\"read\",\"image\":\"capture.albedo\",\"buffer\":0},{\"name\":\"diffuse\",\"role\":\"write\","
           "\"image\":\"light.diffuse\",\"buffer\":1}]},{\"name\":");
    rl_page_json_text(s, name);
    rl_str_add(
        s, ",\"pass\":\"taa\",\"ports\":[{\"name\":\"color\",\"role\":\"read\",\"image\":\"light.diffuse\","
           "\"buffer\":1},{\"name\":\"last\",\"role\":\"history\",\"image\":\"aa.color\",\"buffer\":2},{"
           "\"name\":"
           "\"color\",\"role\":\"write\",\"image\":\"aa.color\",\"buffer\":2}]}],\"steps\":[{\"kind\":"
           "\"kernel\",\"node\":\"light\",\"pass\":\"lighting\",\"entry\":\"lighting\",\"buffers\":[0,1]}");
    for (int i = 0; i < 2; i++) {
        rl_str_add(s, ",{\"kind\":\"kernel\",\"node\":");
        rl_page_json_text(s, name);
        rl_str_printf(s, ",\"pass\":\"taa\",\"entry\":\"taa_%d\",\"buffers\":[1,2,2]}", i);
    }
    rl_str_add(
        s,
        "],\"buffers\":[{\"name\":\"capture.albedo\",\"scratch\":false,\"class\":\"source\",\"layout\":"
        "\"linear\",\"planes\":3,\"slot\":null,\"first\":-1,\"last\":0,\"bytes\":1048576},{\"name\":"
        "\"light.diffuse\",\"scratch\":false,\"class\":\"transient\",\"layout\":\"phase4\",\"planes\":3,"
        "\"slot\":"
        "0,\"first\":0,\"last\":2,\"bytes\":2097152},{\"name\":\"aa.color\",\"scratch\":false,\"class\":"
        "\"history\",\"layout\":\"linear\",\"planes\":3,\"slot\":null,\"first\":-1,\"last\":3,\"bytes\":"
        "1048576}],"
        "\"slots\":[{\"planes\":3,\"buffers\":[1],\"bytes\":2097152}],\"outputs\":[],\"culled\":[\"idle\"],"
        "\"memory\":{\"in_flight\":3,\"bytes\":7340032,\"bytes_unshared\":7340032,\"data_window\":[0,0,480,"
        "270],"
        "\"columns\":512,\"rows\":272,\"stride\":544},\"peak\":{\"in_flight\":3,\"buffers\":7340032,"
        "\"reading\":"
        "0,\"writing\":1048576,\"checkpoint\":0,\"total\":8388608}}\n");
}

/* Two frames. */
static void add_trace(rl_str *s, const char *name)
{
    static const double us[2][3] = {{4000, 1000, 400}, {6000, 2000, 600}};
    rl_str_add(
        s,
        "{\"traceEvents\":[{\"ph\":\"M\",\"pid\":1,\"name\":\"process_name\",\"args\":{\"name\":\"relit\"}}");
    for (int f = 0; f < 2; f++)
        for (int i = 0; i < 3; i++) {
            rl_str step = {0};
            rl_str_printf(&step, i ? "%s: taa_%d" : "light: lighting", name, i - 1);
            rl_str_add(s, ",{\"ph\":\"X\",\"cat\":\"kernel\",\"name\":");
            rl_page_json_text(s, rl_str_text(&step));
            rl_str_printf(s, ",\"ts\":0,\"dur\":%.1f,\"args\":{\"frame\":%d,\"capture\":\"c\"}}", us[f][i],
                          f);
            rl_str_free(&step);
        }
    rl_str_add(s, "]}");
}

rl_code page_make_plan(const char *path, const char *trace, const char *node, rl_error *err)
{
    rl_str plan = {0}, times = {0}, page = {0};
    rl_code code = RL_OK;
    add_plan(&plan, node);
    if (trace) {
        add_trace(&times, node);
        code = rl_file_write(trace, rl_str_text(&times), times.length, err);
    }
    if (!code)
        code = rl_plan_page("skin.yaml", rl_str_text(&plan), trace, &page, err);
    if (!code)
        code = rl_file_write(path, rl_str_text(&page), page.length, err);
    rl_str_free(&plan);
    rl_str_free(&times);
    rl_str_free(&page);
    return code;
}
