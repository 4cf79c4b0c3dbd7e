#!/usr/bin/env bash
# The commands leak nothing: relit with LeakSanitizer in front of malloc (`make test-leaks` runs all tests so).
# Prints TAP.
set -u
relit=${BUILD:-build}/leaks/relit
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
n=0 bad=0

# Where it cannot work (it traces threads, which containers may forbid) a leak on purpose goes unseen.
echo 'int main(void) { void *volatile p = __builtin_malloc(7); p = 0; return 0; }' >"$out/leak.c"
echo "1..12"
if ! ${CC:-cc} -fsanitize=leak -o "$out/leak" "$out/leak.c" || "$out/leak" 2>"$out/log" || ! grep -q 'detected memory leaks' "$out/log"; then
    for n in {1..12}; do echo "ok $n - leaks # SKIP LeakSanitizer does not work here"; done
    exit 0
fi

# expect STATUS WHAT relit's arguments …
expect() {
    local status=$1 what=$2
    shift 2
    n=$((n + 1))
    "$relit" "$@" >"$out/stdout" 2>"$out/log"
    local got=$?
    if [ $got -eq "$status" ] && ! grep -q 'LeakSanitizer' "$out/log"; then
        echo "ok $n - $what"
    else
        sed 's/^/# /' "$out/log"
        echo "not ok $n - $what: status $got"
        bad=1
    fi
}

expect 0 run run configs/skin.yaml --frames 1-2 --out "$out/a" --quiet --trace "$out/t.json"
expect 0 'run: shard, resume' run configs/skin.yaml --frames 1-3 --shard 1/2 --resume --out "$out/a" --quiet
expect 0 ab ab configs/skin.yaml --vary graph.sss.taps=4,8 --frames 1 --seeds 1 --out "$out/ab" --quiet --sheet
expect 2 'wrong key' run configs/skin.yaml --set graph.sss.tapps=1 --out "$out/b" --quiet
expect 2 'wrong image' run configs/skin.yaml --set graph.aa.in.color=sss.colour --out "$out/b" --quiet
expect 0 check check configs/vignette.yaml
expect 0 plan plan configs/skin.yaml --format svg
expect 0 'plan: variants, page' plan configs/skin.yaml --vary graph.sss.taps=4,8 --format html
expect 0 init init captures/monkey
expect 0 inspect inspect captures/monkey
expect 0 passes passes lighting
expect 0 diff diff "$out/a/monkey.0001.exr" "$out/a/monkey.0002.exr" --heatmap "$out/h.png"
exit $bad
