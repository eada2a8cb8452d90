"""Makes the runs of an evaluation: a flight with the navigation errors of a seed, through the chain, to figures; each kept under a hash
of all that it depends on. Nothing is drawn: seeds share the pictures of build/flights/cache.
"""
import concurrent.futures
import fcntl
import hashlib
import json
import os
import shutil
import subprocess
import time

import evaluate_metrics
import flights
import profile_text

CONDITIONS = {  # navigation of the flight, seconds between its updates (None: every frame)
    "12px-1hz": ("measured", 1.0), "12px": ("measured", None), "true-1hz": ("true", 1.0), "true": ("true", None)}
THESIS_GATE_PX = {"s2": 9, "s3": 16, "s4": 6}  # spec 4.2; the others 13, and 6 with true navigation
PEERS = ("cyclops-peer-opencv", "cyclops-peer-visp")
PEER_FRAMES = 300  # of a flight are enough beside the peers: ViSP takes 25 to 80 ms a frame
BESIDE = f"12px-1hz, first {PEER_FRAMES}"
METRICS = ("evaluate_metrics.py", "evaluate_pose.py")


def sha(*parts):
    h = hashlib.sha256()
    for p in parts:
        h.update(p.encode() if isinstance(p, str) else p)
        h.update(b"\0")
    return h.hexdigest()


def content(path):
    with open(path, "rb") as file:
        return file.read()


def option_content(options):
    """What the options of a run say: of a file, what is in it."""
    return [content(o) if os.path.isfile(o) else o for o in options]


class Setting:
    """Programs and folders of one evaluation, and the hashes that a result depends on."""

    def __init__(self, build, out, cache):
        self.build, self.out, self.cache = build, out, cache
        self.runs, self.work, self.models = (os.path.join(out, f) for f in ("runs", "work", "models"))
        for folder in (self.runs, self.work, self.models):
            os.makedirs(folder, exist_ok=True)
        here = os.path.dirname(os.path.abspath(__file__))
        self.metrics = sha(*(content(os.path.join(here, f)) for f in METRICS))
        self.programs = {p: sha(content(os.path.join(build, "bin", p))) for p in ("cyclops-flight", "cyclops-evaluate", "cyclops-disturb", "cyclops-learn", *PEERS) if os.path.exists(os.path.join(build, "bin", p))}

    def program(self, name):
        return os.path.join(self.build, "bin", name)

    def flight_key(self, flight, navigation, seed):
        return sha(self.programs["cyclops-flight"], navigation, str(seed), *(content(p) for p in flights.inputs(flight + ".toml")))

    def run_key(self, flight, navigation, seed, text, program="cyclops-evaluate", options=()):
        return sha(self.flight_key(flight, navigation, seed), self.programs[program], self.metrics, text, *option_content(options))[:32]


def profile_for(profile, flight, condition, rate_hz):
    """Text of the profile under a condition of navigation; the thesis' gates go with its flights."""
    path = f"config/{profile}.toml"
    with open(path) as file:
        text = file.read()
    navigation, interval_s = CONDITIONS[condition]
    values = {"update_every_n_frames": str(1 if interval_s is None else max(1, round(interval_s * rate_hz)))}
    if profile == "thesis-2007":
        values["gate_px"] = f"{6.0 if navigation == 'true' and flight not in THESIS_GATE_PX else THESIS_GATE_PX.get(flight, 13):.1f}"
    return profile_text.changed(text, values, path)


def frame_rate(flight):
    """From the scenario or its base."""
    for path in flights.inputs(flight + ".toml"):
        for line in content(path).decode().splitlines():
            if line.startswith("frame_rate_hz"):
                return float(line.split("=")[1].split("#")[0])
    raise SystemExit(f"config/scenarios/{flight}.toml has no frame_rate_hz")


def call(command):
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()[-500:]}")


def fly(setting, flight, navigation, seed, folder, frames=None):
    """The pictures of one scenario are made by one process at a time; with pictures there it takes a quarter of a second."""
    with open(os.path.join(setting.work, flight + ".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        call([setting.program("cyclops-flight"), "--scenario", f"config/scenarios/{flight}.toml", "--out", folder, "--replace", "--quiet", "--cache", setting.cache,
              "--seed", str(seed), "--navigation", navigation] + (["--frames", str(frames)] if frames else []))


def measure(setting, program, folder, text, tables, options=()):
    """Runs a program over a flight, or the first frames of it, and works out the figures."""
    os.makedirs(tables, exist_ok=True)
    profile = os.path.join(tables, "profile.toml")
    with open(profile, "w") as file:
        file.write(text)
    start = time.monotonic()
    call([setting.program(program), folder, "--config", profile, "--out", tables, *options])
    spent = time.monotonic() - start
    ranges = None
    if os.path.exists(os.path.join(folder, "figures.json")):
        with open(os.path.join(folder, "figures.json")) as file:
            ranges = json.load(file)["by_frame"]["range_ft"]
    found = evaluate_metrics.figures(*evaluate_metrics.load(tables), ranges)
    found["scalars"]["run_s"] = spent
    return found


def save(setting, key, result):
    path = os.path.join(setting.runs, key + ".json")
    with open(path + ".part", "w") as file:
        json.dump(result, file)
    os.replace(path + ".part", path)


def job(setting, flight, navigation, seed, wanted):
    """One flight and all runs over it that are missing. wanted: [(key, program, profile text, names, options)]"""
    folder = os.path.join(setting.work, f"{flight}-{navigation}-{seed}-{wanted[0][0]}")
    try:
        fly(setting, flight, navigation, seed, folder)
        for key, program, text, names, options in wanted:
            save(setting, key, {**names, **measure(setting, program, folder, text, os.path.join(folder, "tables"), options)})
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return len(wanted)


def recorded_content(folder):
    return [content(os.path.join(folder, f)) for f in ("manifest.toml", "rig.toml", "messages.lcm")]


def recorded_key(setting, folder, text, program, options=()):
    return sha(setting.programs[program], setting.metrics, text, *recorded_content(folder), *option_content(options))[:32]


def recorded_job(setting, folder, key, program, text, names, options):
    """A flight that is there, as it is."""
    tables = os.path.join(setting.work, key)
    try:
        save(setting, key, {**names, **measure(setting, program, folder, text, tables, options)})
    finally:
        shutil.rmtree(tables, ignore_errors=True)


def in_parallel(tasks, jobs, show=print):
    """tasks: [(weight, label, function, arguments)]. Says what is done and what is left; a failed one is named and the others go on."""
    total, done, begin, failed = sum(t[0] for t in tasks), 0, time.monotonic(), []
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        waiting = {pool.submit(function, *arguments): (weight, label) for weight, label, function, arguments in tasks}
        for future in concurrent.futures.as_completed(waiting):
            weight, label = waiting[future]
            done += weight
            spent = time.monotonic() - begin
            try:
                future.result()
                state = "done"
            except Exception as error:  # noqa: BLE001: any failure of one run must not end the others
                failed.append(f"{label}: {error}")
                state = f"FAILED: {error}"
            show(f"[{done}/{total}] {label} {state}; {spent:.0f} s, {spent / done * (total - done):.0f} s to go", flush=True)
    return failed
