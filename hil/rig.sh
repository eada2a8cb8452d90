#!/bin/bash
# rig.sh BUILD FLIGHT OUT [PROFILE|-] [SPEED] [REPLAY OPTION...]: plays a flight through the whole rig, in a network namespace of
# its own. OUT gets live.lcm (all that was heard on the network), service.json, replay.json, the logs and, while it runs,
# service.pid; with RECORD=yes also sortie/, what the service recorded (RECORD_OPTIONS: more for it; RECORD_IN: the folder it goes
# into). STEPS=n: n frames at a time. CYCLOPS_IDLE_S: the service ends after so many seconds without a frame. CYCLOPS_CHANNELS: a
# regular expression of what is logged. Needs no free port and no privileges beyond those for a namespace.
set -u
cd "$(dirname "$0")/.."
if [ -z "${CYCLOPS_IN_NETNS:-}" ]; then CYCLOPS_IN_NETNS=1 exec test/in-netns.sh "$0" "$@"; fi
b=$1 flight=$2 out=$3 profile=${4:--} speed=${5:-1}
mkdir -p "$out"
# A socket of its own name, so that two rigs on one machine do not meet.
export LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
rm -rf "$out"/live.lcm "$out"/sortie
config=(); [ "$profile" != - ] && config=(--config "$profile")
# shellcheck disable=SC2206
record=(); [ "${RECORD:-no}" = yes ] && record=(--record "${RECORD_IN:-$out}" --record-name sortie ${RECORD_OPTIONS:-})
lcm-logger --quiet --force --channel="${CYCLOPS_CHANNELS:-.*}" "$out/live.lcm" >"$out/logger.log" 2>&1 & logger=$!
"$b/bin/cyclops" --rig "$flight/rig.toml" "${config[@]}" "${record[@]}" --summary "$out/service.json" --exit-when-idle "${CYCLOPS_IDLE_S:-2}" >"$out/service.log" 2>&1 & service=$!
echo $service >"$out/service.pid"
trap 'kill $logger $service 2>/dev/null' EXIT
sleep 0.2
commands() {  # with STEPS=n: n frames at a time
  [ -n "${STEPS:-}" ] || return
  sleep 1.5; for _ in $(seq 8); do echo "step $STEPS"; sleep 0.4; done; echo play
}
"$b/bin/cyclops-replay" "$flight" ${STEPS:+--paused} --speed "$speed" --summary "$out/replay.json" "${@:6}" < <(commands)
status=$?
wait $service; served=$?
rm -f "$out/service.pid"
sleep 0.2; kill -INT $logger 2>/dev/null; wait $logger 2>/dev/null
trap - EXIT
[ $status = 0 ] && [ $served = 0 ] || { tail -n 20 "$out/service.log" >&2; exit 1; }
