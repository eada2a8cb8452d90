#!/usr/bin/python3
"""thesis_table.py BUILD [--flights DIR] [--out DIR]

The results of the thesis (spec 4.2, 4.4) beside those of its method, as Cyclops has it (config/thesis-2007.toml), over the generated
flights S1 to S4 with measured and with true navigation. Writes OUT/thesis-table.md and .json (default build/thesis).
Truth here is exact and the tanker a reconstruction: the thesis' values are orders of magnitude to compare with (spec 4.7).
"""
import argparse
import csv
import json
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import profile_text

PROFILE = "config/thesis-2007.toml"
RUNS = {  # name: flight, filter, (alpha, beta), gate px
    "s1 zoh 13": ("s1", "zoh", None, 13), "s1 ab 13": ("s1", "alpha-beta", (.7, .075), 13), "s1 zoh 6 true": ("s1-true", "zoh", None, 6),
    "s2 zoh 9 true": ("s2-true", "zoh", None, 9), "s2 ab 9 true": ("s2-true", "alpha-beta", (.9, .25), 9), "s2 ab slow 9 true": ("s2-true", "alpha-beta", (.7, .075), 9),
    "s3 zoh 16 true": ("s3-true", "zoh", None, 16), "s3 zoh 16": ("s3", "zoh", None, 16), "s4 zoh 6 true": ("s4-true", "zoh", None, 6)}


def profile(path, filter_name, gains, gate):
    """The thesis' profile with another filter and gate; a key that is not there is an error, not a silent default."""
    with open(PROFILE) as file:
        text = file.read()
    values = {"filter": f'"{filter_name}"', "gate_px": f"{gate:.1f}"}
    if gains:
        values |= {"alpha": str(gains[0]), "beta": str(gains[1])}
    with open(path, "w") as file:
        file.write(profile_text.changed(text, values, PROFILE))


class Run:
    """Scores of one run: columns of scores.csv for the features that are used and visible, and nose-to-tail range by frame."""

    def __init__(self, build, flights, out, name):
        flight, filter_name, gains, gate = RUNS[name]
        stem = os.path.join(out, name.replace(" ", "-"))
        profile(stem + ".toml", filter_name, gains, gate)
        folder = os.path.join(flights, flight)
        done = subprocess.run([os.path.join(build, "bin/cyclops-offline"), folder, "--config", stem + ".toml", "--scores", stem + ".csv", "--summary", stem + ".json", "--quiet"],
                              stdout=subprocess.DEVNULL)
        if done.returncode:
            sys.exit(f"thesis_table.py: cyclops-offline failed on {folder}")
        with open(os.path.join(folder, "figures.json")) as file:
            self.figures = json.load(file)
        with open(os.path.join(folder, "tanker.csv"), newline="") as file:
            used = {int(r["id"]) for r in csv.DictReader(line for line in file if not line.startswith("#")) if r.get("enabled", "1") == "1"}
        with open(stem + ".csv", newline="") as file:
            rows = [r for r in csv.DictReader(file) if r["truth"] == "1" and int(r["id"]) in used]
        c = self.c = {k: np.array([float(r[k]) for r in rows]) for k in rows[0]}
        self.frame = c["frame"].astype(int)
        self.range_ft = np.array(self.figures["by_frame"]["range_ft"])[self.frame - 1]
        self.measured = c["measured"] > 0
        self.error = np.hypot(c["u"] - c["true_u"], c["v"] - c["true_v"])
        self.predicted = c["predicted"] > 0
        self.filter_error = np.hypot(c["predicted_u"] - c["true_u"], c["predicted_v"] - c["true_v"])
        self.live = (c["track_state"] == 1) | (c["track_state"] == 2)

    def detection(self, where=True):
        return self.error[self.measured & where]

    def mean_detection(self, where=True):
        e = self.detection(where)
        return float(e.mean()) if len(e) else float("nan")

    def mean_filter(self):
        return float(self.filter_error[self.predicted].mean())

    def projection(self):
        return self.filter_error[self.predicted & (self.c["nav_update"] > 0)]

    def per_frame(self, values):
        return np.bincount(self.frame, values.astype(float), minlength=self.figures["frames"] + 1)[1:]

    def missed(self):
        return int((~self.measured).sum())

    def without_track(self):
        return int((~self.live).sum())

    def median_by_frame(self):
        out = np.full(self.figures["frames"] + 1, np.nan)
        e, f = self.error[self.measured], self.frame[self.measured]
        for frame in np.unique(f):
            out[frame] = np.median(e[f == frame])
        return out

    def jump_at_updates(self):
        """Mean change of the median detection error from the frame before an update to the update."""
        m, at = self.median_by_frame(), np.unique(self.frame[self.c["nav_update"] > 0])
        return float(np.nanmean([abs(m[k] - m[k - 1]) for k in at if k > 1]))

    def mode(self):
        counts = np.bincount(np.round(self.detection()).astype(int))
        return int(counts.argmax()), int(counts.max())

    def feature(self, number):
        mine = self.c["id"] == number
        e = self.error[mine & self.measured]
        return float(self.measured[mine].mean()) if mine.any() else float("nan"), float(e.mean()) if len(e) else float("nan"), float(e.var()) if len(e) else float("nan")


