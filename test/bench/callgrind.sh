#!/bin/bash
# callgrind.sh BUILD: instructions a pixel of the corner kernel. They do not move with the machine's load.
set -eu
b=$1; out=$(mktemp -d); trap 'rm -rf "$out"' EXIT
full=$((1024 * 1024)); boxes=$((28 * 61 * 61))
one() {  # one NAME PIXELS WHAT
  valgrind --tool=callgrind --toggle-collect='cyclops::CornerKernel::run(*' --callgrind-out-file="$out/$1" \
    "$b/bin/bench" "$1" >"$out/log" 2>&1 || { cat "$out/log"; exit 1; }
  awk -v px="$2" -v what="$3" '/^summary:|^totals:/ { printf "  %-44s %6.1f instructions a pixel\n", what, $2 / px; exit }' "$out/$1"
}
one once_full $full "full frame, 7 taps, 8 bit"
one once_full_16 $full "full frame, 7 taps, 16 bit"
one once_boxes $boxes "28 boxes of 61x61, 7 taps, 8 bit"
one once_boxes_16 $boxes "28 boxes of 61x61, 7 taps, 16 bit"
one once_boxes_9 $boxes "28 boxes of 61x61, 9 taps, 8 bit"
