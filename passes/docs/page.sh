#!/usr/bin/env bash
# Prints passes/README.md: the tables that relit prints (RELIT=build/relit unless set), with the paragraphs in this folder.
set -eu
cd "$(dirname "$0")/../.."
relit=${RELIT:-build/relit}
cat passes/docs/intro.md
printf '## All passes\n\n'
"$relit" passes --markdown
names=$("$relit" passes | sed '/^$/,$d; s/ .*//')
for name in $names; do
    [ -e "passes/docs/$name.md" ] || { echo "passes/docs/$name.md is missing: a paragraph about the pass" >&2; exit 1; }
    [ -e "passes/docs/$name.png" ] || { echo "passes/docs/$name.png is missing: see passes/docs/pictures.yaml" >&2; exit 1; }
    printf '\n## %s\n\n![](docs/%s.png)\n\n' "$name" "$name"
    cat "passes/docs/$name.md"
    echo
    "$relit" passes "$name" --markdown
done
echo
cat passes/docs/accuracy.md
