#!/bin/bash
# flight_refusals_test.sh BUILD: what cyclops-flight does not fly, with which words; disks that fill up at any moment and a power cut.
set -u
cd "$(dirname "$0")/../.."
# A mount namespace of its own, for small disks.
if [ -z "${CYCLOPS_IN_MOUNTS:-}" ]; then
  user=(); [ "$(id -u)" = 0 ] || user=(-r)
  CYCLOPS_IN_MOUNTS=1 exec unshare "${user[@]}" -m -- bash "test/tools/${0##*/}" "$@"
fi
b=$1
work=$(mktemp -d); trap 'mountpoint -q "$work/disk" && umount "$work/disk"; rm -rf "$work"' EXIT
fail() { echo "FAILED: $1"; cat "$work/log" 2>/dev/null; exit 1; }
fly() { "$b/bin/cyclops-flight" --quiet --scenario "$1" --cache "${cache:-$work/cache}" --out "$2" "${@:3}" >"$work/log" 2>&1; }
nothing_in() { [ -z "$(find "$1" -mindepth 1 \( -name '*.part' -o -name manifest.toml -o -name '*.lcm' \))" ]; }
refused() {  # refused WORDS: the scenario on standard input ends with 1 and those words, and leaves no flight
  cat >"$work/x.toml"
  fly "$work/x.toml" "$work/refused"
  [ $? = 1 ] || fail "not refused: $1"
  grep -qF -- "$1" "$work/log" || fail "the error does not say: $1"
  nothing_in "$work" || fail "something was left: $1"
}
base="base = \"$PWD/config/scenarios/embedded.toml\"
name = \"x\"
frames = 3"

refused "x.toml:5: light.sunn: unknown key" <<<"$base
[light]
sunn = 3.0"
refused "the tanker, at x " <<<"${base/frames = 3/frames = 60}
[start]
range_ft = 75.0
[[leg]]
for_s = 2.0
closing_ftps = 60.0"
refused "never sees the tanker" <<<"$base
[mount]
pan_deg = 120.0"
sed '$d' config/heavy/tanker.obj >"$work/open.obj"
heavy="base = \"$PWD/config/scenarios/heavy.toml\"
name = \"x\"
frames = 3
[tanker]"
refused "open.obj: part of material \"light_paint\" is not closed: the edge from x 1586.000 y 4.000 z 192.000 in" <<<"$heavy
mesh = \"$work/open.obj\""
{ cat config/heavy/tanker.csv; echo '77,nowhere near,1000,0,900,corner,,0.1,1,invented'; } >"$work/more.csv"
refused 'feature 77 "nowhere near" at x 1000.000 y 0.000 z 900.000 in' <<<"$heavy
model = \"$work/more.csv\""
refused "none.obj: is not a file" <<<"$heavy
mesh = \"$work/none.obj\""

# Frames of 2.1 MB: the disk is full in the first, in the last, when messages are written, when the flight shares the pictures, or never.
small=config/scenarios/embedded.toml full=0 whole=0
mkdir "$work/disk"
for kib in 3000 6150 6170 6200 6500; do
  mount -t tmpfs -o size=${kib}k tmpfs "$work/disk" || fail "no small disk"
  if cache=$work/disk/cache fly $small "$work/disk/flight" --frames 3; then
    whole=$((whole + 1))
    "$b/bin/cyclops-offline" "$work/disk/flight" --quiet >/dev/null 2>"$work/log" || fail "a flight on a disk of $kib KiB is not whole"
  else
    full=$((full + 1))
    grep -q "No space left on device" "$work/log" || fail "a disk of $kib KiB is not said to be full"
    grep -q "$work/disk/.*: " "$work/log" || fail "no file is named on a disk of $kib KiB"
    [ -e "$work/disk/flight" ] && fail "half a flight on a disk of $kib KiB"
    [ -z "$(find "$work/disk" -name '*.part')" ] || fail "parts left on a disk of $kib KiB"
  fi
  umount "$work/disk"
done
[ $full -ge 3 ] && [ $whole -ge 1 ] || fail "of five disks $full were full and $whole were not"

# Power is cut while frames are written: what is there is not taken for pictures or a flight, and the next call makes both.
"$b/bin/cyclops-flight" --quiet --scenario $small --frames 24 --cache "$work/cut" --out "$work/flight" >"$work/log" 2>&1 & p=$!
for i in $(seq 200); do ls "$work"/cut/*.part/frames.lcm >/dev/null 2>&1 && break; sleep 0.1; done
kill -KILL $p; wait $p 2>/dev/null
[ -n "$(find "$work/cut" -name '*.part')" ] || fail "nothing was under way"
[ -e "$work/flight" ] && fail "half a flight has its name"
part=$(find "$work/cut" -name '*.part' | head -1)
"$b/bin/cyclops-offline" "$part" --quiet >/dev/null 2>&1 && fail "half a flight was flown"
cache=$work/cut fly $small "$work/flight" --frames 24 || fail "the call after it"
"$b/bin/cyclops-offline" "$work/flight" --quiet >/dev/null 2>"$work/log" || fail "the flight after it is not whole"
[ -z "$(find "$work/cut" -name '*.part')" ] || fail "the part of the call that was cut is still there"
echo "ok"
