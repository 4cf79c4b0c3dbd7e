#!/usr/bin/env bash
# passes/README.md is what the tables in this build say (`make docs` writes it), every link of the pages leads somewhere, and the
# pictures are small.
set -u
cd "$(dirname "$0")/.." || exit 2
export RELIT=${BUILD:-build}/relit
n=0 bad=0
report() { # status, name
    n=$((n + 1))
    if [ "$1" -eq 0 ]; then echo "ok $n - $2"; else echo "not ok $n - $2"; bad=1; fi
}

difference=$(diff passes/README.md <(passes/docs/page.sh || echo "page.sh failed"))
status=$?
[ "$status" -eq 0 ] || head -20 <<<"$difference" | sed 's/^/# /'
report "$status" "passes/README.md is up to date (else: make docs)"

lost=0
for page in README.md .github/CONTRIBUTING.md passes/README.md configs/README.md configs/captures.md configs/farm/README.md; do
    while IFS= read -r link; do
        [ -e "$(dirname "$page")/$link" ] || { echo "# $page: no file '$link'"; lost=1; }
    done < <(grep -o '](\([^)#]*\))' "$page" | sed 's/^](//; s/)$//' | grep -v '^https\?:' | sort -u)
done
report "$lost" "links lead to files"

message=$("$RELIT" passes taa --json --markdown 2>&1)
report "$([ $? -eq 2 ] && grep -q 'exclude each other' <<<"$message"; echo $?)" "one format at a time"

large=$(find passes/docs -name '*.png' -size +60k | sed 's/^/# larger than 60 KiB: /')
[ -z "$large" ] || echo "$large"
report "$([ -z "$large" ]; echo $?)" "pictures are small"
exit "$bad"
