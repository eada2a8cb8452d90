#!/bin/bash
# rig_test.sh BUILD: the unmodified service, fed over GVSP, strobe socket and LCM multicast in a namespace of its own, says
# bit for bit what the offline run of the same flight says: at real speed, as fast as it can, with both profiles; and a
# service without a camera, or with TSPI of one aircraft only, stays up and says so.
set -u
cd "$(dirname "$0")/../.."
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; exit 1; }

/usr/bin/python3 test/tools/make_folder.py "$work/board" 60 >/dev/null || fail "pictures of a board"
"$b/bin/cyclops-import" "$work/board" --out "$work/flight" || fail "import"
for run in "- 1" "- 0" "config/thesis-2007.toml 0"; do
  read -r profile speed <<<"$run"
  config=(); [ "$profile" != - ] && config=(--config "$profile")
  "$b/bin/cyclops-offline" "$work/flight" "${config[@]}" --out "$work/offline.lcm" --summary "$work/offline.json" -q || fail "offline $run"
  "$b/bin/cyclops-offline" "$work/flight" "${config[@]}" --out "$work/again.lcm" -q >/dev/null || fail "offline again"
  cmp "$work/offline.lcm" "$work/again.lcm" || fail "two offline runs differ"
  same=0
  for try in 1 2 3; do  # a machine that stalls may cost frames, which are then counted; what arrived must still be the same
    hil/rig.sh "$b" "$work/flight" "$work/live" "$profile" "$speed" 2>"$work/replay.log" || { cat "$work/live/service.log"; fail "rig $run"; }
    "$b/bin/cyclops-log" diff "$work/offline.lcm" "$work/live/live.lcm" && same=1 && break
    lost=$(/usr/bin/python3 -c 'import json,sys; s=json.load(open(sys.argv[1])); r=json.load(open(sys.argv[2])); print(sum(s["frames_lost_by_cause"].values())+s["frames_incomplete"]+r["late"]+r["frames_unsent"]+s["camera"]["losses"])' "$work/live/service.json" "$work/live/replay.json")
    [ "$lost" != 0 ] || fail "live and offline differ although nothing was lost or late ($run)"
    echo "try $try: $lost frames lost, late or cut on this machine"
  done
  [ $same = 1 ] || fail "live never agreed with offline in three runs ($run)"
done

# No camera: it stays up, says so once, ends cleanly on SIGTERM with the code for "no frame".
CYCLOPS=$b/bin/cyclops test/in-netns.sh bash -c '"$CYCLOPS" --rig "$1/flight/rig.toml" --summary "$1/none.json" 2>"$1/none.log" & p=$!; sleep 3; kill -TERM $p; wait $p' _ "$work"
[ $? = 4 ] || fail "exit code without a camera"
grep -q "waiting for it" "$work/none.log" || fail "no word about the missing camera"
echo "live and offline agree"
