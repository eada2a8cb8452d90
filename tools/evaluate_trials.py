"""Trials: flights in which something is wrong from a known time on (cyclops-disturb), and what the chain makes of it."""
import os
import shutil

import numpy as np

import evaluate_metrics
import evaluate_runs as runs

AT_S = 6.0                  # of a step; S1's navigation is good there (1.6 to 3.2 px)
LAST = 600                  # frame
LOCK_SHARE, LOCK_PX, LOCK_FOR_S = .5, 2.0, .3  # locked: half of the visible features measured, median error below, and it stays so
OCCLUDED = ((151, 165), (226, 285), (331, 339))  # frames: 0.5 s, 2 s, 0.3 s
OCCLUDED_LAST = 375
SIGMA = 3 ** -.5            # stated per axis so that the drawn offset is one sigma long
TRIALS = {                  # name: options of cyclops-disturb, condition, values for the profile
    "undisturbed": ([], "12px", None),
    "position step 0.5 m": (["--at", str(AT_S), "--position", "0.5"], "12px", None),
    "attitude step 2 deg": (["--at", str(AT_S), "--attitude", "2"], "12px", None),
    "frozen link": (["--at", str(AT_S), "--frozen"], "12px", None),
    "acquisition": (["--at", "-100", "--position", "5", "--attitude", "3", "--position-sigma", f"{5 * SIGMA:.3f}", "--attitude-sigma", f"{3 * SIGMA:.3f}"], "12px", None),
    "occlusion": (["--occlude", *(str(f) for o in OCCLUDED for f in o), "--last-frame", str(OCCLUDED_LAST)], "12px", None),
    "10 s without navigation": ([], "12px", [AT_S, AT_S + 10]),
}

FRAMES = {"acquisition": 180, "occlusion": OCCLUDED_LAST}  # the others: LAST


def lock_s(t_s, visible_rows, begin, end):
    """Seconds from frame `begin` until the features are found and stay found; None when that is not before frame `end`."""
    good = np.zeros(len(t_s), bool)
    for f in range(begin, end):
        rows = visible_rows[visible_rows["frame"] == f]
        got = rows[rows["measured"] > 0]
        if len(rows) and len(got) >= LOCK_SHARE * len(rows):
            good[f] = np.median(np.hypot(got["u"] - got["true_u"], got["v"] - got["true_v"])) < LOCK_PX
    for f in range(begin, end):
        hold = (t_s >= t_s[f]) & (t_s < t_s[f] + LOCK_FOR_S) & (np.arange(len(t_s)) < end)
        if good[hold].all() and t_s[end - 1] - t_s[f] >= .8 * LOCK_FOR_S:
            return float(t_s[f] - t_s[begin])
    return None


def wrong(rows, frames_from):
    """(wrong by > 5 px, all, measured though hidden) of the measurements from a frame on."""
    m = rows[(rows["measured"] > 0) & (rows["frame"] >= frames_from)]
    e = np.hypot(m["u"] - m["true_u"], m["v"] - m["true_v"])
    return int(((e > evaluate_metrics.WRONG_PX) & (m["truth"] != 2)).sum()), len(m), int((m["truth"] == 0).sum())


def figures(name, features, frames, rig):
    on = [f["id"] for f in rig["features"] if f["enabled"]]
    rows = features[np.isin(features["id"], on)]
    visible = rows[rows["truth"] == 1]
    t_s = (frames["t_mid_ns"] - frames["t_mid_ns"][0]) * 1e-9
    out = {}
    if name == "acquisition":
        out["lock_s"] = [lock_s(t_s, visible, 0, len(frames))]
    elif name == "occlusion":
        ends = [a - 1 for a, _ in OCCLUDED[1:]] + [len(frames)]
        out["lock_s"] = [lock_s(t_s, visible, last, end) for (_, last), end in zip(OCCLUDED, ends)]
    else:
        begin = int(np.searchsorted(t_s, AT_S))
        flagged = np.flatnonzero(frames["nav_suspect"][begin:])
        out["flagged_s"] = float(t_s[begin + flagged[0]] - AT_S) if len(flagged) else None
        out["flagged_before"] = int(frames["nav_suspect"][:begin].sum())
        window = (visible["frame"] >= begin) & (t_s[visible["frame"]] < AT_S + 10)
        got = visible[window & (visible["measured"] > 0)]
        out["detection_probability"] = float(len(got) / max(1, window.sum()))
        out["mean_px"] = float(np.hypot(got["u"] - got["true_u"], got["v"] - got["true_v"]).mean()) if len(got) else None
        out["wrong"], out["measured"], _ = wrong(rows, begin)
    out["hidden"] = wrong(rows, 0)[2]
    return out


