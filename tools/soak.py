#!/usr/bin/python3
"""soak.py BUILD [--minutes N] [--fps N] [--seed N] [--flight DIR] [--out DIR]

Flies a flight round and round through the whole rig while faults drawn from a seed strike every few seconds, and then asks: is the
memory of the service flat, are no descriptors left open, does every counter balance (docs/faults.md)? Prints what was found, writes
OUT/soak.json and ends with 1 when something is wrong.
"""
import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "tools"))
import fault_judge
import soak_balance
from faults import types_of

# kind: (weight, longest in s, {parameter: (low, high) or [choices]})
KINDS = {
    "packet_loss": (3, 3, {"share": (0.001, 0.05), "resend": ["answered", "never"]}),
    "packet_delay": (1, 2, {"delay_ms": (1, 40), "share": (0.1, 1)}),
    "packet_reorder": (1, 2, {}),
    "packet_duplicate": (1, 2, {}),
    "frame_truncated": (1, 2, {"keep": (0.1, 0.95), "share": (0.1, 1)}),
    "frame_lost": (2, 2, {"share": (0.05, 0.7)}),
    "frame_frozen": (1, 1.5, {}),
    "frame_rate": (0.5, 2, {"every": (2, 3)}),
    "exposure": (0.5, 2, {"factor": (0.4, 2)}),
    "camera_vanish": (1, 3, {"outage": ["power", "cable"]}),
    "strobe_lost": (2, 3, {"share": (0.05, 0.9), "where": ["wire", "buffer"]}),
    "strobe_doubled": (1, 2, {"after_us": (50, 1500), "share": (0.1, 1)}),
    "strobe_late": (1, 2, {"late_us": (100, 6000), "share": (0.05, 0.5)}),
    "strobe_held": (1, 2, {"delay_ms": (5, 150), "share": (0.1, 1)}),
    "strobe_stuck": (1, 3, {}),
    "strobe_spurious": (1, 2, {"rate_hz": (1, 60)}),
    "camera_clock_step": (0.5, 2, {"step_ms": (-50, 50)}),
    "camera_clock_drift": (1, 4, {"ppm": (-80, 80)}),
    "pps_loss": (1, 4, {}),
    "tspi_loss": (2, 2, {"share": (0.1, 1), "aircraft": ["receiver", "tanker", "both"]}),
    "tspi_delay": (1, 2, {"delay_ms": (10, 400), "aircraft": ["receiver", "tanker", "both"]}),
    "tspi_disorder": (1, 2, {"most_ms": (20, 200), "aircraft": ["receiver", "tanker", "both"]}),
    "tspi_duplicate": (1, 2, {"share": (0.1, 1), "aircraft": ["receiver", "tanker", "both"]}),
    "tspi_bias": (1, 2, {"east_m": (-4, 4), "aircraft": ["receiver", "tanker"]}),
    "tspi_freeze": (1, 2, {"aircraft": ["receiver", "tanker"]}),
    "tspi_nan": (1, 2, {"share": (0.1, 1), "aircraft": ["receiver", "tanker", "both"]}),
    "tspi_wrong_aircraft": (1, 2, {"share": (0.1, 1), "aircraft": ["receiver", "tanker"]}),
    "cpu_load": (0.5, 1, {"threads": (1, 2), "share": (0.3, 0.8), "priority": ["normal", "high"]}),
    "flood": (1, 1.5, {"rate_hz": (100, 3000), "content": ["noise", "repeat"], "channel": ["TSPI_TANKER", "TSPI_RECEIVER", "OTHER"]}),
}
CALM_S = 8.0           # at the beginning and at the end nothing strikes


