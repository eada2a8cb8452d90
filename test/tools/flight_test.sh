#!/bin/bash
# flight_test.sh BUILD: cyclops-flight as a program: seeds share pictures, half a flight leaves nothing, a full disk is named.
set -u
cd "$(dirname "$0")/../.."
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $1"; cat "$work"/*.log 2>/dev/null; exit 1; }
fly() { "$b/bin/cyclops-flight" --scenario config/scenarios/embedded.toml --frames "$1" --cache "$work/${cache:-cache}" --out "$work/$2" "${@:3}" >"$work/$2.log" 2>&1; }

fly 4 one --seed 1 || fail "first flight"
fly 4 two --seed 2 --threads 1 || fail "second flight"
grep -q "pictures from the cache" "$work/two.log" || fail "another seed of navigation rendered anew"
[ "$work/one/frames.lcm" -ef "$work/two/frames.lcm" ] || fail "frames are not shared"
cmp -s "$work/one/messages.lcm" "$work/two/messages.lcm" && fail "another seed says the same"
cache=cache2 fly 4 again --seed 1 --threads 1 || fail "the first once more, without its cache"
for f in frames.lcm messages.lcm rig.toml figures.json; do cmp -s "$work/one/$f" "$work/again/$f" || fail "$f differs with another number of threads"; done
for i in 1 2 3; do fly 12 par$i --seed $i --picture-seed 7 & done; wait
[ "$(cat "$work"/par?.log | grep -c rendered)" = 1 ] && [ "$work/par1/frames.lcm" -ef "$work/par3/frames.lcm" ] || fail "three at a time did not share one rendering"
fly 4 true --navigation true && grep -q "projection error 0.00 px" "$work/true.log" || fail "true navigation has errors"
"$b/bin/cyclops-offline" "$work/true" --quiet >/dev/null || fail "the service cannot fly it"
fly 4 one && fail "a flight was written over"
grep -q "is a flight already" "$work/one.log" || fail "it does not say why"

(ulimit -f 3000; fly 3 full --picture-seed 9) && fail "a full disk went unnoticed"  # 3 MB
grep -q "frames.lcm: cannot be written: File too large" "$work/full.log" || fail "a full disk is not named"
[ -e "$work/full" ] && fail "a full disk left a flight"

"$b/bin/cyclops-flight" --scenario config/scenarios/embedded.toml --picture-seed 10 --cache "$work/cache" --out "$work/stopped" >"$work/stopped.log" 2>&1 & p=$!
for i in $(seq 100); do ls "$work"/cache/*.part >/dev/null 2>&1 && break; sleep 0.1; done
sleep 0.3; kill -TERM $p  # an INT would not reach a background job of a script
wait $p; [ $? = 130 ] || fail "an interrupt does not end with 130"
grep -q "nothing is kept" "$work/stopped.log" || fail "an interrupt says nothing"
[ -z "$(find "$work" -name '*.part')" ] || fail "an interrupt left its parts behind"
[ -e "$work/stopped" ] && fail "an interrupt left a flight"
echo "ok"
