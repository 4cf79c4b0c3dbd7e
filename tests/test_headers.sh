#!/usr/bin/env bash
# Every header compiles alone, as C11 and as C++17, without a warning: who includes it needs to know nothing else. One test a
# header and language (TAP, for tests/run.sh). Headers of C++ (.hh) compile as C++ only.
set -u
cd "$(dirname "$0")/.." || exit 2
libraries=$(pkg-config --cflags OpenEXR OpenColorIO | sed 's/-I/-isystem /g') # their headers may warn
export FLAGS="-I. $libraries -Wall -Wextra -Wpedantic -Werror -fsyntax-only"
export CC="${CC:-cc}" CXX="${CXX:-c++}"

# A file that includes the header twice: its guard must hold too. C forbids an empty file, hence the declaration.
compile() {
    local header=${1%% *} language=${1##* } log
    local text="#include \"$header\"
#include \"$header\"
extern int rl_header_$$;"
    if [ "$language" = c11 ]; then
        log=$($CC -std=c11 -D_GNU_SOURCE $FLAGS -x c - <<<"$text" 2>&1)
    else
        log=$($CXX -std=c++17 $FLAGS -x c++ - <<<"$text" 2>&1)
    fi && echo "ok - $header as $language" && return
    echo "not ok 1 - $header as $language"
    echo "$log" | sed 's/^/# /'
}
export -f compile

find graph kernels passes tests \( -name '*.h' -o -name '*.hh' \) | sort | while read -r header; do
    [ "${header##*.}" = hh ] || echo "$header c11"
    echo "$header c++17"
done | xargs -d '\n' -P 2 -I '{}' bash -c 'compile "{}"'
