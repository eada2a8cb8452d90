#!/bin/bash
# deps.sh OUT.mk    install the missing packages of tools/packages.txt, then write the libraries' flags to OUT.mk
# deps.sh --extra [WORD]   install the extra packages too; only those whose remark has the word
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

wanted() { awk -v extra="$1" -v word="${2:-}" '!/^#/ && NF { if ($1 == "extra") { if (extra && (word == "" || index($0, word))) print $2 } else print $1 }' "$here/packages.txt"; }
extra=0; [ "${1:-}" = --extra ] && extra=1
missing=()
if command -v dpkg-query >/dev/null; then
  for p in $(wanted "$([ $extra = 1 ] && echo 1 || true)" "${2:-}"); do
    dpkg-query -W -f '${Status}' "$p" 2>/dev/null | grep -q 'ok installed' || missing+=("$p")
  done
else
  echo "deps: this is not a Debian system; packages cannot be checked, going on" >&2
fi
if [ ${#missing[@]} -gt 0 ]; then
  run=()
  if [ "$(id -u)" != 0 ]; then
    if sudo -n true 2>/dev/null; then run=(sudo -n); else
      echo "deps: missing packages, and this user cannot install them without a password. As root:" >&2
      echo "  apt-get install --no-install-recommends ${missing[*]}" >&2
      exit 1
    fi
  fi
  echo "deps: installing ${missing[*]}"
  log=$(mktemp)
  if ! { "${run[@]}" apt-get update -qq && DEBIAN_FRONTEND=noninteractive "${run[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
    tail -n 20 "$log" >&2; echo "deps: apt-get failed, whole log in $log" >&2; exit 1
  fi
  rm -f "$log"
fi
[ $extra = 1 ] && exit 0

out=$1
mkdir -p "$(dirname "$out")"
pc="aravis-0.8 lcm libgpiod assimp eigen3 geographiclib glib-2.0 gobject-2.0 gio-2.0 spdlog"
cflags=$(pkg-config --cflags $pc | sed 's/-I/-isystem /g')
# Of these only the libraries: their headers need no flags of their own, but for httplib.h, which tools/http.hpp includes.
libs="$(pkg-config --libs $pc) $(pkg-config --libs libsodium ncursesw cpp-httplib)"
gpiod=$(pkg-config --modversion libgpiod | cut -d. -f1)
# -isystem keeps other people's warnings out of ours; opencv4.pc is only in the large package.
cat >"$out.tmp" <<MK
# made by tools/deps.sh
DEPS_CFLAGS := $cflags -isystem /usr/include/opencv4 -DCYCLOPS_GPIOD=$gpiod -DSPDLOG_FMT_EXTERNAL
DEPS_LIBS := $libs -lopencv_imgcodecs -lopencv_imgproc -lopencv_core -lembree3 -lxxhash
LCM_JAR := /usr/share/java/lcm.jar
MK
mv "$out.tmp" "$out"
