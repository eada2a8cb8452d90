#!/bin/bash
# run.sh BUILD: make gpio. The GPIO code on a real kernel: Debian's own, in a virtual machine without hardware support, with a
# simulated GPIO chip; then the whole service in it, its strobe and PPS pulsed by the replayer. Virtual time (-icount): one
# instruction is 4 ns and waiting costs nothing, so a busy host changes no figure.
set -euo pipefail
cd "$(dirname "$0")/../.."
repo=$PWD b=$(cd "$1" && pwd) dir=$repo/build/gpio
test/gpio/prepare.sh "$dir"
flight=$dir/flight
[ -e "$flight/manifest.toml" ] || { echo "gpio: drawing a small flight"; "$b/bin/cyclops-flight" --scenario test/gpio/scenario.toml --out "$flight" --replace >"$dir/flight.log" 2>&1 || { tail "$dir/flight.log" >&2; exit 1; }; }
out=$dir/out; rm -rf "$out"; mkdir -p "$out"
echo "gpio: [$SECONDS s] starting the machine"
append="console=ttyS0 quiet panic=-1 tsc=unstable TESTINIT=$repo/test/gpio/init.sh REPO=$repo BUILD=$b MODULES=$dir FLIGHT=$flight"
timeout 2400 qemu-system-x86_64 -accel tcg -icount shift=2,sleep=off -rtc clock=vm -cpu max -smp 1 -m 2048 -nographic -no-reboot -nodefaults -serial stdio \
  -kernel "$dir/vmlinuz" -initrd "$dir/initrd.gz" -append "$append" \
  -virtfs local,path=/,mount_tag=hostroot,security_model=none,multidevs=remap,readonly=on \
  -virtfs "local,path=$out,mount_tag=out,security_model=none" </dev/null 2>&1 | stdbuf -o0 tr -d '\r\033' | tee "$out/console.txt"
echo "gpio: [$SECONDS s] judging"
/usr/bin/python3 test/gpio/judge.py "$out"
