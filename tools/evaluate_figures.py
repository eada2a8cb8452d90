"""Pictures of an evaluation; those of the thesis (figures 4.3 to 4.22: errors by time and range, histograms, strength) from our data."""
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import evaluate_metrics
import evaluate_runs

BLUE, AMBER, GREY, RED = "#1f5a8a", "#c47f17", "#8a94a6", "#a8321e"
SEGMENTS = ("s1", "s2", "s3", "s4")
LIGHT = ("s1", "s3", "low-sun-out", "low-sun-in", "twilight", "night")
REAL, TRUE = "12px-1hz", "true-1hz"
WHO = {"default": BLUE, "peer-opencv": AMBER, "peer-visp": GREY, "thesis-2007": RED}


def save(figure, out, name):
    figure.tight_layout()
    figure.savefig(os.path.join(out, name), dpi=110)
    plt.close(figure)
    return name


def numbers(values):
    return np.array([np.nan if v is None else v for v in values], float)


def by_time(groups, out):
    there = [(f, c) for f in SEGMENTS for c in (REAL, TRUE) if (f, c, "default") in groups]
    figure, axes = plt.subplots(len(there), 1, figsize=(11, 2.1 * len(there)), squeeze=False)
    for axis, (f, c) in zip(axes[:, 0], there):
        s = groups[f, c, "default"]["series"]
        axis.plot(s["t_s"], numbers(s["projection"]), ".", ms=3, color=AMBER, label="projection, at updates")
        axis.plot(s["t_s"], numbers(s["filter"]), color=GREY, lw=.6, label="filter")
        axis.plot(s["t_s"], numbers(s["error"]), color=BLUE, lw=.8, label="detection")
        axis.set(ylabel="median error (px)", title=f"{f}, {c}, seed {groups[f, c, 'default']['seeds'][0]}", yscale="symlog", ylim=(0, 60), yticks=[0, 1, 2, 5, 10, 30], yticklabels=["0", "1", "2", "5", "10", "30"])
        twin = axis.twinx()
        twin.fill_between(s["t_s"], s["a_frame"], color=BLUE, alpha=.12, lw=0)
        twin.set(ylabel="measured a frame", ylim=(0, 40))
    axes[0, 0].legend(loc="upper left", fontsize=7, ncols=3)
    axes[-1, 0].set_xlabel("time (s)")
    return save(figure, out, "by_time.png"), "Median error of each frame and (shaded) measurements a frame, one seed (thesis 4.3, 4.6, 4.9, 4.14, 4.17, 4.20)"


def histograms(groups, out):
    there = [f for f in SEGMENTS if (f, REAL, "default") in groups]
    figure, axes = plt.subplots(len(there), 3, figsize=(11, 2.1 * len(there)), squeeze=False)
    for row, f in zip(axes, there):
        for axis, (counts, words) in zip(row, (("projection", "projection error"), ("filter", "filter error"), ("detection_px", "detection error"))):
            for c, colour, shift in ((REAL, BLUE, -.2), (TRUE, AMBER, .2)):
                g = groups.get((f, c, "default"))
                if g and not (counts == "projection" and c == TRUE):
                    n = np.array(g["counts"][counts], float)
                    axis.bar(np.arange(len(n)) + shift, 100 * n / max(1, n.sum()), .4, color=colour, label=c)
            axis.set(xlim=(-1, 25), title=f"{f}: {words}", xlabel="px", ylabel="%")
    axes[0, 2].legend(fontsize=7)
    return save(figure, out, "histograms.png"), "Histograms in bins of 1 px, all seeds (thesis 4.4, 4.7, 4.8, 4.12, 4.15, 4.18, 4.21)"


def sums(group, name):
    """(features, range bins)"""
    features = group["counts"]["features"]
    ids = sorted(features, key=int)
    return [int(i) for i in ids], np.array([features[i][name] for i in ids], float)


