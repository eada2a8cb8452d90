#!/bin/bash
# record_test.sh BUILD: what becomes of a recorded sortie: verified, damaged, recovered, cut, exported, served again as a camera;
# a disk that is too slow, and one that is full.
set -u
cd "$(dirname "$0")/../.."
if [ -z "${CYCLOPS_IN_NETNS:-}" ]; then CYCLOPS_IN_NETNS=1 exec test/in-netns.sh unshare -m "$0" "$@"; fi  # mounts of its own, too
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; exit 1; }
log() { "$b/bin/cyclops-log" "$@"; }
value() { /usr/bin/python3 -c 'import json,sys; s=json.load(open(sys.argv[1])); print(eval(sys.argv[2]))' "$1" "$2"; }
fly() { RECORD=yes hil/rig.sh "$b" "$1" "$2" - "${3:-0}" 2>"$work/rig.log" || { cat "$work/rig.log"; fail "rig $*"; }; }
replays() {  # replays SORTIE: offline says what was published, as far as there are pixels
  "$b/bin/cyclops-offline" "$1" --out "$work/off.lcm" --summary "$work/off.json" -q || fail "offline of $1"
  log diff --by-seq --before "$(value "$work/off.json" 's["first_frame_without_pixels"]')" "$1" "$work/off.lcm" || fail "$1 does not replay to what was published"
}

/usr/bin/python3 test/tools/make_folder.py "$work/board" 60 >/dev/null || fail "pictures of a board"
"$b/bin/cyclops-import" "$work/board" --out "$work/flight" >/dev/null || fail "import"

echo "-- whole"
for try in 1 2 3; do
  fly "$work/flight" "$work/live" 1
  log verify "$work/live/sortie" >"$work/said" && break
  cat "$work/said"
done
sortie=$work/live/sortie
log verify "$sortie" || fail "no try was recorded whole"
log info "$sortie" | grep -q "60 frames went into the chain, 60 have their pixels" || fail "info"
replays "$sortie"

# Served again as a camera it gives the same, unless this machine loses or holds up frames; what it then gives is recorded again
# and must replay like any other.
for how in 0 1 20 step; do
  echo "-- served again as a camera: $how"
  same=0
  for try in 1 2 3; do
    if [ $how = step ]; then STEPS=10 fly "$sortie" "$work/second" 1; else fly "$sortie" "$work/second" $how; fi
    replays "$work/second/sortie"
    log diff "$sortie" "$work/second/sortie" && same=1 && break
  done
  [ $same = 1 ] || echo "REPORT: at $how this machine did not get every frame through in time in three tries"
  [ $same = 1 ] || [ $how != 0 ] || [ "$(value "$work/second/service.json" 's["frames_in_chain"]')" -lt 60 ] || fail "at its own pace the replayed sortie gives something else"
done

echo "-- GPS time by PPS"
/usr/bin/python3 test/tools/add_pps.py "$work/flight" "$work/flight-pps" || fail "a flight with PPS"
fly "$work/flight-pps" "$work/pps" 1
[ "$(value "$work/pps/service.json" 's["time"]["pps_marks"]')" -ge 1 ] || fail "no mark came from the PPS line"
log info "$work/pps/sortie" | grep -q STROBE || fail "edges are not recorded"
replays "$work/pps/sortie"

echo "-- damaged"
cp -r "$sortie" "$work/cut"; truncate -s -100000 "$work/cut/frames.lcm"; rm "$work/cut/manifest.toml"
log verify "$work/cut" >"$work/said"; [ $? = 2 ] || fail "a cut sortie verifies"
grep -q "frames.lcm: ends inside an event" "$work/said" && grep -q "2 frames have no pixels: 58 to 59" "$work/said" || { cat "$work/said"; fail "verify does not say what was cut"; }
"$b/bin/cyclops-offline" "$work/cut" -q 2>/dev/null && fail "a sortie without a manifest was taken for a flight"
log recover "$work/cut" "$work/clean" || fail "recover"
replays "$work/clean"
log diff "$work/clean" "$sortie" >/dev/null || fail "recover lost messages"
cp -r "$sortie" "$work/flip"; printf '\x55' | dd of="$work/flip/frames.lcm" bs=1 seek=400000 conv=notrunc 2>/dev/null
log verify "$work/flip" >"$work/said"; [ $? = 2 ] || fail "a wrong pixel verifies"
grep -q "pixels damaged: frames 5" "$work/said" || { cat "$work/said"; fail "verify does not name the frame"; }
log recover "$work/flip" "$work/clean2" && log verify "$work/clean2" | grep -q "1 frames have no pixels: 5" || fail "a damaged frame was kept"
echo "# later" >>"$work/clean/rig.toml"; log verify "$work/clean" | grep -q "rig.toml is not what it was" || fail "a changed rig verifies"

