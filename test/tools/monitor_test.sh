#!/bin/bash
# monitor_test.sh BUILD: service, cyclops-top, cyclops-web and a browser over real LCM in a namespace of their own; no camera is
# there, so there is something to be alarmed about. Then TSPI with and without tags, and a flood.
set -u
cd "$(dirname "$0")/../.."
if [ -z "${CYCLOPS_IN_NETNS:-}" ]; then CYCLOPS_IN_NETNS=1 exec test/in-netns.sh "$0" "$@"; fi
b=$1
work=$(mktemp -d)
running=()
finish() { [ ${#running[@]} = 0 ] || kill "${running[@]}" 2>/dev/null; wait; rm -rf "$work"; }
trap finish EXIT
fail() { echo "FAILED: $*"; tail -n 30 "$work"/*.log 2>/dev/null; exit 1; }
start() { "$@" & running+=($!); }
has() { grep -qF -- "$2" "$1" || { cat "$1"; fail "no \"$2\" in $1"; }; }
# figure FILE KEY...: from a JSON file
figure() { /usr/bin/python3 -c 'import functools,json,sys; print(functools.reduce(lambda j, k: j[k], sys.argv[2:], json.load(open(sys.argv[1]))))' "$@"; }

plain="udpm://239.255.76.67:7667?ttl=0" net="udpm://239.255.76.67:7668?ttl=0"
export LCM_DEFAULT_URL=$net
/usr/bin/python3 test/tools/make_folder.py "$work/board" 60 >/dev/null || fail "pictures of a board"
"$b/bin/cyclops-import" "$work/board" --out "$work/flight" >/dev/null || fail "import"
(umask 077; head -c 32 /dev/urandom | od -An -v -tx1 | tr -d ' \n' >"$work/key")

# --- nobody there ---
"$b/bin/cyclops-top" --once --wait 0.5 >"$work/silent.txt"
[ $? = 3 ] || fail "cyclops-top without a service"
has "$work/silent.txt" "STALE: no HEALTH"

# --- a service that waits for everything ---
"$b/bin/cyclops" --rig "$work/flight/rig.toml" --key "$work/key" --summary "$work/service.json" 2>"$work/service.log" & service=$!
running+=($service)
"$b/bin/cyclops-top" --once --wait 10 >"$work/top.txt"
[ $? = 2 ] || fail "cyclops-top with alarms"
for words in "STARTING" "FAULT   camera is silent" "FAULT   no TSPI of the receiver" "tags required"; do has "$work/top.txt" "$words"; done
[ "$(wc -l <"$work/top.txt")" = 24 ] && [ "$(wc -L <"$work/top.txt")" -le 80 ] || fail "the page is not 80x24"
if command -v script >/dev/null; then  # a real terminal: it draws, q ends it, the terminal is given back
  (sleep 2; printf q) | TERM=xterm timeout 10 script -qec "stty rows 24 cols 80; $b/bin/cyclops-top" "$work/typescript" >/dev/null || fail "cyclops-top in a terminal"
  has "$work/typescript" "camera is silent"
fi

# --- the page, by HTTP and in a browser ---
start "$b/bin/cyclops-web" --port 0 >"$work/web.txt" 2>"$work/web.log"
for _ in $(seq 50); do [ -s "$work/web.txt" ] && break; sleep 0.1; done
url=$(cat "$work/web.txt"); [ -n "$url" ] || fail "cyclops-web does not say where it is"
sleep 1
/usr/bin/python3 -c 'import sys,urllib.request; sys.stdout.write(urllib.request.urlopen(sys.argv[1] + "health", timeout=5).read().decode())' "$url" >"$work/health.json" || fail "health by HTTP"
has "$work/health.json" '"name":"camera.silent"'
has "$work/health.json" '"stale":false'
/usr/bin/python3 tools/browser.py "$url" --until 'document.getElementById("alarms").textContent.includes("FAULT: camera is silent")' \
  --print 'document.getElementById("state").textContent' --print 'document.body.classList.contains("stale")' --print 'document.getElementById("losses").textContent' \
  >"$work/page.txt" 2>"$work/browser.log"
case $? in
  0) printf 'STARTING\nFalse\nnone\n' | cmp -s - "$work/page.txt" || { cat "$work/page.txt"; fail "the page in a browser says something else"; } ;;
  77) echo "skipped: no Chromium, so the page was not opened in a browser" ;;
  *) fail "the page in a browser" ;;
esac

# --- tags: the bench signs what it plays; plain messages are refused, replayed ones too ---
start "$b/bin/cyclops-sign" --key "$work/key" --from "$plain" --to "$net" >"$work/sign.txt"
lcm-logger --quiet --force --lcm-url="$net" -c "SIGNED_.*" "$work/signed.lcm" & logger=$!
"$b/bin/cyclops-replay" "$work/flight" --lcm "$plain" -q </dev/null 2>"$work/replay.log" || fail "replay"
sleep 0.5; kill -INT $logger; wait $logger 2>/dev/null
lcm-logplayer --lcm-url="$net" "$work/signed.lcm" >/dev/null 2>&1 || fail "playing the signed messages again"
"$b/bin/cyclops-replay" "$work/flight" --lcm "$net" --frames 30 -q </dev/null 2>"$work/replay.log"   # without tags
sleep 1
"$b/bin/cyclops-top" --once >"$work/top.txt"
kill -TERM $service; wait $service
accepted=$(figure "$work/service.json" tspi receiver accepted)
[ "$accepted" -gt 20 ] || fail "signed TSPI was not taken ($accepted)"
[ "$(figure "$work/service.json" tspi receiver replayed)" -gt 20 ] || fail "replayed TSPI was not seen"
[ "$(figure "$work/service.json" tspi receiver not_authentic)" -gt 5 ] || fail "plain TSPI was not refused"
chmod 640 "$work/key"
"$b/bin/cyclops" --rig "$work/flight/rig.toml" --key "$work/key" 2>"$work/mode.log"
[ $? = 1 ] || fail "a key that others can read was taken"
has "$work/mode.log" "expected mode 600 or 400"
printf '[[alarm]]\nname = "x"\n' >"$work/bad.toml"
"$b/bin/cyclops" --rig "$work/flight/rig.toml" --alarms "$work/bad.toml" 2>"$work/bad.log"
[ $? = 1 ] || fail "a bad file of limits was taken"
echo "monitor: seen, served, signed"
