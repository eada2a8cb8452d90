#!/bin/bash
# spy_picture.sh BUILD FLIGHT OUT.png: a picture of lcm-spy while FLIGHT goes through the rig, HEALTH and MEASUREMENT opened.
# All of it in a network namespace and on a screen of its own (needs `make types deps-extra`); FLIGHT must last 30 s or more.
set -u
cd "$(dirname "$0")/.."
if [ -z "${CYCLOPS_IN_NETNS:-}" ]; then CYCLOPS_IN_NETNS=1 exec test/in-netns.sh "$0" "$@"; fi
b=$1 flight=$2 out=$3
row=17 top=28   # lcm-spy's table: height of a row, middle of the first, px
dir=$(mktemp -d)
exec {shown}< <(Xvfb -displayfd 1 -screen 0 1480x900x24 -nolisten tcp 2>/dev/null)
screen=$!
read -r -t 20 number <&"$shown" || { echo "spy_picture: Xvfb does not start" >&2; exit 1; }
export DISPLAY=:$number
tools/spy.sh build/gen/cyclops-types.jar >"$dir/spy.log" 2>&1 & spy=$!
trap 'kill $spy $rig $screen 2>/dev/null; rm -rf "$dir"' EXIT
rig=
sleep 8
hil/rig.sh "$b" "$flight" "$dir/rig" >/dev/null 2>&1 & rig=$!
sleep 8
main=$(xdotool search --name '^LCM Spy$' | head -n 1)
xdotool windowsize "$main" 760 270

# Channels in alphabetical order: CLOCK CORNER EVENT FRAME HEALTH LCM_SELF_TEST MEASUREMENT ...; N is the row, from 0.
open_row() {  # open_row N TITLE X Y WIDTH HEIGHT
  xdotool mousemove --window "$main" 60 $((top + $1 * row)) click --repeat 2 --delay 80 1
  for _ in 1 2 3 4 5 6 7 8 9 10; do
    sleep 0.5
    w=$(xdotool search --name "^$2" | head -n 1)
    [ -n "$w" ] && break
  done
  [ -n "${w:-}" ] || { echo "spy_picture: no window for $2" >&2; return 1; }
  xdotool windowsize "$w" "$5" "$6" windowmove "$w" "$3" "$4"
}
open_row 4 HEALTH 765 0 715 900
open_row 6 MEASUREMENT 0 275 760 625
sleep 6
import -window root "$dir/all.png"
convert "$dir/all.png" -colors 48 -strip -define png:compression-level=9 "$out"
