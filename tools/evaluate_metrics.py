"""Figures of one run from the tables of cyclops-evaluate. Definitions of spec 4.1; errors radial, raw pixels, features that truth calls
visible and the model has switched on, unless a name says otherwise. docs/evaluation.md lists every figure.
"""
import json
import os

import numpy as np

import evaluate_pose

WRONG_PX = 5.0                       # a measurement further off is of something else
LONG_WRONG_S = 0.3                   # a track wrong for longer has diverged
CHI2_95 = 5.991                      # 2 degrees of freedom
GENUINE = (3, 4, 5, 7, 10, 12, 29, 31, 33, 38)  # C-12: surveyed points that are corners of the image
KINDS = ("corner", "crossing", "patch")
ERROR_BINS = np.append(np.arange(0, 20.01, .1), np.inf)
PIXEL_BINS = np.append(np.arange(-.5, 60, 1), np.inf)
RANGE_BINS_FT = np.arange(30, 131, 10)


def load(folder):
    with open(os.path.join(folder, "rig.json")) as file:
        rig = json.load(file)
    return np.load(os.path.join(folder, "features.npy")), np.load(os.path.join(folder, "frames.npy")), rig


def distribution(x):
    x = np.asarray(x, float)
    if not len(x):
        return {"n": 0}
    q = np.percentile(x, [50, 95, 99])
    return {"n": len(x), "mean": float(x.mean()), "median": float(q[0]), "p95": float(q[1]), "p99": float(q[2]), "max": float(x.max())}


def share(part, whole):
    return float(part) / float(whole) if whole else None


