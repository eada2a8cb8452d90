"""The report of an evaluation as text and as a page."""
import html
import os

import evaluate_figures

COLUMNS = (  # heading, figure, format
    ("runs", None, "{:.0f}"), ("mean px", "error_px.mean", "{:.2f}"), ("worst seed", "worst error_px.mean", "{:.2f}"), ("median", "error_px.median", "{:.2f}"), ("p99", "error_px.p99", "{:.1f}"), ("> 5 px %", "over_5px", "{:.2%}"),
    ("misassoc. %", "misassociated", "{:.2%}"), ("P_D %", "detection_probability", "{:.1%}"), ("a frame", "measurements_a_frame", "{:.1f}"), ("hidden", "measured_though_hidden", "{:.0f}"),
    ("dropped", "missed_by_dropped_tracks", "{:.0f}"), ("diverg.", "divergent", "{:.1f}"), ("longest wrong s", "longest_wrong_s", "{:.2f}"), ("95 % ell.", "coverage_95", "{:.1%}"), ("NEES/2", "nees_half", "{:.2f}"), ("NIS/2", "nis_half", "{:.2f}"),
    ("proj. px", "projection_px.mean", "{:.1f}"), ("filter px", "filter_px.mean", "{:.2f}"), ("genuine px", "genuine_found.error_px.mean", "{:.2f}"), ("pos. rms/bound", "position.ratio_to_bound", "{:.2f}"),
    ("consensus", "consensus", "{:.1%}"), ("nav suspect", "nav_suspect", "{:.1%}"), ("chain p50 us", "chain_us.median", "{:.0f}"), ("p99 us", "chain_us.p99", "{:.0f}"))
CHANGES = ("error_px.mean", "error_px.p99", "over_5px", "measurements_a_frame", "coverage_95", "misassociated", "position.ratio_to_bound", "chain_us.p99")
LOWER_IS_BETTER = {"error_px.mean", "error_px.p99", "over_5px", "misassociated", "position.ratio_to_bound", "chain_us.p99"}
NOTE = ("Means over the seeds. A seed draws the errors of navigation, boresight and lever arms; motion, light, sky and sensor noise are those of the scenario, the same for all seeds. "
        "Every picture is synthetic. Times are of one core of this machine while others worked on it.")


def cell(value, form):
    return "-" if value is None else form.format(value)


def value(group, figure):
    """`worst ...`: of the seeds; None: how many runs."""
    if figure is None:
        return group["runs"]
    return group["worst"].get(figure[6:]) if figure.startswith("worst ") else group["mean"].get(figure)


def rows(report):
    for name, g in sorted(report["groups"].items()):
        yield [name, *(cell(value(g, figure), form) for _, figure, form in COLUMNS)]


def goal_rows(report):
    for g in report["goals"]:
        value = "not measured" if g["measured"] is None else f"{g['measured']:g}"
        value += f" ({g['few']:g} a frame)" if "few" in g else ""
        yield [g["goal"], g["where"], g["wanted"], value, "met" if g["met"] else "MISSED"]


PEER_COLUMNS = (("mean px", "error_px.mean", "{:.2f}"), ("median px", "error_px.median", "{:.2f}"), ("p99 px", "error_px.p99", "{:.1f}"), ("> 5 px", "over_5px", "{:.1%}"),
                ("visible within 3 px", "within_3px_of_visible", "{:.1%}"), ("a frame", "measurements_a_frame", "{:.1f}"), ("time a frame, p50 us", "chain_us.median", "{:.0f}"))


def peer_rows(report):
    for p in report["peers"]:
        yield [f"{p['flight']} {p['who']}", *(cell(p.get(figure), form) for _, figure, form in PEER_COLUMNS)]


TRIAL_COLUMNS = (("runs", "runs", "{:.0f}"), ("flagged after s, mean", "flagged_s_mean", "{:.2f}"), ("worst", "flagged_s_worst", "{:.2f}"), ("never", "flagged_s_never", "{:.0f}"), ("locked after s, mean", "lock_s_mean", "{:.2f}"),
                 ("worst", "lock_s_worst", "{:.2f}"), ("never", "lock_s_never", "{:.0f}"), ("in time", "lock_within_goal", "{:.0%}"), ("P_D", "detection_probability", "{:.1%}"), ("mean px", "mean_px", "{:.2f}"),
                 ("> 5 px", "wrong", "{:.2%}"), ("more than undisturbed", "wrong_more", "{:.2%}"), ("flagged before", "flagged_before", "{:.1f}"), ("hidden", "hidden", "{:.0f}"))


