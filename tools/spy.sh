#!/bin/bash
# spy.sh TYPES.jar: lcm-spy with the Cyclops types. Debian's own launcher asks Java 17 for an option it no longer has.
set -eu
types=${1:-$(dirname "$0")/cyclops-types.jar}
stop() { echo "spy: $*" >&2; exit 1; }
for jar in /usr/share/java/lcm.jar /usr/share/java/jchart2d.jar "$types"; do
  [ -e "$jar" ] || stop "$jar is missing; run make deps types"
done
java=$(command -v java) || stop "no java; run make deps"
[ -e "$(dirname "$(dirname "$(readlink -f "$java")")")/lib/libawt_xawt.so" ] || stop "this Java has no windows; run make deps-extra, or apt-get install default-jre"
[ -n "${DISPLAY:-}" ] || stop "no screen: DISPLAY is not set; with ssh use ssh -X"
export LCM_DEFAULT_URL=${LCM_DEFAULT_URL:-udpm://239.255.76.67:7667?ttl=0}
exec java -Djava.net.preferIPv4Stack=true -Xmx256m \
  -cp "/usr/share/java/lcm.jar:/usr/share/java/jchart2d.jar:$types" lcm.spy.Spy
