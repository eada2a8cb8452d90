#!/usr/bin/python3
"""flights.py make|verify|compare: the standard set of generated flights (docs/flights.md).

make BUILD [NAME ...]    flies every scenario of config/scenarios (or those named) into build/flights; S1 to S4 also with true
                         navigation (NAME-true). What is there already is kept. Writes build/flights/flights.json with hashes.
                         embedded, faults, heavy, heavy-tour, s1-50, soak and windscreen are made only when they are named.
verify                   are the files of build/flights what flights.json says?
compare A.json B.json    did two runs make the same flights?
"""
import hashlib
import json
import os
import re
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
FLIGHTS = "build/flights"
SCENARIOS = "config/scenarios"
MANIFEST = os.path.join(FLIGHTS, "flights.json")
BOTH = ("s1", "s1-50", "s2", "s3", "s4")  # with and without projection error, as the thesis compares them
ON_DEMAND = ("embedded", "faults", "heavy", "heavy-tour", "s1-50", "soak", "windscreen")  # made when they are named: the standard set stays below 15 GB
HASHED = ("frames.lcm", "messages.lcm", "rig.toml", "tanker.csv")


def standard_set():
    """(flight, scenario, options)"""
    names = sorted(f[:-5] for f in os.listdir(SCENARIOS) if f.endswith(".toml") and f != "base.toml")
    names.sort(key=lambda n: (n not in BOTH, n))
    for name in names:
        yield name, name, []
        if name in BOTH:
            yield name + "-true", name, ["--navigation", "true"]


def digest(path, known={}):
    """SHA-256 of a file; hard links are read once."""
    stat = os.stat(path)
    key = (stat.st_dev, stat.st_ino, stat.st_mtime_ns)
    if key not in known:
        with open(path, "rb") as file:
            known[key] = hashlib.file_digest(file, "sha256").hexdigest()
    return known[key]


def inputs(scenario):
    """The scenario's file and its bases."""
    path = os.path.join(SCENARIOS, scenario)
    yield path
    with open(path) as file:
        base = re.search(r'^base = "([^"]+)"', file.read(), re.M)
    if base:
        yield from inputs(base.group(1))


def newest_input(scenario, program):
    """A flight older than its scenario, any base of it or the program is made again; unchanged pictures come from the cache."""
    return max(os.path.getmtime(p) for p in (program, *inputs(scenario + ".toml")))


def load_manifest(path=MANIFEST):
    try:
        with open(path) as file:
            return json.load(file)
    except FileNotFoundError:
        return {}


def save_manifest(flights):
    with open(MANIFEST + ".part", "w") as file:
        json.dump(flights, file, indent=1, sort_keys=True)
        file.flush()
        os.fsync(file.fileno())
    os.replace(MANIFEST + ".part", MANIFEST)


def make(build, wanted):
    program = os.path.join(build, "bin/cyclops-flight")
    os.makedirs(FLIGHTS, exist_ok=True)
    flights, seen, begin = load_manifest(), set(), time.monotonic()
    flights = {n: f for n, f in flights.items() if os.path.isdir(os.path.join(FLIGHTS, n))}
    todo = [f for f in standard_set() if (f[0] in wanted or f[1] in wanted if wanted else f[1] not in ON_DEMAND)]
    if wanted and not todo:
        sys.exit(f"flights.py: no scenario of that name; there are: {' '.join(n for n, _, _ in standard_set())}")
    for name, scenario, options in todo:
        folder = os.path.join(FLIGHTS, name)
        manifest = os.path.join(folder, "manifest.toml")
        start = time.monotonic()
        fresh = name in flights and os.path.exists(manifest) and os.path.getmtime(manifest) > newest_input(scenario, program)
        if not fresh:
            done = subprocess.run([program, "--scenario", os.path.join(SCENARIOS, scenario + ".toml"), "--out", folder, "--replace", *options], stdout=subprocess.DEVNULL)
            if done.returncode:
                sys.exit(f"flights.py: {name} failed; what was finished is kept, the next call goes on here")
        files = {f: digest(os.path.join(folder, f)) for f in HASHED}
        with open(os.path.join(folder, "figures.json")) as file:
            figures = json.load(file)
        size = sum(os.path.getsize(os.path.join(folder, f)) for f in os.listdir(folder))
        flights[name] = {"scenario": scenario, "frames": figures["frames"], "bytes": size, "sha256": files}
        save_manifest(flights)
        inode = os.stat(os.path.join(folder, "frames.lcm")).st_ino
        shared = "shared" if inode in seen else f"{size / 1e6:.0f} MB"
        seen.add(inode)
        print(f"{name:14} {figures['frames']:5} frames {time.monotonic() - start:7.1f} s {shared:>9}  {files['frames.lcm'][:12]} {files['messages.lcm'][:12]}{'  (was there)' if fresh else ''}", flush=True)
    total = sum({os.stat(os.path.join(FLIGHTS, n, f)).st_ino: os.path.getsize(os.path.join(FLIGHTS, n, f)) for n, _, _ in todo for f in os.listdir(os.path.join(FLIGHTS, n))}.values())
    print(f"{len(todo)} flights, {time.monotonic() - begin:.0f} s, {total / 1e9:.2f} GB on disk; hashes: {MANIFEST}")


def verify():
    flights, bad = load_manifest(), 0
    for name, flight in sorted(flights.items()):
        for file, wanted in flight["sha256"].items():
            path = os.path.join(FLIGHTS, name, file)
            if not os.path.exists(path) or digest(path) != wanted:
                bad += 1
                print(f"{path}: {'is not what was made' if os.path.exists(path) else 'is missing'}")
    print(f"{len(flights)} flights verified, {bad} files differ")
    return bad == 0 and bool(flights)


def compare(a, b):
    first, second, bad = load_manifest(a), load_manifest(b), 0
    for name in sorted(set(first) | set(second)):
        if first.get(name) != second.get(name):
            bad += 1
            print(f"{name}: {'differs' if name in first and name in second else 'is in one only'}")
    print(f"{len(set(first) & set(second)) - bad if bad < len(first) else 0} flights the same, {bad} not")
    return bad == 0 and bool(first)


def main():
    if len(sys.argv) < 2 or sys.argv[1] not in ("make", "verify", "compare"):
        sys.exit(__doc__)
    if sys.argv[1] == "compare":
        sys.exit(0 if compare(sys.argv[2], sys.argv[3]) else 1)
    os.chdir(ROOT)
    if sys.argv[1] == "make":
        make(sys.argv[2], set(sys.argv[3:]))
    else:
        sys.exit(0 if verify() else 1)


if __name__ == "__main__":
    main()
