#!/bin/bash
# initrd.sh IMAGE_ROOT KERNEL OUT: a small first file system; it loads the drivers of the shared folder and goes over to the
# root of this machine, read-only over 9p, with the init that the kernel's command line names (TESTINIT=).
set -euo pipefail
root=$1 kernel=$2 out=$3
d=$(mktemp -d); trap 'rm -rf "$d"' EXIT
mkdir -p "$d"/{bin,modules,proc,root}
cp /bin/busybox "$d/bin/"
for m in virtio_pci 9pnet_virtio 9p configfs; do
  modprobe -d "$root" -S "$kernel" --show-depends "$m" 2>/dev/null | awk '$1 == "insmod" { print $2 }'
done | awk '!seen[$0]++' | while read -r f; do
  n=$(basename "$f"); n=${n%.xz}; n=${n%.zst}
  case $f in *.xz) xz -dc "$f" ;; *.zst) zstd -dc "$f" ;; *) cat "$f" ;; esac >"$d/modules/$n"
  echo "$n" >>"$d/order"
done
cat >"$d/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox mount -t proc proc /proc
while read m; do /bin/busybox insmod /modules/$m || /bin/busybox echo "insmod $m failed"; done </order
/bin/busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288,cache=loose,ro hostroot /root || /bin/busybox poweroff -f
/bin/busybox umount /proc
exec /bin/busybox switch_root /root "$TESTINIT"
INIT
chmod +x "$d/init"
(cd "$d" && find . | cpio -o -H newc --quiet | gzip -1) >"$out"