echo "-- cut: a flight of its own, with the same times"
log cut "$work/flight" "$work/part" --from 0.5 --to 1.5 || fail "cut"
log cut "$sortie" "$work/part2" --from 0.5 --to 1.5 || fail "cut of a sortie"
for part in part part2; do
  "$b/bin/cyclops-offline" "$work/$part" --out "$work/$part.csv" --summary "$work/$part.json" -q >/dev/null || fail "offline of $part"
done
"$b/bin/cyclops-offline" "$work/flight" --out "$work/all.csv" -q >/dev/null
/usr/bin/python3 - "$work/all.csv" "$work/part.csv" "$work/part2.csv" <<'PY' || fail "the cut flight has other times"
import csv, sys
times = [sorted({int(r["mid_exposure_ns"]) for r in csv.DictReader(open(p))}) for p in sys.argv[1:]]
print([len(t) for t in times])
sys.exit(0 if all(28 <= len(t) <= 31 and set(t) <= set(times[0]) for t in times[1:]) else 1)
PY

echo "-- exported"
log export "$sortie" --measurements "$work/m.csv" --nav "$work/n.csv" --health "$work/h.csv" --frames "$work/png" --pictures "$work/drawn" --from 1 --to 1.5 || fail "export"
[ "$(wc -l <"$work/n.csv")" = 61 ] && [ "$(ls "$work/png" | wc -l)" -ge 14 ] && head -1 "$work/h.csv" | grep -q record.frames || fail "what was exported"
/usr/bin/python3 - "$work/png" "$work/board/frames" <<'PY' || fail "a picture is not the one that was served"
import os, sys
from PIL import Image
for name in sorted(os.listdir(sys.argv[1])):
    number = int(name[6:12]) - 1
    if Image.open(os.path.join(sys.argv[1], name)).tobytes() != Image.open(os.path.join(sys.argv[2], f"frame_{number:04d}.png")).tobytes(): sys.exit(name)
PY

echo "-- a disk that takes 0.3 MB/s"
RECORD_OPTIONS="--record-limit 0.3" fly "$work/flight" "$work/slow" 1
lost=$(value "$work/slow/service.json" 's["record"]["frames_lost_by_cause"]["queue_full"]')
chain=$(value "$work/slow/service.json" 's["frames_in_chain"]')
[ "$lost" -gt 0 ] || fail "nothing was lost on a slow disk"
[ $(($(value "$work/slow/service.json" 's["record"]["frames"]') + lost)) = "$chain" ] || fail "frames of the slow disk do not add up"
replays "$work/slow/sortie"

echo "-- a full disk"
mkdir "$work/small"
if mount -t tmpfs -o size=5m none "$work/small"; then
  RECORD_OPTIONS="--record-reserve 2.5" fly "$work/flight" "$work/small/live" 1
  cp -r "$work/small/live" "$work/full"; umount "$work/small"
  full=$(value "$work/full/service.json" 's["record"]["frames_lost_by_cause"]["disk_full"]')
  [ "$full" -gt 0 ] && [ "$(value "$work/full/service.json" 's["frames_in_chain"]')" -gt 0 ] || fail "the full disk was not noticed, or tracking ended"
  log verify "$work/full/sortie" | tee "$work/said"
  grep -qE "checksum|hold no event|inside an event" "$work/said" && fail "a full disk left a broken event"
else
  echo "no right to mount: a full disk is left to the unit tests"
fi
echo "records are what they say"
