#!/usr/bin/python3
"""add_pps.py FLIGHT NEW: the same flight with a PPS line: an edge at each whole second of GPS time, and a rig whose GPS time comes from it.

The edges come 8 us late, as an interrupt does. Time marks stay as they are: they only number the edges. Needs build/gen/python."""
import os
import re
import shutil
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "tools"), os.path.join(ROOT, "build/gen/python")]
import cyclops  # noqa: E402
import event_log  # noqa: E402

SECOND_NS, LATE_NS = 10**9, 8_000
PPS = '\n[pps]\nsource = "socket"\nsocket = "@cyclops-strobe"\nline = 18\n'


def edges(events):
    """Events of PPS over the whole flight, by its first time mark."""
    mark = next(cyclops.time_mark_t.decode(p) for _, _, c, p in events if c == "TIME_MARK")
    first, last = (1000 * events[i][1] for i in (0, -1))
    at = mark.service_time_ns - mark.gps_time_ns % SECOND_NS
    at += -((at - first) // SECOND_NS) * SECOND_NS
    while at < last:
        e = cyclops.strobe_edge_t()
        e.service_time_ns, e.line_seq, e.edge, e.line = at + LATE_NS, -1, cyclops.strobe_edge_t.RISING, 1
        yield (at + LATE_NS) // 1000 + 1, "STROBE", e.encode()
        at += SECOND_NS


def main():
    flight, new = sys.argv[1:3]
    shutil.copytree(flight, new)
    messages, rig, manifest = (os.path.join(new, name) for name in ("messages.lcm", "rig.toml", "manifest.toml"))
    events = list(event_log.events(messages))
    event_log.write(messages, sorted([e[1:] for e in events] + list(edges(events)), key=lambda e: e[0]))
    with open(rig) as file:
        text = file.read()
    socket = re.search(r'(?m)^socket = "(.*)"', text)
    text = re.sub(r"(?m)^gps_from = .*\n", "", text)
    text = re.sub(r"(?m)^\[time\]\n", '[time]\ngps_from = "pps"\n', text) if "\n[time]" in text else text + '\n[time]\ngps_from = "pps"\n'
    with open(rig, "w") as file:
        file.write(text + (PPS.replace("@cyclops-strobe", socket[1]) if socket else PPS))
    with open(manifest) as file:
        text = file.read()
    for name in ("messages.lcm", "rig.toml"):
        text = re.sub(rf'(?m)^"{re.escape(name)}" = \d+', f'"{name}" = {os.path.getsize(os.path.join(new, name))}', text)
    with open(manifest, "w") as file:
        file.write(text)


if __name__ == "__main__":
    main()
