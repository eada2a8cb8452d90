#!/bin/bash
# check.sh BUILD: all tests, readable while they run, one closing line "N passed, N failed".
set -u
cd "$(dirname "$0")/.."
b=$1; passed=0; failed=0
log=$(mktemp); trap 'rm -f "$log"' EXIT

tally() {  # tally NAME COMMAND...: counts a googletest run
  local name=$1; shift
  echo "== $name"
  "$@" 2>&1 | tee "$log" | grep -vE '^\[ RUN  |^\[----|^\[====|^$|^Note: Google'
  local status=${PIPESTATUS[0]}
  local ok bad
  ok=$(grep -cE '^\[       OK \]' "$log"); bad=$(grep -cE '^\[  FAILED  \] .*\([0-9]+ ms\)$' "$log")
  if [ "$status" != 0 ] && [ "$bad" = 0 ]; then echo "FAILED: $name ended with status $status"; bad=1; fi
  passed=$((passed + ok)); failed=$((failed + bad))
}
one() {  # one NAME COMMAND...: a command that passes or fails as a whole
  local name=$1; shift
  if "$@" >"$log" 2>&1; then echo "[       OK ] $name"; passed=$((passed + 1))
  else cat "$log"; echo "[  FAILED  ] $name"; failed=$((failed + 1)); fi
}

one "layers: include direction of src/" test/layers.sh
tally "unit and property tests" "$b/test/unit-tests"
tally "integration tests (own network namespace)" test/in-netns.sh "$b/test/integration-tests"
for t in test/tools/*_test.sh; do [ -e "$t" ] && one "$t" "$t" "$b"; done
for t in test/tools/*_test.py; do [ -e "$t" ] && one "$t" /usr/bin/python3 "$t" "$b"; done

echo
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
