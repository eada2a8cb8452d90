#!/bin/bash
# init.sh: first process of the virtual machine of `make gpio`. The root is this machine's own, read-only. From the kernel's command
# line: REPO, BUILD, MODULES (kernel modules), FLIGHT; the shared folder `out` takes results.
#
# Time in the machine runs on while it waits for the host, so nothing may be read from or written to the host while something is
# measured: files are copied into memory first, and results out of it afterwards.
export PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp
mount -t proc proc /proc; mount -t sysfs sysfs /sys; mount -t devtmpfs dev /dev
mkdir -p /dev/shm /dev/pts
for t in /run /tmp /dev/shm /mnt; do mount -t tmpfs tmpfs $t; done
mount -t configfs configfs /sys/kernel/config
[ -e /dev/fd ] || ln -s /proc/self/fd /dev/fd
ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo
sysctl -qw net.core.rmem_max=4194304
mkdir /mnt/out /tmp/out; mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288 out /mnt/out
end() { cp /tmp/out/* /mnt/out/; sync; umount /mnt/out; /bin/busybox poweroff -f; }
trap end EXIT

cd "$REPO" || exit 1
echo "kernel $(uname -r)"
insmod "$MODULES/irq_sim.ko"; insmod "$MODULES/gpio-sim.ko"
chip=$(tools/gpio_sim.sh up cyclops-sim) || { echo "no chip"; exit 1; }
mkdir -p /tmp/build/bin /tmp/build/test /tmp/flight
cp "$BUILD"/test/gpio-tests /tmp/build/test/; cp "$BUILD"/bin/cyclops "$BUILD"/bin/cyclops-replay /tmp/build/bin/; cp "$FLIGHT"/* /tmp/flight/; cp test/gpio/service.sh /tmp/
for f in /tmp/build/*/*; do ldd "$f" | awk '/\//{ print $(NF - 1) }'; done | sort -u | xargs cat >/dev/null   # into the page cache
for f in /tmp/build/bin/*; do "$f" --version >/dev/null; done
cd /tmp || exit 1

build/test/gpio-tests >out/tests.txt 2>&1; echo $? >out/tests.rc
grep -vE '^\[ RUN|^\[---|^\[===|^$|^Running' out/tests.txt
chip=$(echo /sys/devices/platform/gpio-sim.*/gpiochip*)
echo "service and replayer on $chip"
./service.sh /tmp/build "$chip" /tmp/flight /tmp/out >out/service.txt 2>&1; echo $? >out/service.rc
tail -n 4 out/service.txt
