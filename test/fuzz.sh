#!/bin/bash
# fuzz.sh SECONDS [NAME...]: builds test/fuzz/*_fuzz.cpp with clang, libFuzzer and the address and undefined-behaviour
# sanitizers, runs each for SECONDS, or with FUZZ_RUNS=n in the environment for n inputs, and prints how many it saw. The first line of a target names the sources it needs,
# files or folders. Inputs that found something new are kept in build/fuzz/corpus, a crash in build/fuzz/NAME-crash-*.
set -u
cd "$(dirname "$0")/.."
seconds=${1:-30}; [ $# -gt 0 ] && shift
command -v clang++-14 >/dev/null || { echo "fuzz: clang++-14 is missing; run: make deps-extra" >&2; exit 1; }
b=build/fuzz jobs=$(nproc)
flags="-O1 -g -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -Wno-unknown-warning-option"
mkdir -p $b/bin
targets=("$@"); [ ${#targets[@]} = 0 ] && for f in test/fuzz/*_fuzz.cpp; do f=$(basename "$f"); targets+=("${f%_fuzz.cpp}"); done

objects() {  # objects NAME: of the target and of what its first line names
  local what
  echo "$b/obj/test/fuzz/$1_fuzz.o"
  for what in $(sed -n '1s|^// sources: ||p' "test/fuzz/$1_fuzz.cpp"); do
    find "$what" -name '*.cpp' ! -name '*_main.cpp' | sed "s|\(.*\)\.cpp|$b/obj/\1.o|"
  done
}
all=$(for t in "${targets[@]}"; do objects "$t"; done | sort -u)
make --no-print-directory -j"$jobs" VARIANT=fuzz CXX=clang++-14 OPT_fuzz="$flags" $all || exit 1
libs=$(sed -n 's/^DEPS_LIBS := //p' build/deps.mk)
for t in "${targets[@]}"; do
  clang++-14 -fsanitize=fuzzer,address,undefined -pthread $(objects "$t") $libs -o "$b/bin/fuzz-$t" || exit 1
done

seeds() {  # seeds NAME FOLDER: what the target begins with
  case $1 in
    config) # the first character says what the rest is
            for f in config/*.toml; do { if [ "$(basename "$f")" = alarms.toml ]; then printf 2; else printf 3; fi; cat "$f"; } >"$2/$(basename "$f")"; done
            { printf 4; awk '/^### rig.toml/ {here = 1} here && /^```toml/ {on = 1; next} on && /^```/ {exit} on' docs/architecture.md |
              sed "/^windscreen/d; s|^model = .*|model = \"$PWD/config/c12/tanker.csv\"|"; } >"$2/rig.toml"
            printf '5id,x,y,z,name,normals,sigma,enabled\n1,1,2,3,"a, b",0 0 1; 1 0 0,0.07,1\n' >"$2/tanker.csv"
            { printf '6CYCWIND1\2\0\0\0\2\0\0\0\0\0\0\0\0\0\360\77'; head -c 64 /dev/zero; } >"$2/windscreen.bin" ;;
    csv) printf 'frame,x_m,a\n# words\n0,1.5e3, 7 \n1,-2,0\n' >"$2/table.csv" ;;
    log) printf '\xED\xA1\xDA\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x07\0\0\0\x01\0\0\0\x02Sab' >"$2/event.lcm"
         printf 'format = "cyclops-flight-1"\nframes = 1\n[files]\n"messages.lcm" = 9\n"frames.lcm" = 9\n"rig.toml" = 0\n' >"$2/manifest.toml" ;;
  esac
}
most="-max_total_time=$seconds"; [ -n "${FUZZ_RUNS:-}" ] && most="-runs=$FUZZ_RUNS"
failed=0
for t in "${targets[@]}"; do
  corpus=$b/corpus/$t; mkdir -p "$corpus" "$b/seeds/$t"; seeds "$t" "$b/seeds/$t"
  longest=4096; [ "$t" = csv ] && longest=512  # a few lines of a table have all that a long one has
  # -entropic=0: the bookkeeping of that schedule takes 30 to 40 % of the time with corpora of this size.
  if UBSAN_OPTIONS=print_stacktrace=1 "$b/bin/fuzz-$t" "$most" -entropic=0 -max_len=$longest -timeout=60 -rss_limit_mb=2048 -malloc_limit_mb=512 -print_final_stats=1 \
      -artifact_prefix="$b/$t-" "$corpus" "$b/seeds/$t" >"$b/$t.log" 2>&1; then
    stat() { sed -n "s/^stat::$1: *//p" "$b/$t.log"; }
    printf '%-8s %10d runs, %7d a second, %5d inputs kept\n' "$t" "$(stat number_of_executed_units)" "$(stat average_exec_per_sec)" "$(ls "$corpus" | wc -l)"
  else
    failed=1; echo "$t: FAILED, whole report in $b/$t.log"; grep -m 12 -A 12 -E 'ERROR|runtime error|broken contract' "$b/$t.log"
  fi
done
exit $failed