def key(setting, name, profile, seed):
    options, condition, dropout = TRIALS[name]
    return setting.run_key("s1", "measured", seed, f"{name} {options} {dropout} {text_of(profile, condition, dropout)} {trial_code()}")


def trial_code():
    return runs.sha(runs.content(os.path.abspath(__file__)))


def text_of(profile, condition, dropout):
    text = runs.profile_for(profile, "s1", condition, runs.frame_rate("s1"))
    return text.replace("[nav]\n", f"[nav]\ndropouts_s = {dropout}\n", 1) if dropout else text


def job(setting, seed, profile, names):
    """All trials of one seed that are missing."""
    folder = os.path.join(setting.work, f"trial-{seed}")
    try:
        runs.fly(setting, "s1", "measured", seed, folder)
        for name in names:
            options, condition, dropout = TRIALS[name]
            copy, tables = folder + "-copy", folder + "-tables"
            runs.call([setting.program("cyclops-disturb"), folder, "--out", copy, "--seed", str(seed), *options])
            os.makedirs(tables, exist_ok=True)
            with open(os.path.join(tables, "profile.toml"), "w") as file:
                file.write(text_of(profile, condition, dropout))
            runs.call([setting.program("cyclops-evaluate"), copy, "--config", os.path.join(tables, "profile.toml"), "--out", tables, "--frames", str(FRAMES.get(name, LAST))])
            runs.save(setting, key(setting, name, profile, seed), {"trial": name, "seed": seed, **figures(name, *evaluate_metrics.load(tables))})
            shutil.rmtree(copy)
    finally:
        for f in (folder, folder + "-copy", folder + "-tables"):
            shutil.rmtree(f, ignore_errors=True)


def merged(results):
    """{trial: figures over the seeds}. Never flagged or locked counts as the length of the trial in `_worst`."""
    found = {}
    for r in results:
        found.setdefault(r["trial"], []).append(r)
    out = {}
    for name, all_ in found.items():
        d = out[name] = {"runs": len(all_)}
        for figure in ("flagged_s", "lock_s"):
            values = [x for r in all_ if figure in r for x in (r[figure] if isinstance(r[figure], list) else [r[figure]])]
            if not values:
                continue
            there = [x for x in values if x is not None]
            longest = LAST / 30 - AT_S
            d[figure + "_never"] = len(values) - len(there)
            d[figure + "_mean"] = float(np.mean(there)) if there else longest
            d[figure + "_worst"] = float(max(there, default=longest)) if len(there) == len(values) else longest
            if figure == "lock_s":
                d["lock_within_goal"] = float(np.mean([x is not None and x <= (2.0 if name == "acquisition" else .5) for x in values]))
        for figure in ("detection_probability", "mean_px", "flagged_before"):
            values = [r[figure] for r in all_ if r.get(figure) is not None]
            if values:
                d[figure] = float(np.mean(values))
        if "wrong" in all_[0]:
            d["wrong"] = sum(r["wrong"] for r in all_) / max(1, sum(r["measured"] for r in all_))
        d["hidden"] = sum(r["hidden"] for r in all_)
    plain = out.get("undisturbed")
    for d in out.values():
        if plain and "wrong" in d and d is not plain:
            d["wrong_more"] = max(0.0, d["wrong"] - plain["wrong"])
    return out
