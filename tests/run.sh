#!/usr/bin/env bash
# Runs test programs (cmocka, TAP output), shows what failed, and closes with "N passed, N failed".
# Skipped tests are neither, and are said. A program that crashes or prints no plan counts as one failure, whatever passed before.
set -u
passed=0 failed=0
for program in "$@"; do
    name=$(basename "$program")
    start=$(date +%s%N)
    log=$(CMOCKA_MESSAGE_OUTPUT=TAP timeout "${RELIT_TEST_TIMEOUT:-300}" "$program" 2>&1)
    status=$?
    good=$(grep -c '^ok ' <<<"$log")
    skipped=$(grep -cE '^(not )?ok [0-9]+ .*# SKIP' <<<"$log") # cmocka calls them "not ok", a script "ok"
    good=$((good - $(grep -cE '^ok .*# SKIP' <<<"$log")))
    bad=$(grep '^not ok [0-9]' <<<"$log" | grep -vc '# SKIP')
    if { [ "$status" -ne 0 ] && [ "$bad" -eq 0 ]; } || [ $((good + bad + skipped)) -eq 0 ]; then
        bad=$((bad + 1))
        echo "$name: ended with status $status after $good tests"
    fi
    [ "$bad" -gt 0 ] && printf '%s\n' "$log" | sed "s/^/    /"
    [ "$bad" -eq 0 ] && grep '# SKIP' <<<"$log" | sed "s/^/    /"
    [ "$skipped" -gt 0 ] && note=", $skipped skipped" || note=
    printf '%-32s %3d passed, %d failed%s  (%d ms)\n' "$name" "$good" "$bad" "$note" $((($(date +%s%N) - start) / 1000000))
    passed=$((passed + good)) failed=$((failed + bad))
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