def trial_rows(report):
    for name, t in sorted(report["trials"].items()):
        yield [name, *(cell(t.get(figure), form) for _, figure, form in TRIAL_COLUMNS)]


def change_rows(report, before):
    """What differs from the accepted run by more than a hundredth."""
    for name, g in sorted(report["groups"].items()):
        old = before["groups"].get(name)
        if not old:
            continue
        for figure in CHANGES:
            a, b = old["mean"].get(figure), g["mean"].get(figure)
            if a is None or b is None or abs(b - a) <= .01 * max(abs(a), 1e-6):
                continue
            yield [name, figure, f"{a:.4g}", f"{b:.4g}", "better" if (b < a) == (figure in LOWER_IS_BETTER) else "WORSE"]


def aligned(head, body):
    table = [list(head), *body]
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    return "\n".join("  ".join(c.ljust(w) if k == 0 else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths))).rstrip() for row in table)


def sections(report, before):
    """(title, heading, rows)"""
    goals = list(goal_rows(report))
    yield f"Goals: {sum(g['met'] for g in report['goals'])} of {len(goals)} met", ("goal", "where", "wanted", "measured", ""), goals
    yield "Figures, means over the seeds", ("flight, navigation, profile", *(c[0] for c in COLUMNS)), list(rows(report))
    yield "Beside the peers, same flights and seeds", ("flight, whose", *(c[0] for c in PEER_COLUMNS)), list(peer_rows(report))
    yield "Disturbed flights, S1 (never: counted as 14 s)", ("trial", *(c[0] for c in TRIAL_COLUMNS)), list(trial_rows(report))
    if before:
        yield f"Changes against the accepted run ({before['version']}: {before.get('reason', '')})", ("flight, navigation, profile", "figure", "accepted", "now", ""), list(change_rows(report, before))


def text(report, before):
    parts = [f"Evaluation of {report['version']}, seeds {report['seeds']}", NOTE]
    for title, head, body in sections(report, before):
        if body:
            parts.append(f"{title}\n{aligned(head, body)}")
    return "\n\n".join(parts + [f"failed: {f}" for f in report["failed"]])


def markdown(report):
    """The accepted figures as a page for docs/."""
    parts = [f"# Accepted figures: {report['version']}, seeds {report['seeds']}", f"Made by `make evaluate`; [evaluation.md](evaluation.md) says what each figure is. Accepted because: {report['reason']}", NOTE]
    for title, head, body in sections(report, None):
        if body:
            parts.append("\n".join([f"## {title}\n", "| " + " | ".join(head) + " |", "|" + " --- |" * len(head), *("| " + " | ".join(row) + " |" for row in body)]))
    return "\n\n".join(parts) + "\n"


STYLE = """body{font:14px/1.45 system-ui,sans-serif;max-width:1400px;margin:2em auto;padding:0 1em;color:#1a202c}table{border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums}
td,th{padding:.15em .5em;border-bottom:1px solid #e2e8f0;text-align:right;white-space:nowrap}td:first-child,th:first-child{text-align:left}.wide{overflow-x:auto}.bad{color:#b7410e;font-weight:600}img{max-width:100%;display:block;margin:.6em 0}
figcaption{color:#4a5568}figure{margin:1em 0}"""


def html_table(head, body):
    line = lambda row, tag: "<tr>" + "".join(f"<{tag}{' class=bad' if c in ('MISSED', 'WORSE') else ''}>{html.escape(c)}</{tag}>" for c in row) + "</tr>"
    return f"<div class=wide><table>{line(head, 'th')}{''.join(line(r, 'td') for r in body)}</table></div>"


def page(report, groups, before, out):
    """report.html and its pictures."""
    parts = [f"<h1>Evaluation of {html.escape(report['version'])}</h1><p>Seeds {html.escape(report['seeds'])}. {html.escape(NOTE)}</p>"]
    for title, head, body in sections(report, before):
        if body:
            parts.append(f"<h2>{html.escape(title)}</h2>{html_table(head, body)}")
    for file, caption in evaluate_figures.draw(groups, out):
        parts.append(f"<figure><img src='{file}' alt='{html.escape(caption)}'><figcaption>{html.escape(caption)}</figcaption></figure>")
    with open(os.path.join(out, "report.html"), "w") as file:
        file.write(f"<!doctype html><html lang=en><meta charset=utf-8><title>Cyclops evaluation</title><style>{STYLE}</style><body>{''.join(parts)}</body></html>")
