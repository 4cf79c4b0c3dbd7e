#!/usr/bin/env bash
# Renders the pictures of passes/README.md into passes/docs/ (RELIT=build/relit unless set): `make docs` calls it.
set -eu
cd "$(dirname "$0")/../.."
relit=${RELIT:-build/relit}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
crop=(--crop 228,40,232,160 --quiet)
"$relit" run passes/docs/pictures.yaml --out "$work" "${crop[@]}"
"$relit" run configs/sg.yaml --only preview --set 'outputs.preview.file="sg.{frame:04}.png"' --out "$work" "${crop[@]}"
"$relit" run passes/docs/backlit.yaml --out "$work" --crop 60,25,300,190 --frames 1-8 --quiet
for picture in "$work"/*.0008.png; do
    name=$(basename "$picture" .0008.png)
    cmp -s "$picture" "passes/docs/$name.png" || cp "$picture" "passes/docs/$name.png"
done
