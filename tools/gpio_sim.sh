#!/bin/bash
# gpio_sim.sh up|down [NAME]: makes or removes a simulated GPIO chip of 32 lines (label NAME, default cyclops-sim; line 17 is
# called STROBE, line 18 PPS) for a bench, and prints the folder that cyclops-replay --gpio-sim wants. Needs root and the
# kernel's gpio-sim module; Debian 12 and 13 kernels lack it, `make gpio` builds it (docs/time.md).
set -euo pipefail
what=${1:-} name=${2:-cyclops-sim} config=/sys/kernel/config/gpio-sim
case $what in
up)
  mountpoint -q /sys/kernel/config || mount -t configfs configfs /sys/kernel/config
  [ -d "$config" ] || modprobe gpio-sim
  mkdir -p "$config/$name/bank0/line17" "$config/$name/bank0/line18"
  echo 32 >"$config/$name/bank0/num_lines"
  echo "$name" >"$config/$name/bank0/label"
  echo STROBE >"$config/$name/bank0/line17/name"
  echo PPS >"$config/$name/bank0/line18/name"
  echo 1 >"$config/$name/live"
  echo "/sys/devices/platform/$(cat "$config/$name/dev_name")/$(cat "$config/$name/bank0/chip_name")"
  ;;
down)
  echo 0 >"$config/$name/live"
  rmdir "$config/$name"/bank0/line* "$config/$name/bank0" "$config/$name"
  ;;
*) echo "usage: gpio_sim.sh up|down [NAME]" >&2; exit 2 ;;
esac
