#include "graph/tool/options_table.h"

#define BATCH          (RL_CMD_RUN | RL_CMD_CHECK | RL_CMD_PLAN)
#define SHARED         (BATCH | RL_CMD_AB)
#define TIMED          (SHARED | RL_CMD_BENCH)
#define EVERY          (TIMED | RL_CMD_INIT | RL_CMD_INSPECT | RL_CMD_PASSES | RL_CMD_DEVICES | RL_CMD_DIFF)
#define AT(field)      .at = offsetof(rl_arguments, field)
#define LIST_AT(field) AT(run.field), .count = offsetof(rl_arguments, run.n_##field)

/* clang-format off */
const rl_option rl_options_table[] = {
    {"capture", "PATH", TIMED, RL_TAKES_LIST, LIST_AT(captures),
     .help = "a capture.yaml, a folder that holds one, or an EXR\n"
             "file or pattern; replaces the pipeline's own;\n"
             "may be repeated"},
    {"frames", "SPEC", TIMED, RL_TAKES_TEXT, AT(run.frames),
     .help = "such as 1-24, 1-24x2, 1,5,9-12 or -10--1;\n"
             "default: all that the capture lists"},
    {"out", "DIR", SHARED, RL_TAKES_TEXT, AT(run.out),
     .help = "where outputs go (created when missing); default: out\n"
             "(ab: out/ab, and below it a folder a variant)"},
    {"set", "PATH=VALUE", TIMED, RL_TAKES_SETTING, LIST_AT(settings),
     .help = "set a value of the pipeline by its dotted path,\n"
             "such as graph.sss.taps=55; null removes it;\n"
             "may be repeated"},
    {"vary", "PATH=V1,V2,..", RL_CMD_AB | RL_CMD_PLAN, RL_TAKES_LIST, AT(vary),
     .count = offsetof(rl_arguments, n_vary),
     .help = "a variant for each of these values: the inside of a\n"
             "YAML list, such as 8,16 or [3, 1.2, 0.7],[6, 5, 3];\n"
             "several make the full grid"},
    {"pairs", NULL, RL_CMD_AB, RL_TAKES_FLAG, AT(pairs),
     .help = "compare neighbours: variants one step apart in one\n"
             "--vary; default: each with the first"},
    {"against", "FILE|DIR", RL_CMD_AB, RL_TAKES_TEXT, AT(against),
     .help = "compare each variant with this picture, or with the\n"
             "pictures of this folder, not with the first variant"},
    {"seeds", "N", RL_CMD_AB, RL_TAKES_INTEGER, AT(seeds), .min = 1, .max = 64,
     .help = "render the first variant with N seeds, to tell what\n"
             "chance alone makes; default: 3; 1: do not"},
    {"only", "NAME", TIMED, RL_TAKES_LIST, LIST_AT(only),
     .help = "make this output and no other; may be repeated"},
    {"dump", "IMAGE", SHARED, RL_TAKES_LIST, LIST_AT(dump),
     .help = "write this image of the graph as EXR besides;\n"
             "may be repeated"},
    {"crop", "X,Y,W,H", SHARED, RL_TAKES_REGION, AT(run.crop),
     .help = "a region, in pixels of the display window"},
    {"on-missing", "WORD", SHARED, RL_TAKES_WORD, AT(on_missing), .words = "error|skip|hold",
     .help = "what to do about an input frame that is missing\n"
             "or broken: error (default), skip it, or hold the\n"
             "frame before it under its number"},
    {"resume", NULL, BATCH, RL_TAKES_FLAG, AT(run.resume),
     .help = "keep the pictures that are there and whole, and go\n"
             "on from the last checkpoint of their history"},
    {"shard", "I/N", BATCH, RL_TAKES_SHARD, AT(run.shard),
     .help = "the I-th of N parts: whole captures, or frame ranges\n"
             "that take over history from the part before"},
    {"preroll", "K", BATCH, RL_TAKES_INTEGER, AT(run.preroll), .min = 1, .max = 1000000,
     .help = "a shard begins with K frames of warm-up instead; not\n"
             "exact: `relit plan --shard` says how far off"},
    {"checkpoint-frames", "N", RL_CMD_RUN, RL_TAKES_INTEGER, AT(run.checkpoint_frames), .min = 1,
     .max = 1000000,
     .help = "save history every N frames; default: so often that\n"
             "it takes 2 % of the time"},
    {"ocio", "FILE", TIMED, RL_TAKES_TEXT, AT(run.ocio),
     .help = "OpenColorIO config; default: the pipeline's, else\n"
             "$OCIO, else relit's own"},
    {"threads", "N", TIMED | RL_CMD_DIFF, RL_TAKES_INTEGER, AT(run.threads), .min = 1, .max = 1024,
     .help = "how many to use; default: one a processor"},
    {"device", "N|cpu|gpu", TIMED | RL_CMD_DEVICES, RL_TAKES_TEXT, AT(run.device),
     .help = "OpenCL device, by number (see `relit devices`) or\n"
             "kind; default: a CPU device if there is one"},
    {"memory-limit", "SIZE", TIMED, RL_TAKES_BYTES, AT(run.memory_limit),
     .help = "most that relit may allocate, such as 512M or 4G;\n"
             "default: no limit"},
    {"format", "WORD", RL_CMD_PLAN, RL_TAKES_WORD, AT(format), .words = "text|dot|svg|json|html",
     .help = "text (default), dot, svg, json or html (one page)"},
    {"json", NULL, TIMED | RL_CMD_PASSES | RL_CMD_DEVICES | RL_CMD_DIFF, RL_TAKES_FLAG, AT(json),
     .help = "print JSON on stdout (run, ab: an object a frame,\n"
             "each on its line)"},
    {"markdown", NULL, RL_CMD_PASSES, RL_TAKES_FLAG, AT(markdown),
     .help = "print Markdown tables, as in passes/README.md"},
    {"size", "WxH", RL_CMD_BENCH, RL_TAKES_SIZE, AT(size),
     .help = "time frames of that size: the capture's pixels\n"
             "repeated or left out; default: as they are"},
    {"metric", "NAME", RL_CMD_DIFF, RL_TAKES_TEXT, AT(metric),
     .help = "flip, hdrflip, psnr, ssim, rmse or max; default:\n"
             "flip for 8-bit files, hdrflip for float"},
    {"heatmap", "F.png", RL_CMD_DIFF, RL_TAKES_TEXT, AT(heatmap),
     .help = "write the metric of every pixel as a picture"},
    {"fail-over", "[METRIC.STAT=]X", RL_CMD_DIFF | RL_CMD_AB, RL_TAKES_LIST, AT(fail_over),
     .count = offsetof(rl_arguments, n_fail_over),
     .help = "exit with 3 when the mean, or flip.p95 or such, is\n"
             "over X (psnr and ssim: under X); may be repeated;\n"
             "ab: of any frame or material, and energy=X too"},
    {"sheet", "[=FILE]", RL_CMD_AB, RL_TAKES_MAYBE, AT(sheet),
     .help = "write one picture with a labelled tile a variant, and\n"
             "its FLIP against the last; default: sheet.png, in\n"
             "--out"},
    {"report-frames", "SPEC", RL_CMD_AB, RL_TAKES_TEXT, AT(report_frames),
     .help = "whose pixels report.html holds: a list of first,\n"
             "last, worst, all, none, and frames as in --frames;\n"
             "default: first,last,worst"},
    {"trace", "F.json", SHARED, RL_TAKES_TEXT, AT(trace),
     .help = "write what ran when, for ui.perfetto.dev or\n"
             "chrome://tracing; plan --format html: such a file,\n"
             "whose times the page shows"},
    {"quiet", NULL, EVERY, RL_TAKES_FLAG, AT(quiet),
     .help = "print errors and warnings only: no notes, no progress"},
    {"verbose", NULL, EVERY, RL_TAKES_FLAG, AT(verbose),
     .help = "print more notes"},
    {"help", NULL, EVERY, RL_TAKES_FLAG, AT(help),
     .help = "print this help"},
};
/* clang-format on */

const size_t rl_options_n = sizeof rl_options_table / sizeof *rl_options_table;

_Static_assert(sizeof rl_options_table / sizeof *rl_options_table <= RL_MOST_OPTIONS, "RL_MOST_OPTIONS");
