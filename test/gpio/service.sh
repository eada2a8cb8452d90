#!/bin/bash
# service.sh BUILD CHIP_FOLDER FLIGHT OUT: the service as it flies, its strobe and PPS on lines of a gpio-sim chip that the
# replayer pulses. OUT gets service.json and replay.json. Used by `make gpio` inside the machine, and by bench.sh outside.
set -u
b=$1 chip=$2 flight=$3 out=$4
work=$(mktemp -d); cp "$flight"/* "$work/"
label=cyclops-sim
# The rig of the flight, but for the lines.
awk -v label="$label" '/^\[/ { skip = ($0 == "[strobe]" || $0 == "[time]" || $0 == "[pps]") } !skip' "$flight/rig.toml" >"$work/rig-gpio.toml"
cat >>"$work/rig-gpio.toml" <<RIG
[strobe]
source = "gpio"
chip = "$label"
line_name = "STROBE"
[pps]
source = "gpio"
chip = "$label"
line_name = "PPS"
[time]
gps_from = "pps"
RIG
export LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0"
"$b/bin/cyclops" --rig "$work/rig-gpio.toml" --summary "$out/service.json" --exit-when-idle 4 & service=$!
sleep 1
"$b/bin/cyclops-replay" "$flight" --gpio-sim "$chip" --gpio-strobe 17 --gpio-pps 18 --summary "$out/replay.json" --quiet --wait 60 </dev/null
played=$?
wait $service; served=$?
rm -rf "$work"
[ $played = 0 ] && [ $served = 0 ]
