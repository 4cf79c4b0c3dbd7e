#!/usr/bin/env bash
# A one-node Slurm on the loopback address runs configs/farm/slurm.sh over captures/monkey_turn in three exact shards. The
# second loses its process on purpose and is requeued; the third comes too early and requeues itself. The pictures must be
# those of a plain run. Needs Debian's slurm-wlm and munge, and root (slurmd starts jobs as their user).
set -u
cd "$(dirname "$0")/.." || exit 2
build=$PWD/${BUILD:-build}
for tool in slurmctld slurmd munged sbatch; do
    PATH=$PATH:/usr/sbin command -v $tool >/dev/null || { echo "needs $tool: apt-get install slurm-wlm munge"; exit 2; }
done
export PATH=$PATH:/usr/sbin
base=$(mktemp -d)
pids=()
cleanup() {
    for p in "${pids[@]}"; do kill "$p" 2>/dev/null; done
    wait 2>/dev/null
    rm -rf "$base"
}
trap cleanup EXIT
fail() {
    echo "FAILED: $1"
    tail -n 30 "$base"/*.log "$base"/slurm-*.out 2>/dev/null
    exit 1
}
until_true() { # seconds, command…: polls
    local end=$((SECONDS + $1))
    shift
    until "$@"; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.3
    done
}

# ---- one node -----------------------------------------------------------------------------------------------------
host=$(hostname -s)
mkdir -p "$base"/{state,spool,munge}
chmod 755 "$base" && chmod 700 "$base/munge"
dd if=/dev/urandom of="$base/munge/key" bs=1024 count=1 2>/dev/null && chmod 600 "$base/munge/key"
cat >"$base/slurm.conf" <<EOF
ClusterName=relit
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$base/munge/socket
StateSaveLocation=$base/state
SlurmdSpoolDir=$base/spool
SlurmctldPidFile=$base/slurmctld.pid
SlurmdPidFile=$base/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
EOF
export SLURM_CONF=$base/slurm.conf
munged --foreground --force --key-file="$base/munge/key" --socket="$base/munge/socket" --pid-file="$base/munge/pid" \
    --log-file="$base/munge/munged.log" --seed-file="$base/munge/seed" >"$base/munged.log" 2>&1 &
pids+=($!)
until_true 10 test -S "$base/munge/socket" || fail "munged does not start"
slurmctld -D >"$base/slurmctld.log" 2>&1 &
pids+=($!)
slurmd -D -N "$host" >"$base/slurmd.log" 2>&1 &
pids+=($!)
idle() { sinfo -h -o %t 2>/dev/null | grep -q idle; }
until_true 40 idle || fail "the node does not come up"

# ---- the job ------------------------------------------------------------------------------------------------------
"$build/relit" run configs/skin.yaml --capture captures/monkey_turn --only beauty --out "$base/plain" --quiet ||
    fail "the plain run"
# Shard 2 runs once until its second picture is there, then dies like a node.
cat >"$base/relit" <<EOF
#!/usr/bin/env bash
if [[ " \$* " == *" --shard 2/3 "* && -e $base/out/.relit/monkey_turn.0004.checkpoint && ! -e $base/lost ]]; then
    touch $base/lost
    "$build/relit" "\$@" --checkpoint-frames 1 &
    until [ -e $base/out/monkey_turn.0006.exr ]; do sleep 0.005; done
    kill -9 \$!
    exit 137
fi
exec "$build/relit" "\$@"
EOF
chmod +x "$base/relit"
export RELIT=$base/relit RELIT_REQUEUE_DELAY=1
job=$(sbatch --parsable --array=1-3 --chdir="$PWD" --output="$base/slurm-%a.out" configs/farm/slurm.sh configs/skin.yaml \
    "$base/out" --capture captures/monkey_turn --only beauty) || fail "sbatch"
state() { squeue -h -r -j "${job}_$1" -t all -o %T 2>/dev/null | head -1; }
ended() { local s; s=$(state "$1"); [ "$s" = COMPLETED ] || [ "$s" = FAILED ]; }
now() { # what was requeued would wait for two minutes
    for id in $(squeue -h -r -t PENDING -o %A); do scontrol update JobId="$id" StartTime=now 2>/dev/null; done
    "$@"
}
until_true 60 ended 1 || fail "shard 1 does not end"
[ "$(state 1)" = COMPLETED ] || fail "shard 1: $(state 1)"
lost() { [ "$(state 2)" = FAILED ]; }
until_true 180 now lost || fail "shard 2 was not lost: $(state 2)"
[ -e "$base/lost" ] || fail "shard 2 failed otherwise than on purpose"
echo "shard 2 was lost after $(ls "$base/out"/*.exr | wc -l) pictures"
scontrol requeue "${job}_2" || fail "requeue"
done_all() { [ "$(state 2)" = COMPLETED ] && [ "$(state 3)" = COMPLETED ]; }
until_true 300 now done_all || fail "shards 2 and 3: $(state 2), $(state 3)"
diff -r --exclude=.relit "$base/plain" "$base/out" || fail "the pictures differ"
grep -h "goes back into the queue" "$base"/slurm-*.out
echo "slurm: 3 shards, one lost and requeued, equal one run ($(ls "$base/out"/*.exr | wc -l) pictures)"
