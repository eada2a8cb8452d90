#!/bin/bash
# run.sh BUILD [SCENARIO] [PROFILE] [FRAMES]: make run. Draws a flight once, flies it through the whole rig, scores, reports.
# By default the first 20 s of the thesis' baseline, S1: from 100 to 72 ft. FRAMES 0: all that the scenario has.
set -eu
cd "$(dirname "$0")/.."
b=$1 scenario=${2:-config/scenarios/s1.toml} profile=${3:--} frames=${4:-600}
name=$(basename "$scenario" .toml)
short=() flight=build/flights/$name
[ "$frames" = 0 ] || { short=(--frames "$frames"); flight=$flight-$frames; }
out=build/run
say() { printf '\n\033[1m%s\033[0m\n' "$*"; }

if [ ! -e "$flight/manifest.toml" ] || [ "$scenario" -nt "$flight/manifest.toml" ] || [ config/scenarios/base.toml -nt "$flight/manifest.toml" ] || [ "$b/bin/cyclops-flight" -nt "$flight/manifest.toml" ]; then
  say "1/4  drawing the flight ($scenario)"
  "$b/bin/cyclops-flight" --scenario "$scenario" --out "$flight" --replace "${short[@]}"
else
  say "1/4  the flight is there ($flight)"
fi

say "2/4  flying it: GigE Vision on loopback, strobe edges, TSPI over LCM"
rm -rf "$out"; mkdir -p "$out"
hil/rig.sh "$b" "$flight" "$out" "$profile"

say "3/4  scoring against truth; the same flight offline"
config=(); [ "$profile" != - ] && config=(--config "$profile")
"$b/bin/cyclops-score" "$flight" "$out/live.lcm" --service "$out/service.json" --replay "$out/replay.json" --summary "$out/summary.json" --scores "$out/scores.csv"
"$b/bin/cyclops-offline" "$flight" "${config[@]}" --out "$out/offline.lcm" --summary "$out/offline.json" --quiet >/dev/null
same=$("$b/bin/cyclops-log" diff "$out/offline.lcm" "$out/live.lcm" || true)
rm -f "$out/offline.lcm"

say "4/4  report"
/usr/bin/python3 tools/report.py "$flight" "$out/live.lcm" "$out/summary.json" "$out/scores.csv" "$out" --types build/gen/python
/usr/bin/python3 tools/show_summary.py "$out/summary.json"
echo "live against offline: $same"
echo "report: $out/report.html   figures: $out/summary.json"
