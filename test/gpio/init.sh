#!/bin/bash
# init.sh: first process of the virtual machine of `make gpio`. The root is this machine's own, read-only; OUT (kernel command
# line) is the folder shared for results, REPO and BUILD tell where things are.
export PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp
mount -t proc proc /proc; mount -t sysfs sysfs /sys; mount -t devtmpfs dev /dev
mkdir -p /dev/shm /dev/pts
for t in /run /tmp /dev/shm /mnt; do mount -t tmpfs tmpfs $t; done
mount -t configfs configfs /sys/kernel/config
[ -e /dev/fd ] || ln -s /proc/self/fd /dev/fd
ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo
mkdir /mnt/out; mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288 out /mnt/out
end() { sync; umount /mnt/out; /bin/busybox poweroff -f; }
trap end EXIT
out=/mnt/out; cd "$REPO"
read -r up _ </proc/uptime
echo "kernel $(uname -r), in the machine after $up s of its time"
insmod "$MODULES/irq_sim.ko"; insmod "$MODULES/gpio-sim.ko"
chip=$(tools/gpio_sim.sh up cyclops-sim) || { echo "no chip"; exit 1; }
"$BUILD/test/gpio-tests" --gtest_brief=0 >"$out/tests.txt" 2>&1; echo $? >"$out/tests.rc"
grep -vE '^\[ RUN|^\[---|^\[===|^$' "$out/tests.txt"
chip=$(echo /sys/devices/platform/gpio-sim.*/gpiochip*)
echo "service and replayer on $chip"
"$REPO/test/gpio/service.sh" "$BUILD" "$chip" "$FLIGHT" "$out" >"$out/service.txt" 2>&1; echo $? >"$out/service.rc"
tail -n 4 "$out/service.txt"
read -r up _ </proc/uptime; echo "after $up s of its time"
