#!/usr/bin/python3
"""replay_check.py BUILD [FLIGHT]: does a recorded sortie, replayed in any way, measure what was published?

Flies FLIGHT (a small one made for it when left out or "-") through the whole rig at real speed and records it. That sortie is then replayed
offline, with one and with several threads of OpenCV, and as a camera over GVSP: at real speed, at up to 20 times, stepped, as fast as the
service answers. Each is compared with what was published, every stage of every frame, bit for bit. A replay that lost frames on this machine
is compared up to the first of them and flown again, three times at most. The same with GPS time from a PPS line, over a flight of its own.
Exit code: 0 everything compared is the same and every replay was whole; 1 something differs, or cannot be done; 3 frames were lost three times.
"""
import json
import os
import re
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SAME, WRONG, LOST = 0, 1, 3
TRIES = 3
STEP = 7  # frames at a step
LIVE = [("real speed", "1", []), ("20 x, paced by answers", "20", ["--answered"]), ("stepped, then on", "1", ["--answered"]), ("as fast as answered", "0", [])]
OFFLINE = [("offline, 1 thread", "1"), ("offline, 4 threads", "4")]


def fail(why):
    sys.exit(f"replay_check: {why}")


def run(command, **more):
    done = subprocess.run(command, capture_output=True, text=True, **more)
    if done.returncode != 0:
        fail(f"{' '.join(command)} ended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class Sortie:
    """One recorded flight and the rows of the table that are about it."""

    def __init__(self, build, flight, work, name):
        self.build, self.work, self.name = build, os.path.join(work, name), name
        self.rows, self.worst = [], 0
        self.path = self.fly(flight, "flown", "1", ["--answered"])

    def fly(self, flight, out, speed, options, steps=None):
        out = os.path.join(self.work, out)
        shutil.rmtree(out, ignore_errors=True)
        env = dict(os.environ, RECORD="yes")
        if steps:
            env["STEPS"] = str(steps)
        run(["hil/rig.sh", self.build, flight, out, "-", speed, *options], env=env)
        return os.path.join(out, "sortie")

    def diff(self, other, *options):
        """(equal, different, missing in the other, only in the other, words about the first)"""
        done = subprocess.run([f"{self.build}/bin/cyclops-log", "diff", *options, self.path, other], capture_output=True, text=True)
        m = re.search(r"(\d+) equal bit for bit, (\d+) different, (\d+) only in the first, (\d+) only in the second", done.stdout)
        if m is None:
            fail(f"cyclops-log diff {self.path} {other}: {done.stdout}{done.stderr}")
        first = re.search(r"first difference: frame (\d+), (.*)", done.stdout)
        return *(int(x) for x in m.groups()), first

    def offline(self, words, threads):
        log = os.path.join(self.work, f"offline-{threads}.lcm")
        run([f"{self.build}/bin/cyclops-offline", self.path, "--out", log, "-q"], env=dict(os.environ, OPENCV_FOR_THREADS_NUM=threads))
        self.add(*self.judge(words, log, "--by-seq"))

    def live(self, number, words, speed, options):
        for _ in range(TRIES):
            other = self.fly(self.path, f"again-{number}", speed, options, STEP if words.startswith("stepped") else None)
            row, code = self.judge(words, other)
            if code != LOST:
                break
        self.add(row, code)
        if code == SAME:
            shutil.rmtree(os.path.dirname(other))

    def add(self, row, code):
        self.rows.append(row)
        self.worst = WRONG if WRONG in (code, self.worst) else max(code, self.worst)

    def judge(self, words, other, *options):
        """(row of the table, code). What comes after a lost frame may differ with reason: only what was before it is compared."""
        *counts, first = self.diff(other, *options)
        equal, different, missing, more = counts
        if equal + different + missing + more == 0:
            fail(f"{self.path} and {other} hold no measurements")
        if not (different or missing or more):
            return (words, *counts, "the same"), SAME
        lost = missing > 0 and "timesync" in first[2]
        part = self.diff(other, "--by-seq", "--before", first[1]) if lost and int(first[1]) > 1 else None
        if lost and not (part and any(part[1:4])):
            return (words, *counts, f"{missing} lost on this machine; the same before frame {first[1]}"), LOST
        return (words, *counts, f"DIFFERS from frame {first[1]} on, {first[2]}"), WRONG


def check(build, flight, work, name):
    sortie = Sortie(build, flight, work, name)
    with open(os.path.join(sortie.work, "flown/service.json")) as file:
        marks = json.load(file)["time"]["pps_marks"]
    if name.endswith("pps") != (marks > 0):
        fail(f"{name}: GPS time came from {marks} edges of PPS")
    for words, threads in OFFLINE:
        sortie.offline(words, threads)
    for number, (words, speed, options) in enumerate(LIVE):
        sortie.live(number, words, speed, options)
    print(f"\n{name}: {run([f'{build}/bin/cyclops-log', 'verify', sortie.path]).strip()}")
    print(f"{'replay':<24}{'equal':>7}{'different':>11}{'missing':>9}{'more':>6}  verdict")
    for words, *numbers, verdict in sortie.rows:
        print(f"{words:<24}{numbers[0]:>7}{numbers[1]:>11}{numbers[2]:>9}{numbers[3]:>6}  {verdict}", flush=True)
    return sortie.worst


def main():
    os.chdir(ROOT)
    build, flight = sys.argv[1], (sys.argv[2:3] or ["-"])[0]
    work = os.path.join(build, "replay-check")
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    small = os.path.join(work, "flight")
    run(["/usr/bin/python3", "test/tools/make_folder.py", os.path.join(work, "board"), "120"])
    run([f"{build}/bin/cyclops-import", os.path.join(work, "board"), "--out", small])
    run(["/usr/bin/python3", "test/tools/add_pps.py", small, os.path.join(work, "flight-pps")])
    worst = [check(build, small if flight == "-" else flight, work, "sortie"), check(build, os.path.join(work, "flight-pps"), work, "sortie-pps")]
    sys.exit(WRONG if WRONG in worst else max(worst))


if __name__ == "__main__":
    main()
