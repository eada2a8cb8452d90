#!/bin/bash
# faults_test.sh BUILD: a fault of each part of the rig is noticed, survived and accounted for; a bad script is refused. No limits on
# time: this machine may be busy. The whole table: make faults.
set -u
cd "$(dirname "$0")/../.."
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; exit 1; }

/usr/bin/python3 test/tools/make_folder.py "$work/board" 200 >/dev/null || fail "pictures of a board"
"$b/bin/cyclops-import" "$work/board" --out "$work/flight" >/dev/null || fail "import"
printf '[[fault]]\nkind = "tspi_bias"\neast_m = "much"\n' >"$work/bad.toml"
"$b/bin/cyclops-replay" "$work/flight" --faults "$work/bad.toml" 2>"$work/bad.log" && fail "a bad script was taken"
grep -q 'bad.toml:3: fault\[0\].east_m: is' "$work/bad.log" || fail "no place in: $(cat "$work/bad.log")"
for try in 1 2; do  # once more for a machine that stood still at the wrong moment
  /usr/bin/python3 tools/faults.py "$b" --table config/faults/check.toml --flight "$work/flight" --out "$work/faults" --relaxed && exit 0
done
fail "faults, see above"
