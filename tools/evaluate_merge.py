"""Runs of one flight, condition and profile to one set of figures: the mean over the seeds, their spread and the worst."""
import subprocess

import numpy as np

BY_SEED = ("error_px.mean", "error_px.median", "error_px.p99", "over_5px", "longest_wrong_s", "coverage_95", "measurements_a_frame", "within_3px_of_visible", "chain_us.median")
LOWER_IS_WORSE = ("detection_probability", "within_3px_of_visible", "measurements_a_frame", "measurements_a_frame_p5", "measurements_a_frame_min", "coverage_95", "consensus")


def flat(tree, prefix=""):
    """Numbers of nested dictionaries by dotted name."""
    out = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            out |= flat(value, f"{prefix}{key}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            out[prefix + key] = float(value)
    return out


def added(a, b):
    """Element by element, lists of different length and nested dictionaries."""
    if isinstance(a, dict):
        return {k: added(a[k], b[k]) if k in a and k in b else a.get(k, b.get(k)) for k in {**a, **b}}
    n = max(len(a), len(b))
    return [x + y for x, y in zip(list(a) + [0] * (n - len(a)), list(b) + [0] * (n - len(b)))]


def groups(results):
    """{(flight, condition, profile): {"runs", "seeds", "mean", "sd", "worst", "counts", "series"}}; series are those of the first seed."""
    gathered = {}
    for r in results:
        gathered.setdefault((r["flight"], r["condition"], r["profile"]), []).append(r)
    out = {}
    for key, found in gathered.items():
        found.sort(key=lambda r: r["seed"])
        columns = {}
        for r in found:
            for name, value in flat(r["scalars"]).items():
                columns.setdefault(name, []).append(value)
        counts = found[0]["counts"]
        for r in found[1:]:
            counts = added(counts, r["counts"])
        out[key] = {
            "runs": len(found), "seeds": [r["seed"] for r in found], "mean": {k: float(np.mean(v)) for k, v in columns.items()}, "sd": {k: float(np.std(v)) for k, v in columns.items()},
            "worst": {k: float(min(v) if k.split(".")[-1] in LOWER_IS_WORSE else max(v)) for k, v in columns.items()}, "counts": counts, "series": found[0]["series"],
            "by_seed": {r["seed"]: {k: flat(r["scalars"]).get(k) for k in BY_SEED} for r in found}}
    return out


def beside_peers(groups_):
    """[{"flight", "who", figures}]: each peer's runs and Cyclops' over the very same flights and seeds."""
    out = []
    for f, c in sorted({(f, c) for f, c, p in groups_ if p.startswith("peer-")}):
        seeds = set.intersection(*(set(g["seeds"]) for (g_f, g_c, _), g in groups_.items() if (g_f, g_c) == (f, c)))
        for (g_f, g_c, who), g in sorted(groups_.items()):
            if (g_f, g_c) == (f, c) and seeds:
                figures = {k: [g["by_seed"][s][k] for s in seeds if g["by_seed"][s][k] is not None] for k in BY_SEED}
                out.append({"flight": f, "who": who, "seeds": sorted(seeds), **{k: round(float(np.mean(v)), 4) for k, v in figures.items() if v}})
    return out


def version():
    try:
        text = subprocess.run(["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return text


def small(groups_, goals, trials, seeds, failed):
    """What is written as JSON and kept as accepted."""
    return {"version": version(), "seeds": seeds, "failed": failed, "goals": goals, "trials": trials, "peers": beside_peers(groups_),
            "groups": {" ".join(key): {"runs": g["runs"], "mean": {k: round(v, 4) for k, v in g["mean"].items()}, "sd": {k: round(v, 4) for k, v in g["sd"].items() if k.count(".") < 2},
                                       "worst": {k: round(v, 4) for k, v in g["worst"].items() if k.count(".") < 2}} for key, g in groups_.items()}}
