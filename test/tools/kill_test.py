#!/usr/bin/python3
"""kill_test.py BUILD [KILLS] [SEED]: the service records and dies by SIGKILL at a random moment, again and again.

Every time the folder must say what it lacks, and nothing but its end: no wrong checksum, no unreadable bytes. What is
recovered from it must be readable without a problem but for the pixels of the last frames, replay bit for bit to what had
been published, and go on to within a second of what was heard on the network.
"""
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import event_log  # noqa: E402

URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
RATE_HZ = 30
END_ONLY = ("the sortie was not finished", "ends inside an event", "frames have no pixels")


def newest_seq(*logs):
    last = 0
    for log in logs:
        if not log.exists():
            continue
        for _, _, channel, payload in event_log.events(log):
            if channel == "MEASUREMENT":
                last = max(last, int.from_bytes(payload[8:16], "big"))
    return last


def run(*words):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True)


class Kill:
    def __init__(self, build, flight, work):
        self.build, self.flight, self.work = build, flight, work
        self.sortie, self.live = work / "sortie", work / "live.lcm"

    def fly(self, seconds):
        """Ends the service `seconds` after its first frame; where that never came, after 10 s."""
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir()
        env = dict(os.environ, LCM_DEFAULT_URL=URL)
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "stdin": subprocess.DEVNULL, "env": env}
        logger = subprocess.Popen(["lcm-logger", "--quiet", "--force", self.live], **quiet)
        service = subprocess.Popen([self.build / "bin/cyclops", "--rig", self.flight / "rig.toml", "--record", self.work, "--record-name", "sortie"], **quiet)
        replay = subprocess.Popen([self.build / "bin/cyclops-replay", self.flight, "--loop", "-q"], **quiet)
        frames = self.sortie / "frames.lcm"
        limit = time.monotonic() + 10
        while time.monotonic() < limit and not (frames.exists() and frames.stat().st_size > 0):
            time.sleep(0.01)
        time.sleep(seconds)
        service.send_signal(signal.SIGKILL)
        service.wait()
        replay.kill()
        replay.wait()
        time.sleep(0.1)
        logger.send_signal(signal.SIGINT)
        logger.wait()

    def problems(self, folder, allowed):
        checked = run(self.build / "bin/cyclops-log", "verify", folder)
        said = [line for line in checked.stdout.splitlines()[:-1]]
        bad = [line for line in said if not any(part in line for part in allowed)]
        if checked.returncode not in (0, 2) or bad:
            return f"verify {folder.name}: {checked.returncode} {bad or checked.stderr}"
        return ""

    def judge(self):
        """(what is wrong, or empty; frames heard and not in the record)"""
        if not (self.sortie / "sortie.toml").exists():
            return "", 0  # it died before the record began
        wrong = self.problems(self.sortie, END_ONLY)
        if wrong:
            return wrong, 0
        clean = self.work / "clean"
        recovered = run(self.build / "bin/cyclops-log", "recover", self.sortie, clean)
        if recovered.returncode != 0:
            return "recover: " + recovered.stderr, 0
        wrong = self.problems(clean, ("frames have no pixels",))
        if wrong:
            return wrong, 0
        short = newest_seq(self.live) - newest_seq(clean / "published.lcm")
        if newest_seq(clean / "published.lcm") == 0:
            return ("nothing of the record is left" if short > RATE_HZ else ""), short
        offline, summary = self.work / "offline.lcm", self.work / "offline.json"
        done = run(self.build / "bin/cyclops-offline", clean, "--out", offline, "--summary", summary, "-q")
        if done.returncode != 0:
            return "offline: " + done.stderr, short
        until = json.loads(summary.read_text())["first_frame_without_pixels"]
        if until == 1:
            return "", short
        same = run(self.build / "bin/cyclops-log", "diff", "--by-seq", "--heard", "--before", until, offline, clean)
        if same.returncode != 0:
            return "replay differs: " + same.stdout + same.stderr, short
        return (f"{short} frames heard are not in the record: more than a second" if short > RATE_HZ else ""), short


def main():
    build, kills, seed = ROOT / sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 10, int(sys.argv[3]) if len(sys.argv) > 3 else 1
    if "CYCLOPS_IN_NETNS" not in os.environ:
        os.environ["CYCLOPS_IN_NETNS"] = "1"
        os.execv(ROOT / "test/in-netns.sh", ["in-netns.sh", sys.executable, os.path.abspath(__file__), *sys.argv[1:]])
    moments, failed, most = random.Random(seed), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        subprocess.run([sys.executable, ROOT / "test/tools/make_folder.py", work / "board", "60"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([build / "bin/cyclops-import", work / "board", "--out", work / "flight"], check=True, stdout=subprocess.DEVNULL)
        kill = Kill(build, work / "flight", work / "run")
        for n in range(kills):
            moment = moments.uniform(0, 2.5)
            kill.fly(moment)
            wrong, short = kill.judge()
            most = max(most, short)
            if wrong:
                failed += 1
                print(f"kill {n + 1}, {moment:.3f} s after the first frame: {wrong}", flush=True)
    print(f"{kills} kills, {failed} failed; at most {most} frames heard and not in the record")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