def mahalanobis2(du, dv, uu, uv, vv):
    det = np.asarray(uu * vv - uv * uv, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(det > 0, (vv * du * du - 2 * uv * du * dv + uu * dv * dv) / det, np.inf)


def wrong_spells(t_s, measured, error, alive):
    """Spells (start, end in s) in which one track is wrong: from a wrong measurement to the last wrong one before a right one or the
    track's end. A frame without a measurement does not end it."""
    spells, start, last = [], None, None
    for t, m, e, a in zip(t_s, measured, error, alive):
        if m and e > WRONG_PX:
            start, last = (t if start is None else start), t
        elif start is not None and (m or not a):
            spells.append((start, last))
            start = None
    return spells + ([(start, last)] if start is not None else [])


def tracks_wrong(rows, t_s, period_s):
    """Length of every spell of every feature, s; one frame counts as one period."""
    out = []
    order = np.lexsort((rows["frame"], rows["id"]))
    rows = rows[order]
    edges = np.flatnonzero(np.diff(rows["id"])) + 1
    for r in np.split(rows, edges):
        e = np.hypot(r["u"] - r["true_u"], r["v"] - r["true_v"])
        if not (e > WRONG_PX).any():
            continue
        alive = (r["track_state"] == 1) | (r["track_state"] == 2)
        out += [b - a + period_s for a, b in wrong_spells(t_s[r["frame"]], r["measured"] > 0, e, alive)]
    return out


def of_measurements(m):
    """Figures of accepted measurements of visible features."""
    e = np.hypot(m["u"] - m["true_u"], m["v"] - m["true_v"])
    d2 = mahalanobis2(m["u"] - m["true_u"], m["v"] - m["true_v"], m["cov_uu"], m["cov_uv"], m["cov_vv"])
    out = {"error_px": distribution(e)}
    if len(m):
        wrong = (e > WRONG_PX) | (m["nearest_other"] < e)
        out |= {"over_3px": float((e > 3).mean()), "over_5px": float((e > WRONG_PX).mean()), "misassociated": float(wrong.mean()), "coverage_95": float((d2 < CHI2_95).mean()),
                "nees_half_median": float(np.median(d2) / 1.386), "nees_half": float(np.minimum(d2, 1e3).mean() / 2), "nis_half": float(np.nanmean(m["nis"]) / 2)}
    return out


def by_feature(visible, ranges):
    """{id: sums}, and the same by range: what adds up over seeds."""
    out = {}
    place = np.clip(np.digitize(np.nan_to_num(ranges[visible["frame"]], nan=-1), RANGE_BINS_FT), 0, len(RANGE_BINS_FT))
    error = np.hypot(visible["u"] - visible["true_u"], visible["v"] - visible["true_v"])
    for i in np.unique(visible["id"]):
        mine, bins = visible["id"] == i, len(RANGE_BINS_FT) + 1
        got = mine & (visible["measured"] > 0)
        sums = lambda where, w=None: np.bincount(place[where], None if w is None else w[where], bins).astype(float).tolist()
        out[str(i)] = {"visible": sums(mine), "measured": sums(got), "error": sums(got, error), "error2": sums(got, error ** 2), "wrong": sums(got & (error > WRONG_PX))}
    return out


def position_figures(features, frames, rig, ranges):
    at, error, bound, d2 = evaluate_pose.positions(features, frames, rig)
    if not len(at):
        return {"frames": 0}
    size, allowed = np.linalg.norm(error, axis=1), np.trace(bound, axis1=1, axis2=2)
    out = {"frames": len(at), "error_m": distribution(size), "rms_m": float(np.sqrt((size ** 2).mean())), "bound_rms_m": float(np.sqrt(allowed.mean())),
           "ratio_to_bound": float(np.sqrt((size ** 2).mean() / allowed.mean())), "nees_third": float(np.minimum(d2, 1e4).mean() / 3), "nees_third_median": float(np.median(d2) / 2.366)}
    for name, low, high in (("35ft", 0, 40), ("100ft", 95, 105)):
        there = (ranges[at] >= low) & (ranges[at] < high)
        if there.sum() >= 20:
            out["p95_m_" + name] = float(np.percentile(size[there], 95))
            out["rms_m_" + name] = float(np.sqrt((size[there] ** 2).mean()))
    return out


def median_by_frame(frame, value, count):
    out = np.full(count, np.nan)
    order = np.lexsort((value, frame))
    f, v = frame[order], value[order]
    for part in np.split(np.arange(len(f)), np.flatnonzero(np.diff(f)) + 1):
        if len(part):
            out[f[part[0]]] = np.median(v[part])
    return [None if np.isnan(x) else round(float(x), 3) for x in out]


def figures(features, frames, rig, ranges_ft=None):
    """All of one run. `ranges_ft`: nose to reference by frame, where known."""
    n = len(frames)
    ranges = np.full(n, np.nan) if ranges_ft is None else np.resize(np.array(ranges_ft[rig.get("first_frame", 0):], float), n)
    t_s = (frames["t_mid_ns"] - frames["t_mid_ns"][0]) * 1e-9 if n else np.zeros(0)
    period = float(np.median(np.diff(t_s))) if n > 1 else 0.0
    on = [f["id"] for f in rig["features"] if f["enabled"]]
    rows = features[np.isin(features["id"], on)]
    visible = rows[rows["truth"] == 1]
    measured = visible[visible["measured"] > 0]
    hidden = rows[(rows["truth"] == 0) & (rows["measured"] > 0)]
    corners = GENUINE if set(GENUINE) <= {f["id"] for f in rig["features"]} else ()
    genuine = np.isin(visible["id"], corners)
    error = np.hypot(measured["u"] - measured["true_u"], measured["v"] - measured["true_v"])
    off = lambda r, name: np.hypot(r[name + "_u"] - r["true_u"], r[name + "_v"] - r["true_v"])
    predicted = visible[(visible["predicted"] > 0) & (frames["nav_update"][visible["frame"]] > 0)]
    before = visible[visible["before"] > 0]
    a_frame = np.bincount(rows["frame"][rows["measured"] > 0], minlength=n)
    alive = (visible["track_state"] == 1) | (visible["track_state"] == 2)
    spells = tracks_wrong(rows[rows["truth"] != 2], t_s, period)
    seen = np.bincount(visible["frame"], minlength=n)
    own = of_measurements(measured)
    p_d = {i: (visible["measured"][visible["id"] == i] > 0).mean() for i in np.unique(visible["id"])}
    good = [i for i in p_d if p_d[i] >= .9]
    strong = measured[np.isin(measured["id"], [i for i in good if i in corners])]
    scalars = {
        "frames": n, "frames_with_truth": int(frames["has_truth"].sum()), "duration_s": float(t_s[-1]) if n else 0, "visible_a_frame": float(seen.mean()) if n else 0,
        "detection_probability": share(len(measured), len(visible)), "within_3px_of_visible": share((error < 3).sum(), len(visible)),
        "measurements_a_frame": float(a_frame.mean()) if n else 0, "measurements_a_frame_p5": float(np.percentile(a_frame, 5)) if n else 0, "measurements_a_frame_min": int(a_frame.min()) if n else 0,
        "unobserved": len(visible) - len(measured), "missed_by_dropped_tracks": int((~alive).sum()), "measured_though_hidden": len(hidden),
        **own, "projection_px": distribution(off(predicted, "predicted")), "filter_px": distribution(off(before, "before")),
        "wrong_spells": len(spells), "divergent": sum(int(s > LONG_WRONG_S) for s in spells), "longest_wrong_s": float(max(spells, default=0.0)),
        "genuine": {"detection_probability": share((visible["measured"][genuine] > 0).sum(), genuine.sum()), **of_measurements(measured[np.isin(measured["id"], corners)])},
        "genuine_found": {"features": [int(i) for i in good if i in corners], **of_measurements(strong)}, "found_9_of_10": {"features": len(good), **of_measurements(measured[np.isin(measured["id"], good)])},
        "kinds": {k: of_measurements(measured[measured["kind"] == j]) for j, k in enumerate(KINDS) if (measured["kind"] == j).any()},
        "consensus": float(frames["consensus"].mean()) if n else 0, "nav_suspect": float(frames["nav_suspect"].mean()) if n else 0,
        "position": position_figures(rows, frames, rig, ranges),
        "chain_us": distribution(frames["chain_us"]), "stage_us_p50": dict(zip(rig["stages"], np.median(frames["stage_us"], axis=0).round(1).tolist())) if n else {},
        "stage_us_p99": dict(zip(rig["stages"], np.percentile(frames["stage_us"], 99, axis=0).round(1).tolist())) if n else {}}
    counts = {"error": np.histogram(error, ERROR_BINS)[0].tolist(), "projection": np.histogram(off(predicted, "predicted"), PIXEL_BINS)[0].tolist(),
              "filter": np.histogram(off(before, "before"), PIXEL_BINS)[0].tolist(), "detection_px": np.histogram(error, PIXEL_BINS)[0].tolist(),
              "a_frame": np.bincount(a_frame, minlength=1).tolist(), "features": by_feature(visible, ranges)}
    series = {"t_s": t_s.round(3).tolist(), "range_ft": [None if np.isnan(x) else round(float(x), 2) for x in ranges], "a_frame": a_frame.tolist(),
              "error": median_by_frame(measured["frame"], error, n), "projection": median_by_frame(predicted["frame"], off(predicted, "predicted"), n),
              "filter": median_by_frame(before["frame"], off(before, "before"), n)}
    return {"scalars": scalars, "counts": counts, "series": series}
