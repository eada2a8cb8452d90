"""The goals of the project beside what was measured. A figure that was not measured is missed, not passed."""

PROFILE = "default"
REAL = "12px-1hz"  # real projection error, navigation at 1 Hz
ENOUGH = 12        # measurements a frame, spec 4.2: below, an error says nothing about what is of use


def below(limit):
    return (lambda x: x <= limit), f"<= {limit:g}"


def above(limit):
    return (lambda x: x >= limit), f">= {limit:g}"


def between(low, high):
    return (lambda x: low <= x <= high), f"{low:g} to {high:g}"


def goals():
    """(what, flight, condition, figure, mean or worst of the seeds, test)"""
    for f in ("s1", "s2"):
        yield "surveyed features, mean px", f, REAL, "error_px.mean", "mean", below(1.0)
        yield "surveyed features, median px", f, REAL, "error_px.median", "mean", below(.5)
        yield "surveyed features, p99 px", f, REAL, "error_px.p99", "mean", below(4)
        yield "measurements a frame", f, REAL, "measurements_a_frame", "mean", above(20)
        yield "genuine corners with P_D >= 0.9, mean px", f, REAL, "genuine_found.error_px.mean", "mean", below(.4)
        yield "learned model, mean px", f + "-learned", REAL, "error_px.mean", "mean", below(.4)
    yield "without projection error, mean px", "s1", "true-1hz", "error_px.mean", "mean", below(.9)
    yield "cloud, mean px", "s3", REAL, "error_px.mean", "mean", below(1.2)
    yield "cloud, longest time a track is wrong by > 5 px, s", "s3", REAL, "longest_wrong_s", "worst", below(.3)
    yield "25 mm, mean px", "s4", REAL, "error_px.mean", "mean", below(.9)
    yield "25 mm without projection error, mean px", "s4", "true-1hz", "error_px.mean", "mean", below(.9)
    for f in ("s1", "s2", "s3", "s4"):
        yield "relative position of one frame, rms over its bound", f, REAL, "position.ratio_to_bound", "mean", below(1.5)
    yield "relative position at 35 ft, 95 % in m", "s1", REAL, "position.p95_m_35ft", "mean", below(.05)
    yield "relative position at 100 ft, 95 % in m", "s1", REAL, "position.p95_m_100ft", "mean", below(.25)
    for f in ("low-sun-out", "twilight"):
        yield "what is visible, mean px", f, REAL, "error_px.mean", "mean", below(1.5)
    for f in ("low-sun-in", "night"):
        yield "wrong by > 5 px, share of measurements", f, REAL, "over_5px", "mean", below(.001)
    for f, limit in (("s1", .002), ("s2", .002), ("s4", .002), ("s3", .01)):
        yield "misassociated, share of measurements", f, REAL, "misassociated", "mean", below(limit)
    for f in ("s1", "s2", "s3", "s4"):
        yield "95 % ellipse holds", f, REAL, "coverage_95", "mean", between(.93, .97)
    yield "real video, 6 px prior, mean px", "cube_6px", "as it is", "error_px.mean", "mean", below(1.0)
    yield "real video, 6 px prior, share within 3 px", "cube_6px", "as it is", "within_3px_of_visible", "mean", above(.97)


def trial_goals(trials):
    """(what, figure or None, test) of the disturbed flights; see evaluate_trials.py."""
    for name in ("position step 0.5 m", "attitude step 2 deg", "frozen link"):
        t = trials.get(name, {})
        yield f"{name}: flagged after s, worst", t.get("flagged_s_worst"), below(1.0)
        yield f"{name}: measurements wrong by > 5 px, more than without, share", t.get("wrong_more"), below(0.0)
    yield "prior wrong by 5 m and 3 deg: locked after s, worst", trials.get("acquisition", {}).get("lock_s_worst"), below(2.0)
    yield "occluded: locked again after s, worst", trials.get("occlusion", {}).get("lock_s_worst"), below(.5)


def line(what, where, value, test, a_frame=ENOUGH):
    """Errors of the segments count only with enough measurements."""
    out = {"goal": what, "where": where, "wanted": test[1], "measured": None if value is None else round(value, 5), "met": bool(value is not None and test[0](value) and a_frame >= ENOUGH)}
    return out if a_frame >= ENOUGH else {**out, "few": round(a_frame, 1)}


def table(groups, trials):
    out = []
    for what, flight, condition, figure, kind, test in goals():
        group = groups.get((flight, condition, PROFILE))
        value = group[kind].get(figure) if group else None
        if group and value is None and figure == "over_5px" and group["mean"].get("error_px.n") == 0:
            value = 0.0  # no measurement at all is what is asked for
        a_frame = group["mean"]["measurements_a_frame"] if group and flight in ("s1", "s2", "s3", "s4") else ENOUGH
        out.append(line(what, f"{flight}, {condition}", value, test, a_frame))
    return out + [line(what, "s1", value, test) for what, value, test in trial_goals(trials)]
