#!/usr/bin/python3
"""wingrock_plot.py TABLE.csv FIGURES.json OUT.png: what cyclops-wingrock compared (--csv and --json of it)."""
import csv
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def column(rows, name):
    return [float(r[name]) for r in rows]


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    with open(sys.argv[1], newline="") as f:
        rows = list(csv.DictReader(f))
    with open(sys.argv[2]) as f:
        figures = json.load(f)
    t = column(rows, "t_s")
    seen, tspi, fit = (column(rows, n) for n in ("image_roll_deg", "tspi_roll_deg", "fit_deg"))
    _, (above, below) = plt.subplots(2, 1, figsize=(10, 6), sharex=True, height_ratios=[3, 1], constrained_layout=True)
    for m in figures["manoeuvres"]:
        for axes in (above, below):
            axes.axvspan(m["begin_s"], m["end_s"], color="0.92")
    above.plot(t, tspi, color="tab:orange", lw=1.5, label="TSPI at the frames' own stamps")
    above.plot(t, seen, ".", color="tab:blue", ms=3, label="picture")
    above.plot(t, fit, color="black", lw=0.8, label="TSPI where the answer puts it")
    above.set_ylabel("roll in the picture, deg")
    above.legend(loc="upper right")
    if figures["enough"]:
        text = "offset %+.2f ms, 1 sigma %.2f" % (figures["offset_ms"], figures["offset_sigma_ms"])
        if figures["has_drift"]:
            text += "; drift %+.0f ppm, 1 sigma %.0f" % (figures["drift_ppm"], figures["drift_sigma_ppm"])
    else:
        text = "no answer: " + figures["reason"]
    above.set_title(text)
    below.plot(t, [a - b for a, b in zip(seen, fit)], color="tab:blue", lw=0.8)
    below.axhline(0, color="black", lw=0.5)
    below.set_ylabel("picture - fit, deg")
    below.set_xlabel("frame time, s since the first frame")
    for axes in (above, below):
        axes.grid(color="0.85", lw=0.5)
    plt.savefig(sys.argv[3], dpi=110)


main()
