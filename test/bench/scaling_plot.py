#!/usr/bin/python3
"""scaling_plot.py IN.json OUT.png: what `bench scaling` measured, stage by stage, beside the time between two frames."""
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

FRAME_MS = 1000 / 60


def main():
    with open(sys.argv[1]) as file:
        runs = json.load(file)
    stages = list(dict.fromkeys(s for r in sorted(runs, key=lambda r: -r["side_px"]) for s in sorted(r["stage_us"], key=lambda s: -r["stage_us"][s])))
    counts, sides = (sorted({r[k] for r in runs}) for k in ("features", "side_px"))
    figure, axes = plt.subplots(1, len(counts), figsize=(11, 3.6))
    for axis, n in zip(axes, counts):
        rows = sorted((r for r in runs if r["features"] == n), key=lambda r: r["side_px"])
        at, bottom = np.arange(len(rows)), np.zeros(len(rows))
        for stage, colour in zip(stages, plt.cm.tab10.colors):
            height = np.array([r["stage_us"][stage] for r in rows]) * 1e-3
            axis.bar(at, height, .6, bottom, color=colour, label=stage)
            bottom += height
        for x, top, r in zip(at, bottom, rows):
            axis.annotate(f"{top:.1f} ms\n{r['searched']:.0%} searched", (x, top), ha="center", va="bottom", fontsize=7, xytext=(0, 2), textcoords="offset points")
        axis.set(title=f"{n} features", xticks=at, xlabel="side of the picture, px", ylim=(0, 1.25 * bottom.max()))
        if bottom.max() > FRAME_MS:
            axis.axhline(FRAME_MS, color="#8a94a6", lw=.8, ls="--", zorder=0)
            axis.text(1.01, FRAME_MS, "60\nHz", fontsize=7, color="#5a6476", va="center", transform=axis.get_yaxis_transform())
        axis.set_xticklabels([r["side_px"] for r in rows])
    axes[0].set_ylabel("CPU time a frame, ms")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], fontsize=7, loc="center right")
    figure.tight_layout(rect=(0, 0, .91, 1))
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