def by_range(groups, out):
    figure, axes = plt.subplots(1, 2, figsize=(11, 3.2))
    middle = np.append(evaluate_metrics.RANGE_BINS_FT - 5, evaluate_metrics.RANGE_BINS_FT[-1] + 5)
    for (f, c, p), g in sorted(groups.items()):
        if f not in ("s1", "s2") or c not in (REAL, TRUE) or p not in WHO:
            continue
        error, measured, visible = (sums(g, n)[1].sum(0) for n in ("error", "measured", "visible"))
        style = {"color": WHO[p], "ls": "-" if f == "s1" else "--", "marker": "o" if c == REAL else "x", "ms": 3, "lw": 1, "label": f"{f} {c} {p}"}
        with np.errstate(invalid="ignore", divide="ignore"):
            axes[0].plot(middle, np.where(measured > 50, error / measured, np.nan), **style)
            axes[1].plot(middle, np.where(visible > 50, measured / visible, np.nan), **style)
    axes[0].set(xlabel="range (ft)", ylabel="mean detection error (px)", ylim=(0, 10))
    axes[1].set(xlabel="range (ft)", ylabel="P_D", ylim=(0, 1.05))
    axes[1].legend(fontsize=6)
    return save(figure, out, "by_range.png"), "Mean detection error and detection probability by range, all seeds (thesis 4.5, 4.10, 4.13)"


def strength(groups, out):
    """Maps of features by range (S1) and by light."""
    there = [f for f in LIGHT if (f, REAL, "default") in groups]
    s1 = groups.get(("s1", REAL, "default"))
    figure, axes = plt.subplots(2, 2, figsize=(13, 9))
    if s1:
        ids, visible = sums(s1, "visible")
        measured, error = sums(s1, "measured")[1], sums(s1, "error")[1]
        columns = np.flatnonzero(visible.sum(0) > 0)
        labels = [f"{evaluate_metrics.RANGE_BINS_FT[c] - 10}" for c in np.minimum(columns, len(evaluate_metrics.RANGE_BINS_FT) - 1)]
        with np.errstate(invalid="ignore", divide="ignore"):
            heat(axes[0, 0], (measured / visible)[:, columns], labels, ids, "P_D in S1 by range, ft from", 0, 1)
            heat(axes[0, 1], np.where(measured > 20, error / measured, np.nan)[:, columns], labels, ids, "mean error in S1, px, by range, ft from", 0, 3)
    all_ids = sorted({i for f in there for i in sums(groups[f, REAL, "default"], "visible")[0]})
    found, off = np.full((len(all_ids), len(there)), np.nan), np.full((len(all_ids), len(there)), np.nan)
    for k, f in enumerate(there):
        ids, visible = sums(groups[f, REAL, "default"], "visible")
        measured, error = sums(groups[f, REAL, "default"], "measured")[1].sum(1), sums(groups[f, REAL, "default"], "error")[1].sum(1)
        for i, v, m, e in zip(ids, visible.sum(1), measured, error):
            found[all_ids.index(i), k] = m / v if v else np.nan
            off[all_ids.index(i), k] = e / m if m > 20 else np.nan
    heat(axes[1, 0], found, there, all_ids, "P_D by light", 0, 1)
    heat(axes[1, 1], off, there, all_ids, "mean error by light, px", 0, 3)
    return save(figure, out, "strength.png"), "Strength of the features by range and light, all seeds (thesis 4.11, 4.16, 4.22); white: not seen or fewer than 20 measurements"


def heat(axis, values, columns, rows, title, low, high):
    if not values.size:
        return axis.set_visible(False)
    image = axis.imshow(values.T, aspect="auto", cmap="viridis" if high == 1 else "magma_r", vmin=low, vmax=high)
    axis.set(title=title, xlabel="feature", xticks=range(len(rows)), yticks=range(len(columns)), yticklabels=columns)
    axis.set_xticklabels(rows, fontsize=6)
    plt.colorbar(image, ax=axis, fraction=.04)


