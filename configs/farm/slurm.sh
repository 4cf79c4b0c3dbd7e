#!/usr/bin/env bash
# A sequence as a Slurm array job, one shard a task:
#
#   sbatch --array=1-8 configs/farm/slurm.sh PIPELINE OUT [relit options]
#   RELIT_PREROLL=60 sbatch --array=1-8 configs/farm/slurm.sh PIPELINE OUT [relit options]
#
# Without RELIT_PREROLL the pictures are those of one run, bit for bit: each task goes on from the history that the task
# before it leaves, and waits in the queue for it (several captures, or a graph without history, need no waiting). With
# RELIT_PREROLL=K all tasks run at once, each after K frames of warm-up; `relit plan PIPELINE --shard 2/8 --preroll K`
# says how far off that is.
#
# A task that is lost, preempted or out of time is started again and goes on where it was: 60 s before its end relit
# gets SIGTERM, finishes the frames in flight and writes a checkpoint. OUT must be a folder that all nodes share.
# RELIT names the program, if it is not in the PATH.
#
#SBATCH --job-name=relit
#SBATCH --cpus-per-task=2
#SBATCH --signal=B:TERM@60
#SBATCH --requeue
#SBATCH --open-mode=append
set -u
pipeline=${1:?usage: sbatch --array=1-N slurm.sh PIPELINE OUT [relit options]}
out=${2:?usage: sbatch --array=1-N slurm.sh PIPELINE OUT [relit options]}
shift 2
shard=$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1))/$SLURM_ARRAY_TASK_COUNT
said=$(mktemp)
trap 'rm -f "$said"' EXIT

"${RELIT:-relit}" run "$pipeline" --out "$out" --shard "$shard" --resume --threads "${SLURM_CPUS_PER_TASK:-2}" \
    ${RELIT_PREROLL:+--preroll "$RELIT_PREROLL"} "$@" 2>"$said" &
child=$!
trap 'kill -TERM "$child" 2>/dev/null' TERM
wait "$child"
status=$?
while kill -0 "$child" 2>/dev/null; do # the signal ended the wait, not relit
    wait "$child"
    status=$?
done
cat "$said" >&2

# Stopped, or too early: back into the queue. Any other status is the task's own (1: a frame failed; 2: a mistake).
if [ "$status" -eq 143 ] || { [ "$status" -eq 1 ] && grep -q 'needs the checkpoint after frame' "$said"; }; then
    echo "relit: shard $shard goes back into the queue" >&2
    sleep "${RELIT_REQUEUE_DELAY:-10}"
    scontrol requeue "$SLURM_JOB_ID" && sleep 60 # Slurm ends this script
fi
exit "$status"
