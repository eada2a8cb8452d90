"""The table of faults: a line on the terminal, Markdown, HTML and JSON."""
import html
import json
import os

COLUMNS = ("fault", "noticed by (after s)", "recovered in s", "frames lost", "measurements lost %", "wrong", "wrong times", "other clock", "result")


def cells(r):
    f = r["figures"]
    named = [(n, t) for n, t in f["noticed"].items() if n in r["notice"] and not r.get("absorbed")]
    noticed = ", ".join(f"{n} ({t:.1f})" for n, t in named[:2]) or ("did no harm" if r.get("absorbed") else "-")
    recovered = "never" if f["recovered_s"] is None else f"{f['recovered_s']:.1f}"
    lost = f"{f['frames_not_measured']} of {f['frames_sent']}"
    if f["frames_unaccounted"]:
        lost += f" ({f['frames_unaccounted']} uncounted)"
    return (r["name"], noticed, recovered, lost, f"{f['measurements_lost_percent']:.1f}", f"{f['wrong']} of {f['measurements']}", str(f["wrong_times"]),
            str(f["frames_other_clock"]), ("pass" if not r["why"] else "FAIL: " + "; ".join(r["why"])) + (f" (try {r['tries']})" if r.get("tries", 1) > 1 else ""))


WIDTHS = (30, 52, 9, 12, 7, 13, 6, 6)
SHORT = ("fault", "noticed by (after s)", "rec. s", "frames lost", "lost %", "wrong", "times", "clock", "result")


def row_text(words):
    return " ".join(f"{w:<{n}.{n}}" for w, n in zip(words, WIDTHS)) + " " + words[-1]


def header():
    return row_text(SHORT)


def line(r):
    return row_text(cells(r))


UNITS = {"noticed_s": "noticed {} s", "recovered_s": "recovered {} s", "lost_percent": "lost {} %", "wrong_percent": "wrong {} %", "wrong_times": "{} wrong times"}


def limits(r, usual):
    """Those that are not the usual ones."""
    return ", ".join(UNITS.get(k, k + " {}").format(v) for k, v in r["limit"].items() if v != usual[k]) or "usual"


def write(folder, reference, results, table):
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "faults.json"), "w") as file:
        json.dump({"usual_limit": table["limit"], "onset_s": table["onset_s"], "duration_s": table["duration_s"], "reference": reference, "rows": results}, file, indent=1)
    none = {"name": "none", "figures": reference, "why": [], "notice": [], "limit": None}
    columns = COLUMNS[:-1] + ("pass limit", "result")
    rows = [cells(none)[:-1] + ("", "reference")] + [cells(r)[:-1] + (limits(r, table["limit"]), cells(r)[-1]) for r in results]
    with open(os.path.join(folder, "faults.md"), "w") as file:
        file.write("| " + " | ".join(columns) + " |\n|" + " --- |" * len(columns) + "\n")
        for r in rows:
            file.write("| " + " | ".join(c.replace("|", "/") for c in r) + " |\n")
    with open(os.path.join(folder, "faults.html"), "w") as file:
        file.write(page(columns, rows, table))


def page(columns, rows, table):
    usual = ", ".join(UNITS.get(k, k + " {}").format(v) for k, v in table["limit"].items() if k in UNITS)
    style = ("body{font:14px/1.4 sans-serif;margin:2em;color:#1b2733}table{border-collapse:collapse}td,th{border-bottom:1px solid #cbd5e0;"
             "padding:.35em .7em;text-align:left;vertical-align:top}th{background:#edf2f7}.FAIL{color:#c53030;font-weight:bold}.pass{color:#2f855a}")
    body = "".join("<tr>" + "".join(f'<td class="{c.split(":")[0] if i == len(r) - 1 else ""}">{html.escape(c)}</td>' for i, c in enumerate(r)) + "</tr>\n" for r in rows)
    head = "".join(f"<th>{html.escape(c)}</th>" for c in columns)
    return (f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Faults on demand</title><style>{style}</style><h1>Faults on demand</h1>'
            f"<p>One run of the whole rig a row; the fault lasts from {table['onset_s']:g} to {table['onset_s'] + table['duration_s']:g} s of {table['seconds']:g} s unless the row is another. Usual limits: {usual}. "
            f"What each column is: docs/faults.md.</p><table><tr>{head}</tr>\n{body}</table></html>\n")
