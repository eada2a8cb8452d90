#!/bin/bash
# bench.sh BUILD FLIGHT: the same on a machine that has gpio-sim itself (root). Real time: figures depend on its load.
set -euo pipefail
cd "$(dirname "$0")/../.."
b=$1 flight=$2 out=build/gpio/bench
mkdir -p "$out"
chip=$(tools/gpio_sim.sh up cyclops-sim); trap 'tools/gpio_sim.sh down cyclops-sim' EXIT
"$b/test/gpio-tests"
chip=$(echo /sys/devices/platform/gpio-sim.*/gpiochip*)
echo 0 >"$out/tests.rc"
test/in-netns.sh test/gpio/service.sh "$b" "$chip" "$flight" "$out"; echo $? >"$out/service.rc"
/usr/bin/python3 test/gpio/judge.py "$out"
