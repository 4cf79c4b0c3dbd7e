#!/usr/bin/env bash
# The C and C++ sources are as clang-format leaves them (`make format`). Versions differ in what they leave: only Debian 12's,
# 14, decides; without it nothing is checked, and that is said.
set -u
cd "$(dirname "$0")/.." || exit 2
for tool in clang-format-14 clang-format; do
    command -v "$tool" >/dev/null && "$tool" --version | grep -q 'version 14\.' && break
    tool=
done
if [ -z "$tool" ]; then
    echo "# clang-format 14 is not installed: the format is not checked" >&2
    echo "ok 1 - format # SKIP clang-format 14 is not installed"
    exit 0
fi
if git rev-parse --git-dir >/dev/null 2>&1; then
    mapfile -t files < <(git ls-files '*.c' '*.h' '*.cc' '*.hh')
else
    mapfile -t files < <(find graph kernels passes tests -name '*.c' -o -name '*.h' -o -name '*.cc' -o -name '*.hh')
fi
if log=$("$tool" --dry-run -Werror --ferror-limit=1 "${files[@]}" 2>&1); then
    echo "ok 1 - ${#files[@]} files are formatted"
    exit 0
fi
echo "not ok 1 - format (run 'make format'):"
grep -o '^[^ :]*:[0-9]*' <<<"$log" | sed 's/^/# /' | sort -u
exit 1
