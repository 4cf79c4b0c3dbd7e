#include "graph/tool/tool.h"

#include <string.h>

typedef struct command {
    rl_command_info info;
    rl_command_function run;
} command;

static const command commands[] = {
    {{"run", RL_CMD_RUN, "PIPELINE", "process frames",
      "Reads the frames of the pipeline's capture, runs its graph and writes its\n"
      "outputs. A file under its final name is whole. A frame that fails does not stop\n"
      "the others.\n"},
     rl_cmd_run},
    {{"ab", RL_CMD_AB, "PIPELINE...", "compare variants; write a report",
      "Runs variants of a pipeline together (--vary), or several pipelines, or every\n"
      "variant of each. What they share runs once; their pictures have the same bits\n"
      "as runs of their own, and go to a folder each below --out.\n"
      "\n"
      "    relit ab configs/skin.yaml --vary profiles.skin.texturing=post,pre_post\n"
      "    relit ab a.yaml b.yaml --frames 1-24 --fail-over flip.p95=0.05\n"
      "    relit ab p.yaml --vary graph.sss.taps=8,16,21,40,55 --sheet\n"
      "    relit ab p.yaml --vary graph.sss.pass=sss_burley,sss_gaussian,combine\n"
      "\n"
      "report.html shows where they differ (one file, opens offline), metrics.json\n"
      "has every number, junit.xml is for CI. Each variant is compared with the first\n"
      "one; --pairs and --against choose others. Where chance has a part, the first\n"
      "variant runs with other seeds too, and differences that chance explains are\n"
      "marked. A pass that --vary graph.NODE.pass puts in place of another drops the\n"
      "parameters and inputs that it lacks, and says so.\n"
      "\n"
      "--fail-over METRIC.STAT=X, such as flip.p95=0.05 or psnr.mean=40, is about every\n"
      "frame and material; energy=X about the light that a pass loses or makes.\n"},
     rl_cmd_ab},
    {{"diff", RL_CMD_DIFF, "A B", "compare an image with a reference",
      "Compares image B with the reference A and prints mean, median, 95th percentile\n"
      "and maximum of a metric. EXR files: channels R, G, B, or the only layer. A file\n"
      "of 8 or 16 bits is taken as sRGB-encoded, others as linear Rec. 709. FLIP uses\n"
      "67.02 pixels a degree. NaN in an image is an error.\n"},
     rl_cmd_diff},
    {{"check", RL_CMD_CHECK, "PIPELINE", "validate everything without processing a pixel",
      "Reads the pipeline, opens the headers of the capture, makes the plan and\n"
      "compiles the kernels. Writes nothing.\n"
      "--json prints an object with pipeline, ok, captures and errors, in either case.\n"},
     rl_cmd_check},
    {{"plan", RL_CMD_PLAN, "PIPELINE...", "show the graph: order, lifetimes, memory, culled passes",
      "With --vary, or with several pipelines: what the variants share when `relit ab`\n"
      "runs them together, and what that costs against running one.\n"},
     rl_cmd_plan},
    {{"init", RL_CMD_INIT, "CAPTURE", "print a starter pipeline for a capture",
      "CAPTURE is a capture.yaml, a folder that holds one, or an EXR file or pattern.\n"
      "The pipeline has the capture's lights and materials, and the standard graph:\n"
      "    relit init captures/monkey > monkey.yaml && relit run monkey.yaml\n"
      "Paths in it are relative to the working folder: keep it there, or edit them.\n"},
     rl_cmd_init},
    {{"inspect", RL_CMD_INSPECT, "FILE|DIR", "show parts, channels, metadata, guessed capture mapping", NULL},
     rl_cmd_inspect},
    {{"passes", RL_CMD_PASSES, "[NAME]", "list the passes, or one's ports and parameters", NULL},
     rl_cmd_passes},
    {{"devices", RL_CMD_DEVICES, NULL, "list OpenCL devices, and which one a run would take", NULL},
     rl_cmd_devices},
    {{"bench", RL_CMD_BENCH, "[PIPELINE]", "time every stage of a run",
      "Runs the frames of the capture over and over (pictures go to a temporary\n"
      "folder) and prints what each stage takes, throughput and peak memory. Without\n"
      "PIPELINE: configs/skin.yaml. Shares are of the stages' sum: they overlap.\n"},
     rl_cmd_bench},
};

