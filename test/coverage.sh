#!/bin/bash
# coverage.sh: what the tests of a coverage build (make coverage runs them first) have executed of src/. One line of figures,
# and build/coverage/index.html with every line.
set -eu
cd "$(dirname "$0")/.."
command -v gcovr >/dev/null || tools/deps.sh --extra
out=build/coverage
gcovr --root . --object-directory "$out/obj" --filter 'src/' --exclude-throw-branches --exclude-unreachable-branches -j "$(nproc)" \
  --html-details "$out/index.html" --json-summary "$out/summary.json" "$out/obj" >/dev/null 2>"$out/gcovr.log" || { cat "$out/gcovr.log" >&2; exit 1; }
/usr/bin/python3 - "$out/summary.json" <<'PY'
import collections, json, sys
summary = json.load(open(sys.argv[1]))
folders = collections.defaultdict(lambda: [0, 0])
for f in summary["files"]:
    folder = folders["/".join(f["filename"].split("/")[:2])]
    folder[0] += f["line_covered"]
    folder[1] += f["line_total"]
for name, (hit, total) in sorted(folders.items()):
    print(f"  {100 * hit / max(total, 1):5.1f} %  {name}")
print(f"line coverage of src/: {summary['line_percent']:.1f} %")
PY
