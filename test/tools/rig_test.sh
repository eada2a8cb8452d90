#!/bin/bash
# rig_test.sh BUILD: the unmodified service, fed over GVSP, strobe socket and LCM multicast in a namespace of its own, at real
# speed, as fast as it can, with both profiles, records what it did.
#   Always: the recorded sortie, replayed offline, says bit for bit what was published, however much the machine lost on the
#   way; what was heard on the network is part of it; every frame served is accounted for.
#   When nothing was lost or late: the same as the offline run of the original flight.
# And a service without a camera stays up and says so.
set -u
cd "$(dirname "$0")/../.."
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*"; exit 1; }

# What a try lost: frames by the camera's numbers and by us, frames of the record; nothing may be unaccounted for.
account() {
  /usr/bin/python3 - "$work/live/service.json" "$work/live/replay.json" <<'PY'
import json, sys
s, r = (json.load(open(p)) for p in sys.argv[1:])
lost, record = s["frames_lost_by_cause"], s["record"]
capture = sum(lost[k] for k in ("gap", "leader", "no_buffer", "size_mismatch", "rows_unknown"))
inside = lost["queue_full"] + lost["no_room"]
unseen = r["frames_served"] - s["frames_received"] - capture   # the last ones: no later number tells of them
print(f"{r['frames_served']} served = {s['frames_received']} received + {capture} lost on the way + {unseen} after the last one seen; "
      f"{s['frames_in_chain']} in the chain, {inside} refused inside; {record['frames']} recorded, {sum(record['frames_lost_by_cause'].values())} not", file=sys.stderr)
wrong = []
if s["camera"]["losses"] == 0 and not 0 <= unseen: wrong.append("more frames counted than were served")
if s["frames_received"] + lost["leader"] + lost["rows_unknown"] != s["frames_in_chain"] + inside: wrong.append("frames received are not those in the chain and refused")
if record["frames"] + sum(record["frames_lost_by_cause"].values()) != s["frames_in_chain"]: wrong.append("frames recorded and not recorded are not those in the chain")
if record["inputs_lost"] or record["published_lost"]: wrong.append("messages are missing in the record")
if wrong: sys.exit("; ".join(wrong))
print(sum(record["frames_lost_by_cause"].values()), capture + inside + unseen + r["late"] + r["frames_unsent"] + s["frames_incomplete"] + s["camera"]["losses"])
PY
}

/usr/bin/python3 test/tools/make_folder.py "$work/board" 60 >/dev/null || fail "pictures of a board"
"$b/bin/cyclops-import" "$work/board" --out "$work/flight" || fail "import"
for run in "- 1" "- 0" "config/thesis-2007.toml 0"; do
  read -r profile speed <<<"$run"
  config=(); [ "$profile" != - ] && config=(--config "$profile")
  "$b/bin/cyclops-offline" "$work/flight" "${config[@]}" --out "$work/offline.lcm" --summary "$work/offline.json" -q || fail "offline $run"
  "$b/bin/cyclops-offline" "$work/flight" "${config[@]}" --out "$work/again.lcm" -q >/dev/null || fail "offline again"
  cmp "$work/offline.lcm" "$work/again.lcm" || fail "two offline runs differ"
  same=0 whole=0
  for try in 1 2 3; do
    RECORD=yes hil/rig.sh "$b" "$work/flight" "$work/live" "$profile" "$speed" 2>"$work/replay.log" || { cat "$work/live/service.log"; fail "rig $run"; }
    sums=$(account) || fail "the counters do not balance ($run)"
    read -r unrecorded lost <<<"$sums"
    "$b/bin/cyclops-offline" "$work/live/sortie" --out "$work/sortie.lcm" --summary "$work/sortie.json" -q || fail "the recorded sortie cannot be replayed ($run)"
    # A disk that stalls may cost pixels, which are then counted; from there on there is nothing to compare.
    until=$(/usr/bin/python3 -c 'import json,sys; print(json.load(open(sys.argv[1]))["first_frame_without_pixels"])' "$work/sortie.json")
    "$b/bin/cyclops-log" diff --by-seq --before "$until" "$work/live/sortie" "$work/sortie.lcm" || fail "the recorded sortie does not give what was published ($run)"
    [ "$until" = 0 ] && whole=1
    "$b/bin/cyclops-log" diff --heard "$work/live/sortie" "$work/live/live.lcm" || fail "what was heard was not what was published ($run)"
    "$b/bin/cyclops-log" diff "$work/offline.lcm" "$work/live/sortie" && same=1 && [ $whole = 1 ] && break
    [ "$lost" != 0 ] || [ $same = 1 ] || fail "live and offline differ although nothing was lost or late ($run)"
    echo "try $try: $lost frames lost, late or cut on this machine, $unrecorded not recorded"
  done
  [ $whole = 1 ] || echo "REPORT: in three tries this machine never recorded the pixels of every frame ($run)"
  [ $same = 1 ] || echo "REPORT: in three tries this machine never got the flight through without loss; compared with the record alone ($run)"
done

# No camera: it stays up, says so once, ends cleanly on SIGTERM with the code for "no frame".
CYCLOPS=$b/bin/cyclops test/in-netns.sh bash -c '"$CYCLOPS" --rig "$1/flight/rig.toml" --summary "$1/none.json" 2>"$1/none.log" & p=$!; sleep 3; kill -TERM $p; wait $p' _ "$work"
[ $? = 4 ] || fail "exit code without a camera"
grep -q "waiting for it" "$work/none.log" || fail "no word about the missing camera"
echo "live and offline agree"