enum { N_COMMANDS = sizeof commands / sizeof *commands };

int rl_tool_print(rl_tool *tool, rl_str *s, rl_error *err)
{
    if (s->failed)
        rl_fail_memory(err, s->length);
    else
        rl_report_result(tool->report, rl_str_text(s), err);
    rl_str_free(s);
    return err->code ? RL_EXIT_WRONG : RL_EXIT_DONE;
}

/* "relit ab configs/skin.yaml --vary 'a=[1, 2],3'". NULL when memory is out. */
static const char *command_line(rl_arena *arena, int argc, char **argv)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=,:+@%";
    rl_str s = {0};
    rl_str_add(&s, "relit");
    for (int i = 1; i < argc; i++) {
        bool quoted = !*argv[i] || argv[i][strspn(argv[i], plain)];
        rl_str_add(&s, quoted ? " '" : " ");
        for (const char *c = argv[i]; *c; c++)
            rl_str_addn(&s, *c == '\'' ? "'\\''" : c, *c == '\'' ? 4 : 1);
        rl_str_add(&s, quoted ? "'" : "");
    }
    const char *line = s.failed ? NULL : rl_arena_strdup(arena, rl_str_text(&s));
    rl_str_free(&s);
    return line;
}

static int run_command(rl_tool *tool, const rl_commands *infos, int argc, char **argv, rl_error *err)
{
    size_t index;
    if (rl_command_find(infos, argv[1], &index, err))
        return RL_EXIT_WRONG;
    const command *c = &commands[index];
    if (rl_arguments_parse(tool->arena, infos, &c->info, argc - 2, argv + 2, &tool->args, err))
        return RL_EXIT_WRONG;
    if (tool->args.help) {
        rl_str text = {0};
        rl_help_command(&c->info, &text);
        return rl_tool_print(tool, &text, err);
    }
    tool->command = command_line(tool->arena, argc, argv);
    if (!tool->command) {
        rl_fail_memory(err, 256);
        return RL_EXIT_WRONG;
    }
    tool->args.run.pipeline = tool->args.operand;
    tool->args.run.log = &tool->report->log;
    tool->report->quiet = tool->args.quiet;
    tool->report->verbose = tool->args.verbose;
    tool->report->json = tool->args.json;
    return c->run(tool, err);
}

int rl_tool_main(int argc, char **argv, FILE *out, FILE *err)
{
    rl_arena arena = {0};
    rl_reporter reporter;
    rl_error error = {0};
    rl_tool tool = {.report = &reporter, .arena = &arena};
    const rl_command_info *rows[N_COMMANDS];
    rl_commands infos = {rows, N_COMMANDS};
    rl_str text = {0};
    int status;

    for (size_t i = 0; i < N_COMMANDS; i++)
        rows[i] = &commands[i].info;
    rl_reporter_begin(&reporter, out, err);
    if (argc < 2) {
        rl_fail_file(&error, RL_E_USAGE, "relit", "needs a command, see `relit --help`");
        status = RL_EXIT_WRONG;
    } else if (!strcmp(argv[1], "help") && argc > 2) {
        status = run_command(&tool, &infos, 3, (char *[]){argv[0], argv[2], "--help"}, &error);
    } else if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
        rl_help_overview(&infos, &text);
        status = rl_tool_print(&tool, &text, &error);
    } else if (!strcmp(argv[1], "--version")) {
        rl_str_add(&text, "relit " RL_VERSION "\n");
        status = rl_tool_print(&tool, &text, &error);
    } else {
        status = run_command(&tool, &infos, argc, argv, &error);
    }
    if (error.code)
        rl_report_error(&reporter, &error);
    rl_reporter_end(&reporter);
    rl_arena_free(&arena);
    return status;
}
