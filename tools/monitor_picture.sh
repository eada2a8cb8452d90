#!/bin/bash
# monitor_picture.sh BUILD FLIGHT OUTDIR [SECONDS]: pictures of cyclops-web and cyclops-top while FLIGHT goes through the rig:
# OUTDIR/web.png and OUTDIR/top.png. All of it in a network namespace and on a screen of its own (needs `make deps-extra`).
set -u
cd "$(dirname "$0")/.."
if [ -z "${CYCLOPS_IN_NETNS:-}" ]; then CYCLOPS_IN_NETNS=1 exec test/in-netns.sh "$0" "$@"; fi
b=$1 flight=$2 out=$3 seconds=${4:-40}
export LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
dir=$(mktemp -d)
exec {shown}< <(Xvfb -displayfd 1 -screen 0 1100x760x24 -nolisten tcp 2>/dev/null)
screen=$!
read -r -t 20 number <&"$shown" || { echo "monitor_picture: Xvfb does not start" >&2; exit 1; }
export DISPLAY=:$number
"$b/bin/cyclops" --rig "$flight/rig.toml" --thumbnail-hz 4 --thumbnail-px 1024 2>"$dir/service.log" & service=$!
"$b/bin/cyclops-web" --port 0 >"$dir/url" & web=$!
xterm -geometry 120x40+0+0 -fa "DejaVu Sans Mono" -fs 11 -bg black -fg gray85 -e "$b/bin/cyclops-top" & terminal=$!
trap 'kill $service $web $terminal ${replay:-} $screen 2>/dev/null; wait $service; rm -rf "$dir"' EXIT
sleep 1
"$b/bin/cyclops-replay" "$flight" -q </dev/null & replay=$!
/usr/bin/python3 tools/browser.py "$(cat "$dir/url")" --until 'picture !== null && news.health.range_m > 0' --after "$seconds" --size 1480x960 --picture "$dir/web.png" & browser=$!
sleep "$seconds"
import -window root -trim +repage "$dir/top.png"
wait $browser || exit 1
for picture in top web; do convert "$dir/$picture.png" -colors 128 -strip -define png:compression-level=9 "$out/$picture.png"; done
