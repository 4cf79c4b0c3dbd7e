/* A frame's files into its buffers, and what takes the place of those that are missing or broken. */
#include "graph/run/session.h"

/* The frame of a number, under the files of another one when that is held. */
rl_code rl_session_read(rl_session *s, rl_sequence *q, rl_frame *f, int file_number, rl_error *err)
{
    f->nonfinite = f->clamped = 0;
    rl_code code = rl_reader_open(q->reader, file_number, f, err);
    if (!code)
        code = rl_session_fit_buffers(q, f, err);
    return code ? code : rl_reader_pixels(q->reader, f, s->pool, err);
}

/* The layers of the nearest frame before it that can be read, under its own number. */
static void hold_frame(rl_session *s, rl_sequence *q, size_t index, rl_frame *f, rl_loaded *out)
{
    rl_error why = f->error;
    rl_where where = {.file = why.file};
    for (size_t k = index; k-- > 0;) {
        f->error = (rl_error){0};
        rl_session_read(s, q, f, q->frames.numbers[k], &f->error);
        if (rl_reader_missed(f->error.code))
            continue;
        rl_report(s->log, RL_WARNING, where, "frame %d holds the layers of frame %d: %s", f->number,
                  q->frames.numbers[k], why.text);
        out->held = true;
        out->source = k;
        return;
    }
    f->error = (rl_error){0};
    rl_fail(&f->error, why.code, where, "%s (there is no frame before it to hold)", why.text);
}

void rl_session_load(rl_session *s, rl_sequence *q, size_t index, rl_frame *f, rl_loaded *out)
{
    *out = (rl_loaded){.source = index};
    f->number = q->frames.numbers[index];
    f->error = (rl_error){0};
    f->run_s = f->write_s = 0;
    f->clipped = 0;
    rl_session_read(s, q, f, f->number, &f->error);
    out->broken = f->error.code != RL_OK;
    if (!rl_reader_missed(f->error.code))
        return;
    if (s->options.on_missing == RL_MISSING_HOLD) {
        hold_frame(s, q, index, f, out);
    } else if (s->options.on_missing == RL_MISSING_SKIP) {
        rl_where where = {.file = f->error.file};
        rl_report(s->log, RL_WARNING, where, "frame %d is skipped: %s", f->number, f->error.text);
        out->skipped = true;
    }
}
