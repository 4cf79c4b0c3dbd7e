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
    printf '\n## %s\n\n' "$name"
    # A pass is documented by its table; a picture (pictures.yaml) and a paragraph may come with it.
    [ ! -e "passes/docs/$name.png" ] || printf '![](docs/%s.png)\n\n' "$name"
    [ ! -e "passes/docs/$name.md" ] || { cat "passes/docs/$name.md"; echo; }
    "$relit" passes "$name" --markdown
done
echo
cat passes/docs/accuracy.md
