#!/usr/bin/env bash
# Includes point one way only: base <- model <- run <- tool; passes see graph/model/pass.h and their own headers; kernels/shared.h
# includes nothing. Prints every arrow that points up.
set -u
cd "$(dirname "$0")/.." || exit 2
bad=0
check() { # folder, pattern of allowed includes
    while IFS= read -r hit; do
        echo "layers: $hit"
        bad=1
    done < <(grep -nE '^#include "' "$1"/*.c "$1"/*.h "$1"/*.cc "$1"/*.hh 2>/dev/null | grep -vE "#include \"($2)\"")
}
check graph/base 'graph/base/[a-z_]+\.h'
check graph/model 'graph/(base|model)/[a-z_]+\.h|kernels/shared\.h'
check graph/run 'graph/(base|model|run)/[a-z_]+\.hh?|graph/relit\.h|kernels/shared\.h'
check graph/tool 'graph/(base|model|run|tool)/[a-z_]+\.h|graph/relit\.h'
check passes 'graph/model/pass\.h|passes/[a-z_]+\.h'
for h in graph/relit.h; do
    grep -nE '^#include "' $h | grep -vE '"graph/base/(error|log)\.h"' && bad=1
done
grep -ln 'cl[A-Z][A-Za-z]*(' graph/*/*.c passes/*.c | grep -vE '^graph/run/device(_[a-z]+)?\.c$' | sed 's/^/layers: cl* call outside of graph\/run\/device*.c: /' | grep . && bad=1
[ "$bad" -eq 0 ] && echo "layers: includes point one way"
exit "$bad"
