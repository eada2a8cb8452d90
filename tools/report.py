#!/usr/bin/python3
"""report.py FLIGHT LOG SUMMARY.json SCORES.csv OUT_DIR [--types DIR]

One page an engineer reads after a run: the figures, the plots, and frames with what the service saw drawn on them.
FLIGHT is a flight folder, LOG an event log of what the service published, SUMMARY and SCORES come from cyclops-score.
"""
import argparse
import csv
import html
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw, ImageFont

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import event_log

INK, BLUE, RED, GREEN, AMBER, GREY = "#1b2733", "#2b6cb0", "#c53030", "#2f855a", "#b7791f", "#a0aec0"
plt.rcParams.update({
    "figure.figsize": (7.4, 3.1), "figure.dpi": 110, "savefig.bbox": "tight", "font.size": 9, "axes.edgecolor": "#718096",
    "axes.grid": True, "grid.color": "#e2e8f0", "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
    "svg.fonttype": "none"})


def load_scores(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {k: np.array([float(r[k]) for r in rows]) for k in (rows[0] if rows else {})}
    if rows:
        columns["error"] = np.where(columns["measured"] > 0, np.hypot(columns["u"] - columns["true_u"], columns["v"] - columns["true_v"]), np.nan)
        columns["predicted_error"] = np.where(
            columns["predicted"] > 0, np.hypot(columns["predicted_u"] - columns["true_u"], columns["predicted_v"] - columns["true_v"]), np.nan)
    return columns


def by(keys, values, reduce):
    return np.array([[k, reduce(values[keys == k])] for k in np.unique(keys)])


def nan(reduce):
    return lambda v: reduce(v[~np.isnan(v)]) if np.any(~np.isnan(v)) else np.nan


class Page:
    def __init__(self, out):
        self.out, self.parts = out, []

    def add(self, text):
        self.parts.append(text)

    def plot(self, figure, name, words):
        path = os.path.join(self.out, name + ".svg")
        figure.savefig(path)
        plt.close(figure)
        self.add(f'<figure><img src="{name}.svg" alt="{html.escape(words)}"><figcaption>{html.escape(words)}</figcaption></figure>')


def error_over_time(page, s, t):
    visible = s["truth"] == 1
    figure, axis = plt.subplots()
    measured = by(t[visible], s["error"][visible], nan(np.median))
    predicted = by(t[visible], s["predicted_error"][visible], nan(np.median))
    worst = by(t[visible], s["error"][visible], nan(lambda v: np.percentile(v, 95)))
    axis.plot(predicted[:, 0], predicted[:, 1], color=AMBER, lw=1, label="prediction, median")
    axis.fill_between(worst[:, 0], 0, worst[:, 1], color=BLUE, alpha=.15, label="measured, 95 % below")
    axis.plot(measured[:, 0], measured[:, 1], color=BLUE, lw=1.2, label="measured, median")
    axis.axhline(3, color=RED, lw=.8, ls="--", label="3 px wanted")
    axis.set(xlabel="time into the flight (s)", ylabel="error (px)", ylim=(0, None))
    axis.legend(ncol=4, fontsize=7.5, frameon=False, loc="upper center", bbox_to_anchor=(.5, 1.17))
    page.plot(figure, "error_time", "Distance from the true feature, by frame.")


def features_over_time(page, s, t):
    visible = s["truth"] == 1
    figure, axis = plt.subplots()
    for values, colour, label in ((visible, GREY, "visible by truth"), (visible & (s["measured"] > 0), BLUE, "measured"),
                                  (visible & (s["track_state"] == 2), AMBER, "coasting")):
        counts = by(t, values.astype(float), np.sum)
        axis.plot(counts[:, 0], counts[:, 1], color=colour, lw=1.2, label=label)
    axis.set(xlabel="time into the flight (s)", ylabel="features", ylim=(0, None))
    axis.legend(ncol=3, fontsize=7.5, frameon=False, loc="upper center", bbox_to_anchor=(.5, 1.17))
    page.plot(figure, "features_time", "How many features could be seen and were measured.")


def histograms(page, s):
    visible = s["truth"] == 1
    figure, axis = plt.subplots()
    edges = np.arange(0, 20.5, .5)
    for values, colour, label in ((s["predicted_error"], AMBER, "prediction"), (s["error"], BLUE, "measured")):
        values = values[visible & ~np.isnan(values)]
        axis.hist(np.clip(values, 0, 20), edges, color=colour, alpha=.6, label=label)
    axis.set(xlabel="error (px), 20 and more in the last bin", ylabel="count")
    axis.legend(frameon=False)
    page.plot(figure, "histogram", "Error of the predictions that went in and of the measurements that came out.")


def per_feature(page, s):
    visible = s["truth"] == 1
    ids = np.unique(s["id"])
    figure, (top, low) = plt.subplots(2, 1, sharex=True, figsize=(7.4, 4.2))
    med, p95, found = [], [], []
    for i in ids:
        e = s["error"][visible & (s["id"] == i)]
        good = e[~np.isnan(e)]
        med.append(np.median(good) if len(good) else np.nan)
        p95.append(np.percentile(good, 95) if len(good) else np.nan)
        found.append(len(good) / len(e) if len(e) else np.nan)
    x = np.arange(len(ids))
    top.bar(x, p95, color=BLUE, alpha=.25, label="95 % below")
    top.bar(x, med, color=BLUE, label="median")
    top.axhline(3, color=RED, lw=.8, ls="--")
    top.set(ylabel="error (px)")
    top.legend(ncol=2, fontsize=7.5, frameon=False)
    low.bar(x, found, color=GREEN)
    low.set(ylabel="P_D", ylim=(0, 1.05), xlabel="feature")
    low.set_xticks(x, [str(int(i)) for i in ids], fontsize=7)
    page.plot(figure, "features", "Each feature: error where measured, and share of the frames in which it was measured though visible.")


def error_by_range(page, s):
    visible = (s["truth"] == 1) & ~np.isnan(s["error"]) & (s["range_m"] > 0)
    if np.ptp(s["range_m"][visible]) < .5 if np.any(visible) else True:
        return
    r = s["range_m"][visible]
    bins = np.linspace(r.min(), r.max(), 12)
    which = np.clip(np.digitize(r, bins) - 1, 0, 10)
    figure, axis = plt.subplots()
    mid = [.5 * (bins[b] + bins[b + 1]) for b in range(11) if np.any(which == b)]
    mean = [s["error"][visible][which == b].mean() for b in range(11) if np.any(which == b)]
    axis.plot(mid, mean, "o-", color=BLUE, ms=3)
    axis.set(xlabel="range, lens to tanker INS (m)", ylabel="mean error (px)", ylim=(0, None))
    axis.invert_xaxis()
    page.plot(figure, "error_range", "Error against range: closing goes to the right.")


def stages(page, summary):
    times = summary.get("stage_us") or {}
    if not times:
        return
    names = [n for n in times if n != "chain"]
    figure, axis = plt.subplots(figsize=(7.4, 2.4))
    y = np.arange(len(names))
    axis.barh(y, [times[n]["p99"] for n in names], color=BLUE, alpha=.25, label="p99")
    axis.barh(y, [times[n]["p50"] for n in names], color=BLUE, label="p50")
    axis.set_yticks(y, names)
    axis.invert_yaxis()
    axis.set(xlabel="time in the stage (us)")
    axis.legend(frameon=False, fontsize=7.5)
    page.plot(figure, "stages", "Where the time of a frame goes.")


def latency_over_time(page, log_health):
    if len(log_health) < 2:
        return
    t0 = log_health[0].service_time_ns
    t = [(h.service_time_ns - t0) * 1e-9 for h in log_health]
    figure, axis = plt.subplots(figsize=(7.4, 2.4))
    for field, colour in (("latency_ms_p50", BLUE), ("latency_ms_p99", AMBER), ("latency_ms_max", RED)):
        axis.plot(t, [getattr(h, field) for h in log_health], color=colour, lw=1.1, label=field[11:])
    axis.set(xlabel="time (s)", ylabel="latency (ms)", ylim=(0, None))
    axis.legend(ncol=3, frameon=False, fontsize=7.5)
    page.plot(figure, "latency", "Last packet of a frame to its measurements on the network, over the last 1 to 2 s at each moment.")


# --- frames with what was seen ------------------------------------------------------------------------------------

def to_image(data):
    size = (data.height_px, data.width_px)
    pixels = np.frombuffer(data.pixels, np.uint8 if data.pixel_format == 0 else "<u2").reshape(size).astype(np.float32)
    low, high = np.percentile(pixels[::7, ::7], (.2, 99.8))
    return Image.fromarray(np.clip((pixels - low) / max(high - low, 1) * 255, 0, 255).astype(np.uint8)).convert("RGB")


def font(size):
    for path in ("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", os.path.join(matplotlib.get_data_path(), "fonts/ttf/DejaVuSans.ttf")):
        if os.path.exists(path):
            return ImageFont.truetype(path, size)
    return ImageFont.load_default()


def annotate(image, seen, zoom):
    """Predictions as amber crosses with their gate, corners as grey dots, accepted measurements as green rings with the id."""
    image = image.resize((image.width * zoom, image.height * zoom), Image.BICUBIC)
    draw = ImageDraw.Draw(image)
    small = font(11)

    def at(u, v):
        return (u + .5) * zoom, (v + .5) * zoom

    if "SUBIMAGE" in seen:
        m = seen["SUBIMAGE"]
        for i in range(m.n):
            u, v = m.u0_px[i] * zoom, m.v0_px[i] * zoom
            draw.rectangle((u, v, u + m.width_px[i] * zoom, v + m.height_px[i] * zoom), outline="#4a5568")
    if "CORNER" in seen:
        m = seen["CORNER"]
        for u, v in zip(m.u_px, m.v_px):
            x, y = at(u, v)
            draw.ellipse((x - 1.5, y - 1.5, x + 1.5, y + 1.5), fill="#90cdf4")
    if "PREDICTION" in seen:
        for p in seen["PREDICTION"].items:
            if p.visibility != 0:
                continue
            x, y = at(*p.uv_px)
            draw.line((x - 4, y, x + 4, y), fill="#ecc94b")
            draw.line((x, y - 4, x, y + 4), fill="#ecc94b")
    for z in seen["MEASUREMENT"].items:
        x, y = at(*z.raw_px)
        g = z.gate_px * zoom
        if z.accepted:
            draw.ellipse((x - 5, y - 5, x + 5, y + 5), outline="#48bb78", width=2)
            draw.text((x + 7, y - 12), str(z.id), fill="#48bb78", font=small, stroke_width=2, stroke_fill="#1a202c")
            px, py = at(z.raw_px[0] - z.innovation_px[0], z.raw_px[1] - z.innovation_px[1])
            draw.ellipse((px - g, py - g, px + g, py + g), outline="#975a16")
        elif z.reason == 4 or z.reason == 5:
            draw.ellipse((x - 5, y - 5, x + 5, y + 5), outline="#f56565", width=1)
    return image


def interesting(image, seen):
    """The part of the picture around the tanker, 4:3, with some room."""
    points = [p.uv_px for p in seen["PREDICTION"].items if p.visibility == 0] if "PREDICTION" in seen else []
    if len(points) < 3:
        return (0, 0, image.width, image.height)
    points = np.array(points)
    centre, half = (points.max(0) + points.min(0)) / 2, (points.max(0) - points.min(0)) / 2 + 45
    half = np.maximum(half, (half[1] * 4 / 3, half[0] * 3 / 4))
    low = np.clip(centre - half, 0, (image.width - 1, image.height - 1))
    high = np.clip(centre + half, low + 1, (image.width, image.height))
    return tuple(int(v) for v in (*low, *high))


def frames(page, types, flight, log, count=6):
    wanted, index, by_seq = {}, {}, {}
    for _, _, channel, payload in event_log.events(log):
        if channel in ("MEASUREMENT", "CORNER", "PREDICTION", "SUBIMAGE"):
            message = types[channel].decode(payload)
            by_seq.setdefault(message.mid_exposure_ns, {})[channel] = message
    times = sorted(t for t, seen in by_seq.items() if "MEASUREMENT" in seen)
    if not times:
        return
    picks = [times[i] for i in np.linspace(min(3, len(times) - 1), len(times) - 1, count).astype(int)]
    for _, _, channel, payload in event_log.events(os.path.join(flight, "messages.lcm")):
        if channel == "FRAME":
            message = types["FRAME"].decode(payload)
            index[message.camera_frame_id] = message
        elif channel == "TRUTH":
            message = types["TRUTH"].decode(payload)
            if message.mid_exposure_ns in picks:
                wanted[message.camera_frame_id] = message.mid_exposure_ns
    if not wanted:  # no truth: the pictures are matched through the times the service gave them
        published = {}
        for _, _, channel, payload in event_log.events(log):
            if channel == "FRAME":
                message = types["FRAME"].decode(payload)
                published[message.camera_frame_id] = message.mid_exposure_ns
        wanted = {i: t for i, t in published.items() if t in picks}
    page.add("<h2>What the service saw</h2><p>Amber cross: where navigation puts a feature. Blue dot: corner found. Green ring and id: "
             "measurement given to navigation, with its gate. Red ring: refused. Grey box: searched.</p><div class='strip'>")
    for _, _, channel, payload in event_log.events(os.path.join(flight, "frames.lcm")):
        if channel != "FRAME_DATA" or not wanted:
            continue
        head = types["FRAME_DATA"].decode(payload)
        if head.camera_frame_id not in wanted:
            continue
        seen = by_seq[wanted.pop(head.camera_frame_id)]
        image = to_image(head)
        box = interesting(image, seen)
        zoom = 2 if box[2] - box[0] < 900 else 1
        name = f"frame_{head.camera_frame_id:06d}.png"
        annotate(image, seen, zoom).crop(tuple(v * zoom for v in box)).save(os.path.join(page.out, name))
        page.add(f"<figure><a href='{name}'><img src='{name}' alt='frame'></a><figcaption>frame {head.camera_frame_id}: "
                 f"{seen['MEASUREMENT'].accepted} measured</figcaption></figure>")
    page.add("</div>")


def number(value):
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
    return str(value)


def headline(page, summary):
    e, lat = summary.get("feature_error_px", {}), summary.get("latency_ms", {})
    cards = [("frames in", f"{summary.get('frames_received', summary.get('frames', 0))} of {summary.get('frames_served', summary.get('frames', 0))}"),
             ("lost", str(sum((summary.get("frames_lost_by_cause") or {}).values()))),
             ("mean error", f"{e.get('mean', 0):.2f} px"), ("95 % below", f"{e.get('p95', 0):.2f} px"),
             ("within 3 px of visible", f"{100 * summary.get('share_within_3px', 0):.0f} %"),
             ("measured a frame", f"{summary.get('features_matched_mean', 0):.1f}"),
             ("latency p50 / p99", f"{lat.get('p50', 0):.1f} / {lat.get('p99', 0):.1f} ms")]
    page.add("<div class='cards'>" + "".join(f"<div><b>{html.escape(v)}</b><span>{k}</span></div>" for k, v in cards) + "</div>")


def table(page, title, values):
    page.add(f"<h2>{title}</h2><table>")

    def rows(prefix, value):
        if isinstance(value, dict):
            for k, v in value.items():
                rows(f"{prefix}.{k}" if prefix else k, v)
        elif not isinstance(value, list):
            page.add(f"<tr><td>{html.escape(prefix)}</td><td>{html.escape(number(value))}</td></tr>")

    rows("", values)
    page.add("</table>")


STYLE = """body{font:15px/1.5 system-ui,sans-serif;color:#1b2733;max-width:1060px;margin:2em auto;padding:0 1em}
h1{font-size:1.5em;margin-bottom:0}h2{font-size:1.1em;margin-top:2em;border-bottom:1px solid #e2e8f0}
.cards{display:flex;flex-wrap:wrap;gap:.7em;margin:1.2em 0}.cards div{background:#f7fafc;border:1px solid #e2e8f0;border-radius:6px;padding:.6em 1em}
.cards b{display:block;font-size:1.25em}.cards span{color:#4a5568;font-size:.85em}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(480px,1fr));gap:1em}figure{margin:0}img{max-width:100%}
figcaption{color:#4a5568;font-size:.85em}.strip{display:grid;grid-template-columns:repeat(auto-fit,minmax(320px,1fr));gap:.8em}
table{border-collapse:collapse;font-size:.85em;columns:2}td{border-bottom:1px solid #edf2f7;padding:.15em 1em .15em 0}"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flight")
    parser.add_argument("log")
    parser.add_argument("summary")
    parser.add_argument("scores")
    parser.add_argument("out")
    parser.add_argument("--types", default="build/gen/python", help="folder of the generated Python types")
    args = parser.parse_args()
    sys.path.insert(0, args.types)
    import cyclops as lcm
    types = {"MEASUREMENT": lcm.measurement_set_t, "CORNER": lcm.corner_set_t, "PREDICTION": lcm.prediction_set_t, "SUBIMAGE": lcm.subimage_set_t,
             "FRAME": lcm.frame_index_t, "FRAME_DATA": lcm.frame_data_t, "TRUTH": lcm.truth_t, "HEALTH": lcm.health_t}
    os.makedirs(args.out, exist_ok=True)
    with open(args.summary) as file:
        summary = json.load(file)
    page = Page(args.out)
    name = html.escape(str(summary.get("flight", os.path.basename(args.flight.rstrip("/")))))
    page.add(f"<h1>Cyclops run: {name}</h1><p>Profile {html.escape(str(summary.get('profile', '?')))}, version "
             f"{html.escape(str(summary.get('version', '?')))}. All errors are radial distances in raw pixels from the true feature.</p>")
    headline(page, summary)
    scores = load_scores(args.scores)
    page.add("<div class='plots'>")
    if scores and len(scores["t_mid_ns"]):
        t = (scores["t_mid_ns"] - scores["t_mid_ns"].min()) * 1e-9
        error_over_time(page, scores, t)
        features_over_time(page, scores, t)
        histograms(page, scores)
        per_feature(page, scores)
        error_by_range(page, scores)
    else:
        page.add("<p>This flight carries no truth: no errors are shown.</p>")
    stages(page, summary)
    latency_over_time(page, [types["HEALTH"].decode(p) for _, _, c, p in event_log.events(args.log) if c == "HEALTH"])
    page.add("</div>")
    frames(page, types, args.flight, args.log)
    table(page, "Every figure", summary)
    with open(os.path.join(args.out, "report.html"), "w") as file:
        file.write(f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Cyclops run</title><style>{STYLE}</style><body>" + "\n".join(page.parts) + "</body></html>")
    print(os.path.join(args.out, "report.html"))


if __name__ == "__main__":
    main()