def seeds(groups, out):
    there = [k for k in sorted(groups) if k[2] == "default" and groups[k]["runs"] > 1]
    figure, axes = plt.subplots(3, 1, figsize=(11, 7), sharex=True)
    for axis, name, words in zip(axes, ("error_px.mean", "over_5px", "coverage_95"), ("mean error (px)", "share > 5 px", "95 % ellipse holds")):
        for x, k in enumerate(there):
            values = [v[name] for v in groups[k]["by_seed"].values() if v.get(name) is not None]
            axis.plot(np.full(len(values), x) + np.linspace(-.2, .2, max(1, len(values)))[:len(values)], values, "o", ms=3, color=BLUE)
        axis.set(ylabel=words)
        axis.grid(alpha=.3)
    axes[0].set(yscale="log", yticks=[.2, .5, 1, 2, 5], yticklabels=["0.2", "0.5", "1", "2", "5"])
    axes[2].axhspan(.93, .97, color=AMBER, alpha=.3)
    axes[2].set_xticks(range(len(there)), [f"{f}\n{c}" for f, c, _ in there], fontsize=6, rotation=60)
    return save(figure, out, "seeds.png"), "Every seed: one point a run"


def peers(groups, out):
    flights = sorted({k[0] for k in groups if k[2].startswith("peer-")})
    figure, axes = plt.subplots(1, max(1, len(flights)), figsize=(2.6 * max(2, len(flights)), 2.8), squeeze=False, sharey=True)
    for axis, f in zip(axes[0], flights):
        for (g, c, p), group in sorted(groups.items()):
            if g == f and c in (evaluate_runs.BESIDE, "as it is") and p in WHO:
                n = np.array(group["counts"]["error"], float)
                seen = sum(map(sum, (x["visible"] for x in group["counts"]["features"].values())))
                axis.plot(evaluate_metrics.ERROR_BINS[1:-1], 100 * np.cumsum(n)[:-1] / max(1, seen), color=WHO[p], lw=1.2, label=p)
        axis.set(title=f, xlabel="error (px)", xlim=(0, 10), ylim=(0, 100))
        axis.grid(alpha=.3)
    axes[0, 0].set_ylabel("% of visible features within")
    axes[0, 0].legend(fontsize=7)
    return save(figure, out, "peers.png"), "Share of the visible features measured within an error: Cyclops and the peers on the same flights (one seed, first 300 frames)"


def stages(groups, out):
    there = [(f, REAL, "default") for f in SEGMENTS if (f, REAL, "default") in groups]
    figure, axis = plt.subplots(figsize=(11, 2.6))
    left, names = np.zeros(len(there)), [n.split(".")[1] for n in groups[there[0]]["mean"] if n.startswith("stage_us_p50.")]
    for name, colour in zip(names, plt.cm.tab10.colors):
        width = np.array([groups[k]["mean"][f"stage_us_p50.{name}"] for k in there])
        axis.barh([k[0] for k in there], width, left=left, color=colour, label=name)
        left += width
    axis.set(xlabel="us, median of each stage")
    axis.legend(fontsize=7, loc="center left", bbox_to_anchor=(1, .5))
    return save(figure, out, "stages.png"), "Time of each stage, median: a frame in which nothing is found costs little. Other work on the machine is in it"


def draw(groups, out):
    """[(file, caption)]; a picture without data is left out."""
    has = lambda test: any(test(*k) for k in groups)
    out_ = []
    if has(lambda f, c, p: f in SEGMENTS and c == REAL and p == "default"):
        out_ += [by_time(groups, out), histograms(groups, out), by_range(groups, out), strength(groups, out), stages(groups, out)]
    if has(lambda f, c, p: p == "default" and groups[f, c, p]["runs"] > 1):
        out_.append(seeds(groups, out))
    if has(lambda f, c, p: p.startswith("peer-")):
        out_.append(peers(groups, out))
    return out_
