#!/usr/bin/env bash
# Time of a 1920x1080 frame in a batch (decode ZIP, three lights, scattering with 21 taps, TAA, ACES SDR view, half EXR
# ZIP) against `oiiotool in.exr -o copy.exr` of one, in turns. Run from the project's folder, after `make`:
#
#     make bench                          on a capture made from captures/monkey
#     CAPTURE=file.exr make bench         on a recorded frame whose layers and camera are named as in captures/monkey
#
# FRAMES (24) is the length of the batch, RUNS (5) how often; PEER=0 leaves oiiotool out.
set -eu
build=${BUILD:-build} frames=${FRAMES:-24} runs=${RUNS:-5}
work=$build/bench
mkdir -p "$work"
capture=${CAPTURE:-$work/made.exr}
if [ -z "${CAPTURE:-}" ] && [ ! -e "$capture" ]; then
    "$build/tests/bench_capture" captures/monkey/monkey.0001.exr "$capture"
fi

# The manifest of captures/monkey, on one file that stands for every frame.
sed -e "s|^files:.*|files: $(realpath "$capture")|" -e "s|^frames:.*|frames: 1-$frames|" -e "s|^name:.*|name: bench|" \
    captures/monkey/capture.yaml > "$work/capture.yaml"

batch() {
    "$build/relit" run configs/skin.yaml --capture "$work/capture.yaml" --out "$work/out" --quiet --only beauty \
        --set graph.sss.taps=21 --set outputs.beauty.display=sRGB --set outputs.beauty.view=ACES \
        --set outputs.beauty.colorspace=null "$@"
}

seconds() { # of a command; to stdout
    local start end
    start=$(date +%s%N)
    "$@" > /dev/null
    end=$(date +%s%N)
    echo "$start $end" | awk '{printf "%.4f\n", ($2 - $1) / 1e9}'
}

peer=${PEER:-1}
command -v oiiotool > /dev/null || { [ "$peer" = 0 ] || echo "no oiiotool (Debian: openimageio-tools): batch alone"; peer=0; }
batch --frames 1-2 # kernels into the cache, the file into memory
: > "$work/times"
for _ in $(seq "$runs"); do
    ours=$(seconds batch)
    theirs=0
    [ "$peer" = 0 ] || theirs=$(seconds oiiotool "$capture" -o "$work/copy.exr")
    echo "$ours $theirs" >> "$work/times"
done
awk -v n="$frames" -v peer="$peer" '
    { a = $1 / n; if (NR == 1 || a < least) least = a; if (NR == 1 || $2 < copy) copy = $2
      ratio[NR] = $2 / a }
    END {
        printf "batch of %d frames: %.1f ms a frame at best", n, 1e3 * least
        if (peer != 0) {
            for (i = 2; i <= NR; i++)
                for (k = i; k > 1 && ratio[k] < ratio[k - 1]; k--) { t = ratio[k]; ratio[k] = ratio[k - 1]; ratio[k - 1] = t }
            printf "; oiiotool copies one in %.1f ms at best; %.1f times faster (median of %d pairs)", 1e3 * copy, ratio[int((NR + 1) / 2)], NR
        }
        printf "\n"
    }' "$work/times"