def px(x):
    return f"{x:.2f} px"


def rows(r, flights):
    """(segment, filter, gate, projection error in, metric, thesis, here)"""
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    import flights_page
    s1, ab, good = r["s1 zoh 13"], r["s1 ab 13"], r["s1 zoh 6 true"]
    p = s1.figures["projection_error"]
    worst = np.array(p["by_frame_px"])
    bimodal = sum(len(flights_page.modes(c)) >= 2 for c in p["counts_by_feature"].values())
    top = flights_page.modes(p["counts_by_px"])
    yield "S1", "-", "-", "yes", "projection error, modes", "2 and 8 px", " and ".join(map(str, top)) + " px"
    yield "S1", "-", "-", "yes", "projection error, counts at 2 px", "3762", str(p["counts_by_px"][2])
    yield "S1", "-", "-", "yes", "features with two modes", "18 of 29", f"{bimodal} of {len(p['counts_by_feature'])}"
    high = np.flatnonzero(worst > .5 * worst.max()) + 1
    yield "S1", "-", "-", "yes", "frames where error is more than half its peak", "600 to 850", f"{high.min()} to {high.max()}"
    yield "S1", "-", "-", "yes", "projection error, mean", "12 to 13 px", px(p["mean_px"])
    yield "S1", "ZOH", "13", "yes", "detection error, mode (counts)", "1 px (6378)", "{} px ({})".format(*s1.mode())
    yield "S1", "ZOH", "13", "yes", "detection error at 60 to 70 ft, mean", "above 3 px", px(s1.mean_detection((s1.range_ft > 60) & (s1.range_ft < 70)))
    yield "S1", "ZOH", "13", "yes", "change of median detection error at an update, mean", "jumps", px(s1.jump_at_updates())
    yield "S1", "a-b - ZOH", "13", "yes", "detection error, difference of means", "insignificant", px(ab.mean_detection() - s1.mean_detection())
    yield "S1", "ZOH", "13", "yes", "filter error, mean", "6.56 px", px(s1.mean_filter())
    yield "S1", "a-b 0.7/0.075", "13", "yes", "filter error, mean", "6.84 px", px(ab.mean_filter())
    yield "S1", "a-b, ZOH", "13", "yes", "pairs without a live track", "a-b never more", f"{ab.without_track()}, {s1.without_track()}"
    yield "S1", "ZOH", "6", "no", "detection error, mean", "2.7 px", px(good.mean_detection())
    yield "S1", "ZOH", "6", "no", "the same, 85 to 95 ft", "2.7 px (E19)", px(good.mean_detection((good.range_ft > 85) & (good.range_ft < 95)))
    yield "S1", "ZOH", "6, 13", "no, yes", "pairs without an observation", "more with 6", f"{good.missed()}, {s1.missed()}"
    for number in (2, 9, 17):
        found, mean, variance = good.feature(number)
        yield "S1", "ZOH", "6", "no", f"feature {number}: P_D, mean error, variance", "1.00, < 1.2 px, < 0.4 px2", f"{found:.2f}, {mean:.2f} px, {variance:.2f} px2"
    z, a, slow = r["s2 zoh 9 true"], r["s2 ab 9 true"], r["s2 ab slow 9 true"]
    yield "S2", "ZOH", "9", "no", "filter error, mean", "3.14 px", px(z.mean_filter())
    yield "S2", "ZOH", "9", "no", "missed: without an observation; without a live track", "4573", f"{z.missed()}; {z.without_track()}"
    yield "S2", "a-b 0.9/0.25", "9", "no", "filter error, mean", "3.35 px", px(a.mean_filter())
    yield "S2", "a-b 0.9/0.25", "9", "no", "missed: without an observation; without a live track", "3068", f"{a.missed()}; {a.without_track()}"
    yield "S2", "a-b 0.7/0.075", "9", "no", "filter error, mean; missed (E35)", "-", f"{px(slow.mean_filter())}; {slow.missed()}"
    yield "S2", "a-b - ZOH", "9", "no", "extra observations a frame", "1.5", f"{(z.missed() - a.missed()) / z.figures['frames']:.2f}"
    yield "S2", "ZOH, a-b", "9", "no", "fewest observations in a frame", "20", f"{z.per_frame(z.measured).min():.0f}, {a.per_frame(a.measured).min():.0f}"
    m = z.figures["motion_px_a_frame"]
    yield "S2", "-", "-", "-", "motion in the image, largest", "4 px/frame", f"{m['max']:.2f} px/frame"
    for leg, there in (("fast closure", .66), ("closure", .46), ("to the right", 1.22)):
        ours = [x["motion_px_a_frame"] for x in z.figures["legs"] if x["name"] == leg][0]
        yield "S2", "-", "-", "-", f"motion in the image, {leg}, mean", f"{there} px/frame", f"{ours:.2f} px/frame"
    t1, t2 = r["s3 zoh 16 true"], r["s3 zoh 16"]
    yield "S3", "-", "-", "yes", "projection error, mean", "12.1 px", px(t2.figures["projection_error"]["mean_px"])
    yield "S3", "ZOH", "16", "no", "detection error, mean", "5.1 px", px(t1.mean_detection())
    yield "S3", "ZOH", "16", "yes", "detection error, mean", "none given", px(t2.mean_detection())
    for name, x in (("no", t1), ("yes", t2)):
        yield "S3", "ZOH", "16", name, "detection error, mode; share of 10 px and more", "4 px; right tail", f"{x.mode()[0]} px; {100 * (x.detection() >= 10).mean():.1f} %"
        yield "S3", "ZOH", "16", name, "pairs without a live track", "very few" if name == "no" else "more", str(x.without_track())
    s4 = r["s4 zoh 6 true"]
    same = good.mean_detection((good.range_ft > 80) & (good.range_ft < 97))
    yield "S4", "ZOH", "6", "no", "detection error, mean", "1.96 px", px(s4.mean_detection())
    yield "S4", "ZOH", "6", "no", "the same less than with 12.5 mm at the same range by", "0.75 px", px(same - s4.mean_detection())
    yield "S4", "ZOH", "6", "no", "in angle: 12.5 mm, 25 mm", "2.59, 0.94 mrad (E20)", f"{.96 * same:.2f}, {.48 * s4.mean_detection():.2f} mrad"
    fewest = {name: x.per_frame(x.measured).min() for name, x in r.items()}
    name = min(fewest, key=fewest.get)
    yield "all", "-", "-", "both", "fewest measurements in a frame", "12", f"{fewest[name]:.0f} ({name})"


HEAD = ("segment", "filter", "gate px", "projection error in", "metric", "thesis", "here")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--flights", default="build/flights")
    parser.add_argument("--out", default="build/thesis")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    table = list(rows({name: Run(args.build, args.flights, args.out, name) for name in RUNS}, args.flights))
    lines = ["| " + " | ".join(HEAD) + " |", "|" + " --- |" * len(HEAD)] + ["| " + " | ".join(row) + " |" for row in table]
    with open(os.path.join(args.out, "thesis-table.md"), "w") as file:
        file.write("\n".join(lines) + "\n")
    with open(os.path.join(args.out, "thesis-table.json"), "w") as file:
        json.dump([dict(zip(HEAD, row)) for row in table], file, indent=1)
    widths = [max(len(row[k]) for row in [HEAD, *table]) for k in range(len(HEAD))]
    for row in [HEAD, *table]:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())
    print(f"\n{args.out}/thesis-table.md, .json")


if __name__ == "__main__":
    main()
