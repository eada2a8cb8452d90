#!/bin/bash
# sanitized.sh BUILD VARIANT: unit tests, integration tests and the whole rig (replayer, service, logger) with the programs of
# a sanitizer or coverage build. Ends at the first error. VARIANT: asan, ubsan, tsan, coverage.
set -u
cd "$(dirname "$0")/.."
b=$1 variant=$2 out=$1/sanitized
export ASAN_OPTIONS="halt_on_error=1:detect_stack_use_after_return=1:strict_string_checks=1:check_initialization_order=1"
export LSAN_OPTIONS="suppressions=$PWD/test/lsan.supp:print_suppressions=0"
export UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1"
export TSAN_OPTIONS="halt_on_error=1:exitcode=66:second_deadlock_stack=1:suppressions=$PWD/test/tsan.supp:print_suppressions=0"
export OPENBLAS_NUM_THREADS=1  # Debian's is not built with ThreadSanitizer: what its threads do looks like a race
here=()  # ThreadSanitizer cannot place its shadow everywhere: no random addresses
[ "$variant" = tsan ] && here=(setarch "$(uname -m)" -R)

step() {  # step NAME COMMAND...
  local name=$1; shift
  echo "== $variant: $name"
  "${here[@]}" "$@" || { echo "FAILED: $variant: $name ended with status $?"; exit 1; }
}

rm -rf "$out"; mkdir -p "$out"
step "unit tests" "$b/test/unit-tests" --gtest_brief=1
step "integration tests" test/in-netns.sh "$b/test/integration-tests" --gtest_brief=1
step "pictures of a board" /usr/bin/python3 test/tools/make_folder.py "$out/board" 60
step "import" "$b/bin/cyclops-import" "$out/board" --out "$out/flight"
step "offline" "$b/bin/cyclops-offline" "$out/flight" --out "$out/offline.lcm" --summary "$out/offline.json" --scores "$out/scores.csv" --quiet
step "offline, profile of 2007" "$b/bin/cyclops-offline" "$out/flight" --config config/thesis-2007.toml --out "$out/thesis.csv" --quiet
step "whole rig" env RECORD=yes hil/rig.sh "$b" "$out/flight" "$out/live" - 1
# How many frames a slow build keeps up with is not the question here: the comparison may find some missing.
step "live beside offline" bash -c '"$0" diff "$1" "$2" || [ $? = 2 ]' "$b/bin/cyclops-log" "$out/offline.lcm" "$out/live/live.lcm"
step "score" "$b/bin/cyclops-score" "$out/flight" "$out/live/live.lcm" --summary "$out/score.json" --service "$out/live/service.json" --replay "$out/live/replay.json"
if grep -lE 'ERROR: (Address|Leak)Sanitizer|WARNING: ThreadSanitizer|runtime error:' "$out"/live/*.log; then
  echo "FAILED: $variant: reports in the logs above"; exit 1
fi
echo "$variant: nothing found"
