#!/bin/bash
# disk.sh FOLDER MB COMMAND...: runs COMMAND with an ext4 file system of that size mounted on FOLDER, in a mount namespace of its own.
# The image lies beside it and goes when the command ends, whatever has become of the file system. Needs root.
set -u
folder=$1 size=$2; shift 2
if [ -z "${CYCLOPS_OWN_MOUNTS:-}" ]; then CYCLOPS_OWN_MOUNTS=1 exec unshare -m --propagation private -- "$0" "$folder" "$size" "$@"; fi
mkdir -p "$folder" || exit 1
image=$folder.ext4
truncate -s "${size}M" "$image" && mkfs.ext4 -q -F -O ^has_journal "$image" && mount -o loop,errors=remount-ro "$image" "$folder" || exit 1
"$@"; status=$?
fsfreeze -u "$folder" 2>/dev/null
ls -la "$folder"/* >"$folder.list" 2>&1
umount "$folder" || umount -l "$folder"
rm -f "$image"
exit $status
