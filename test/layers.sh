#!/bin/bash
# The include direction of src/: base <- geometry <- msg <- stages <- service. A stage never includes another stage.
# wire (LCM codec) and record (flight files) are shared by service, hil and tools; stages know neither.
set -u
cd "$(dirname "$0")/.."
declare -A may
may[base]="base"
may[geometry]="base geometry"
may[msg]="base geometry msg"
for s in capture timesync nav estimate flow segment detect align edge patch associate track publish; do may[$s]="base geometry msg $s"; done
may[wire]="base geometry msg wire"
may[record]="base geometry msg wire record"
may[monitor]="base monitor"
may[service]="base geometry msg monitor capture timesync nav estimate flow segment detect align edge patch associate track publish wire record service"
bad=0
for dir in src/*/; do
  layer=$(basename "$dir")
  if [ -z "${may[$layer]+x}" ]; then echo "layers: src/$layer has no place in test/layers.sh"; bad=1; continue; fi
  while IFS=: read -r file line text; do
    target=$(sed -E 's/.*#include "([a-z]+)\/.*/\1/' <<<"$text")
    case " ${may[$layer]} " in *" $target "*) ;; *) echo "layers: $file:$line: $layer may not include $target"; bad=1 ;; esac
  done < <(grep -nH -E '^#include "[a-z_]+/' -r "$dir" || true)
  case "$layer" in timesync | nav | estimate | flow | segment | detect | align | edge | patch | associate | track)
    # Pure: no clock, socket, thread, file or log.
    if grep -nHE '#include (<(thread|mutex|chrono|fstream|sys/|unistd|lcm|spdlog|condition_variable|iostream|gpiod)|"base/clock)' -r "$dir"; then
      echo "layers: src/$layer must stay free of clocks, threads, files and sockets"; bad=1; fi ;;
  esac
done
[ $bad = 0 ] && echo "layers: include direction holds"
exit $bad
