#!/bin/bash
# prepare.sh OUT: what a virtual machine with a GPIO chip needs, in OUT: vmlinuz, initrd.gz, irq_sim.ko, gpio-sim.ko, version.
#
# The kernel is Debian's own binary, of the version whose headers are installed. It has the GPIO character device but not the
# simulated chip gpio-sim, so that one is built outside of the tree from Debian's source package. Nothing is done twice.
set -euo pipefail
out=$(mkdir -p "$1" && cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
say() { printf 'gpio: [%3ds] %s\n' "$SECONDS" "$*"; }

kernel=$(basename "$(ls -d /usr/src/linux-headers-[0-9]*-amd64 | sort -V | tail -1)" | sed 's/^linux-headers-//')
series=$(cut -d. -f1,2 <<<"$kernel")
version=$(dpkg-query -W -f '${Version}' "linux-headers-$kernel")
[ "$(cat "$out/version" 2>/dev/null)" = "$kernel $version" ] && { say "kernel $kernel is there"; exit 0; }
work=$out/work; rm -rf "$out/version" "$work"; mkdir -p "$work/module"; cd "$work"

fetch() {  # fetch PACKAGE: into this folder, unless a package of that version lies in OUT already
  local have; have=$(ls "$out/$1"_*.deb 2>/dev/null | head -1 || true)
  if [ -n "$have" ]; then echo "$have"; return; fi
  (cd "$out" && apt-get download -qq "$1=$version" 2>/dev/null || apt-get download -qq "$1" 2>/dev/null)
  ls "$out/$1"_*.deb | head -1
}
say "kernel $kernel and its source"
dpkg -x "$(fetch "linux-image-$kernel")" image
dpkg -x "$(fetch "linux-source-$series")" source
say "three files of the source"
tar -xJf "source/usr/src/linux-source-$series.tar.xz" --strip-components=1 \
  "linux-source-$series/drivers/gpio/gpio-sim.c" "linux-source-$series/drivers/gpio/gpiolib.h" "linux-source-$series/kernel/irq/irq_sim.c"
cp drivers/gpio/gpio-sim.c drivers/gpio/gpiolib.h module/
# irq_to_desc is not there for modules; generic_handle_irq does the same with the number.
sed -e 's/handle_simple_irq(irq_to_desc(irqnum));/generic_handle_irq(irqnum);/' -e 's|#include <linux/irq_sim.h>|&\n#include <linux/module.h>|' \
  -e '$aMODULE_LICENSE("GPL");' kernel/irq/irq_sim.c >module/irq_sim.c
echo 'obj-m += irq_sim.o gpio-sim.o' >module/Kbuild
say "building gpio-sim"
make -s -C "/usr/src/linux-headers-$kernel" M="$work/module" modules >module.log 2>&1 || { tail -20 module.log >&2; exit 1; }
say "initrd"
depmod -b image "$kernel"
"$here/initrd.sh" image "$kernel" "$out/initrd.gz"
cp module/irq_sim.ko module/gpio-sim.ko "$out/"
cp "image/boot/vmlinuz-$kernel" "$out/vmlinuz"
cd "$out"; rm -rf "$work"
echo "$kernel $version" >version
say "kernel $kernel is ready"
