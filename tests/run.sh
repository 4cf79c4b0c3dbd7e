#!/usr/bin/env bash
# Runs test programs (cmocka, TAP output), shows what failed, and closes with "N passed, N failed".
# A program that crashes or prints no plan counts as one failure, whatever passed before.
set -u
passed=0 failed=0
for program in "$@"; do
    name=$(basename "$program")
    start=$(date +%s%N)
    log=$(CMOCKA_MESSAGE_OUTPUT=TAP timeout "${RELIT_TEST_TIMEOUT:-300}" "$program" 2>&1)
    status=$?
    good=$(grep -c '^ok ' <<<"$log")
    bad=$(grep -c '^not ok [0-9]' <<<"$log")
    if { [ "$status" -ne 0 ] && [ "$bad" -eq 0 ]; } || [ $((good + bad)) -eq 0 ]; then
        bad=$((bad + 1))
        echo "$name: ended with status $status after $good tests"
    fi
    [ "$bad" -gt 0 ] && printf '%s\n' "$log" | sed "s/^/    /"
    printf '%-32s %3d passed, %d failed  (%d ms)\n' "$name" "$good" "$bad" $((($(date +%s%N) - start) / 1000000))
    passed=$((passed + good)) failed=$((failed + bad))
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