def draw_script(seconds, seed):
    """Faults from CALM_S to seconds - CALM_S, one every 1 to 5 s, so that some overlap."""
    chance = random.Random(seed)
    names, weights = list(KINDS), [k[0] for k in KINDS.values()]
    lines, t = [f"seed = {seed}"], CALM_S
    while t < seconds - 2 * CALM_S:
        name = chance.choices(names, weights)[0]
        _, longest, parameters = KINDS[name]
        lines += ["[[fault]]", f'kind = "{name}"', f"onset_s = {t:.2f}", f"duration_s = {chance.uniform(0.2, longest):.2f}"]
        for key, span in parameters.items():
            value = f'"{chance.choice(span)}"' if isinstance(span, list) else f"{chance.uniform(*span):.4f}"
            lines.append(f"{key} = {value}")
        t += chance.uniform(1, 5)
    return "\n".join(lines) + "\n"


class Sampler(threading.Thread):
    """Memory, descriptors and threads of the service, once a second."""

    def __init__(self, pid_file):
        super().__init__(daemon=True)
        self.pid_file, self.rows, self.over = pid_file, [], False
        self.begin = time.monotonic()

    def run(self):
        while not self.over:
            try:
                with open(self.pid_file) as file:
                    pid = int(file.read())
                with open(f"/proc/{pid}/status") as file:
                    status = dict(line.split(":", 1) for line in file)
                kb = {k: int(status[k].split()[0]) for k in ("VmRSS", "RssAnon", "Threads")}
                self.rows.append({"t": time.monotonic() - self.begin, "rss_kb": kb["VmRSS"], "anon_kb": kb["RssAnon"], "threads": kb["Threads"],
                                  "descriptors": len(os.listdir(f"/proc/{pid}/fd"))})
            except (OSError, ValueError, KeyError):
                pass  # not there yet, or no longer
            time.sleep(1)


def fly(build, flight, out, seconds, speed):
    options = ["--faults", os.path.join(out, "faults.toml"), "--sent", os.path.join(out, "sent.csv"), "--seconds", str(seconds), "--loop", "--quiet"]
    env = os.environ | {"CYCLOPS_IDLE_S": "20", "CYCLOPS_CHANNELS": "FRAME|MEASUREMENT|HEALTH|EVENT"}
    sampler = Sampler(os.path.join(out, "service.pid"))
    sampler.start()
    with open(os.path.join(out, "rig.log"), "w") as log:
        done = subprocess.run(["hil/rig.sh", build, flight, out, "-", str(speed)] + options, cwd=ROOT, env=env, stdout=log, stderr=subprocess.STDOUT)
    sampler.over = True
    sampler.join()
    return done.returncode, sampler.rows


def flight_rate(flight):
    with open(os.path.join(flight, "rig.toml")) as file:
        return next(float(line.split("=")[1]) for line in file if line.startswith("frame_rate_hz"))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build")
    p.add_argument("--minutes", type=float, default=3)
    p.add_argument("--fps", type=float, default=60)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--flight", default="build/flights/soak")
    p.add_argument("--out", default="build/soak")
    a = p.parse_args()
    os.chdir(ROOT)
    types = types_of(a.build)
    speed = a.fps / flight_rate(a.flight)
    shutil.rmtree(a.out, ignore_errors=True)
    os.makedirs(a.out)
    seconds = 60 * a.minutes * speed  # of the flight
    with open(os.path.join(a.out, "faults.toml"), "w") as file:
        file.write(draw_script(seconds, a.seed))
    begin = time.monotonic()
    code, samples = fly(a.build, a.flight, a.out, seconds, speed)
    run = fault_judge.load(a.out, fault_judge.truth_of(a.flight, types), types)
    report = soak_balance.report(run, samples)
    report["asked"] = {"minutes": a.minutes, "fps": a.fps, "seed": a.seed, "flight": a.flight, "took_s": round(time.monotonic() - begin, 1), "rig_exit_code": code}
    report["wrong"] += [f"the rig ended with {code}, see {a.out}/rig.log"] if code else []
    with open(os.path.join(a.out, "soak.json"), "w") as file:
        json.dump(report | {"samples": samples}, file, indent=1)
    print(soak_balance.text(report))
    return 1 if report["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
