#!/bin/bash
# cli_test.sh BUILD: what every program says and returns for --help, --version, mistakes on the command line, bad
# configuration and missing files.
set -u
cd "$(dirname "$0")/../.."
b=$1
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
export LCM_DEFAULT_URL="udpm://239.255.76.67:7667?ttl=0"
tests=0 bad=0

run() { timeout 20 "$b/bin/$@" >"$work/out" 2>"$work/err" </dev/null; }
expect() {  # expect STATUS WORDS PROGRAM ARGUMENT...: the exit code, and WORDS somewhere in what it says
  local status=$1 words=$2 got; shift 2
  run "$@"; got=$?
  tests=$((tests + 1))
  if [ "$status" = other ]; then [ $got -ge 100 ] && [ $got -lt 124 ] && status=$got; fi
  if [ $got != "$status" ] || ! cat "$work/out" "$work/err" | grep -qF -- "$words"; then
    bad=$((bad + 1))
    echo "FAILED: $*: exit code $got, expected $status and \"$words\" in:"; cat "$work/out" "$work/err"
  fi
}

rig() {  # rig FOLDER CAMERA-LINE: a folder with rig.toml and tanker.csv
  mkdir -p "$1"
  printf 'id,x,y,z\n1,0,0,0\n' >"$1/tanker.csv"
  printf '[camera]\n%s\n[tanker]\nmodel = "tanker.csv"\n[strobe]\nsource = "none"\n' "$2" >"$1/rig.toml"
}
rig "$work/good" 'width_px = 320'
rig "$work/bad" 'widht_px = 320'
rig "$work/gpio" 'width_px = 320'
sed -i 's/"none"/"gpio"\nchip = "no-such-chip"/' "$work/gpio/rig.toml"
printf '[nav]\nmax_weight_ms = 3\n' >"$work/profile.toml"
mkdir "$work/unfinished"; touch "$work/unfinished/messages.lcm" "$work/unfinished/frames.lcm"
cp -r "$work/unfinished" "$work/died"; touch "$work/died/published.lcm"
printf 'format = "cyclops-sortie-1"\nname = "died"\n[sha256]\n' >"$work/died/sortie.toml"
printf 'no log' >"$work/noise.lcm"; touch "$work/empty.lcm"

version=$(cat VERSION)
for path in "$b"/bin/cyclops*; do
  program=$(basename "$path")
  expect 0 "Usage: " "$program" --help
  expect 0 "$version" "$program" --version
  expect other "help" "$program" --no-such-option     # CLI11: 100 and above
  expect other "help" "$program" a b c d e f g        # more than any of them takes
done

expect other "--rig is required" cyclops
expect 1 "/no/rig.toml: cannot be opened" cyclops --rig /no/rig.toml
expect 1 "$work/bad/rig.toml:2: camera.widht_px: unknown key" cyclops --rig "$work/bad/rig.toml"
expect 1 "$work/profile.toml:2: nav.max_weight_ms: unknown key" cyclops --rig "$work/good/rig.toml" --config "$work/profile.toml"
expect 1 "/no/profile.toml: cannot be opened" cyclops --rig "$work/good/rig.toml" --config /no/profile.toml
expect 3 "lcm nonsense://" cyclops --rig "$work/good/rig.toml" --lcm nonsense://
expect 3 "no-such-chip" cyclops --rig "$work/gpio/rig.toml"
expect other "--thumbnail-hz" cyclops --rig "$work/good/rig.toml" --thumbnail-hz 99

expect 1 "/no/alarms.toml: cannot be opened" cyclops --rig "$work/good/rig.toml" --alarms /no/alarms.toml
expect 1 "$work/profile.toml:1: nav: unknown key" cyclops --rig "$work/good/rig.toml" --alarms "$work/profile.toml"
expect 1 "/no/key: cannot be opened" cyclops --rig "$work/good/rig.toml" --key /no/key
for program in cyclops-top cyclops-web; do expect 1 "lcm nonsense://" $program --lcm nonsense://; done
expect 1 "this is no terminal" cyclops-top
expect other "--columns" cyclops-top --once --columns 79
expect other "--port" cyclops-web --port 70000
expect other "--key is required" cyclops-sign
expect 1 "/no/key: cannot be opened" cyclops-sign --key /no/key --from memq:// --to memq://

for program in cyclops-offline cyclops-replay cyclops-wingrock; do
  expect other "flight is required" $program
  expect 1 "$work/nowhere: is no flight" $program "$work/nowhere"
  expect 1 "a flight that was not finished has none" $program "$work/unfinished"
done
expect 1 "$work/profile.toml:2: nav.max_weight_ms: unknown key" cyclops-offline "$work/nowhere" --config "$work/profile.toml"
expect other "--speed" cyclops-replay "$work/nowhere" --speed 21
expect other "--speed" cyclops-replay "$work/nowhere" --speed -1

expect other "out is required" cyclops-import "$work/nowhere"
expect 1 "$work/nowhere/camera.json: cannot be opened" cyclops-import "$work/nowhere" -o "$work/flight"
expect other "--rate" cyclops-import "$work/nowhere" -o "$work/flight" --rate 0

expect 1 "$work/noise.lcm: byte 0" cyclops-score "$work/nowhere" "$work/noise.lcm" --summary "$work/s.json"
expect 1 "$work/nowhere: is no flight" cyclops-score "$work/nowhere" "$work/empty.lcm" --summary "$work/s.json"
expect other "subcommand" cyclops-log
expect 1 "$work/nowhere.lcm: No such file" cyclops-log info "$work/nowhere.lcm"
expect 1 "$work/noise.lcm: byte 0: the file ends inside an event" cyclops-log info "$work/noise.lcm"
expect 1 "$work/noise.lcm: byte 0" cyclops-log diff "$work/noise.lcm" "$work/noise.lcm"
expect 1 "$work/noise.lcm: byte 0" cyclops-log csv "$work/noise.lcm" "$work/x.csv"
expect 1 "$work/nowhere: is no sortie and no flight" cyclops-log verify "$work/nowhere"
expect 2 "the sortie was not finished" cyclops-log verify "$work/died"
expect 1 "$work/unfinished: is no sortie" cyclops-log recover "$work/unfinished" "$work/new"
expect 1 "$work/nowhere: is no flight" cyclops-log cut "$work/nowhere" "$work/new"
expect 1 "holds no published.lcm" cyclops-log export "$work/nowhere" --nav "$work/n.csv"
expect other "--record-limit" cyclops --rig "$work/good/rig.toml" --record "$work" --record-limit -3

# The service without a camera: it waits, and a signal ends it with the code for "no frame". In the foreground: else timeout
# signals twice, child and group, and the second signal ends the service at once.
timeout --foreground -s INT 4 test/in-netns.sh "$b/bin/cyclops" --rig "$work/good/rig.toml" --summary "$work/none.json" >"$work/out" 2>"$work/err"
tests=$((tests + 1))
grep -q '0 frames went through' "$work/out" "$work/err" || { bad=$((bad + 1)); echo "FAILED: stopping a service without a camera"; cat "$work/out" "$work/err"; }
grep -q '"frames_in_chain": 0' "$work/none.json" || { bad=$((bad + 1)); echo "FAILED: no summary of a service without a camera"; }

echo "$tests command lines, $bad wrong"
[ $bad = 0 ]
