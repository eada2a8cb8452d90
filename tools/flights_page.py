#!/usr/bin/python3
"""flights_page.py [FLIGHTS] [--video] [--types DIR]

One page about a folder of generated flights (default build/flights): what each shows, with a contact sheet and figures beside
those of the flight test (spec 4.1 to 4.3). Writes FLIGHTS/page/: index.html, figures.json, pictures; --video adds videos.
"""
import argparse
import html
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import flight_frames
import flight_look
from report import AMBER, BLUE, STYLE

SPEC = {  # what the specification says of a flight: (figure, its value there)
    "s1": [("projection_modes_px", "2 and 8"), ("projection_mean_px", "12 to 13"), ("bimodal_features", "18 of 29"), ("range_ft", "100 to 35 or 50")],
    "s1-50": [("projection_modes_px", "2 and 8"), ("projection_mean_px", "12 to 13"), ("range_ft", "100 to 50")],
    "s2": [("motion max px/frame", "4"), ("motion, fast closure", "0.66"), ("motion, closure", "0.46"), ("motion, to the right", "1.22")],
    "s3": [("projection_mean_px", "12.1"), ("saturated", "right side of the picture")],
    "s4": [("range_ft", "97 to 80"), ("features outside at 80 ft", "4")],
}


def modes(counts):
    """Places of the maxima of a histogram that stand out: three-bin mean, at least a quarter of the largest, with a dip of a quarter between."""
    smooth = np.convolve(counts, [.25, .5, .25], "same")
    found = []
    for k in range(len(smooth) - 1):
        if smooth[k] < max(smooth) / 4 or smooth[k] < smooth[max(0, k - 1)] or smooth[k] <= smooth[k + 1]:
            continue
        if found and min(smooth[found[-1]:k + 1]) > .75 * min(smooth[found[-1]], smooth[k]):
            if smooth[k] > smooth[found[-1]]:
                found[-1] = k
            continue
        found.append(k)
    return found


def digest(figures):
    """The figures of a flight that go beside the specification's."""
    p, m = figures["projection_error"], figures["motion_px_a_frame"]
    bimodal = [i for i, c in (p["counts_by_feature"] or {}).items() if len(modes(c)) >= 2]
    out = {
        "frames": figures["frames"], "frame_rate_hz": figures["frame_rate_hz"], "focal_mm": round(figures["focal_mm"], 2),
        "range_ft": f"{figures['by_frame']['range_ft'][0]:.1f} to {figures['by_frame']['range_ft'][-1]:.1f}",
        "features visible, mean (min)": f"{figures['features_visible']['mean']:.1f} ({figures['features_visible']['min']:.0f})",
        "motion mean px/frame": round(m.get("mean", 0), 2), "motion max px/frame": round(m.get("max", 0), 2),
        "saturated share, mean (max)": f"{100 * figures['saturated_share']['mean']:.2f} % ({100 * figures['saturated_share']['max']:.2f} %)",
        "searched share (29 features, 30 px, thesis)": f"{100 * figures['searched_share']['mean']:.2f} %",
        "projection_mean_px": round(p["mean_px"], 2), "projection_modes_px": " and ".join(map(str, modes(p["counts_by_px"]))) or "-",
        "bimodal_features": f"{len(bimodal)} of {len(p['counts_by_feature'] or {})}"}
    for leg in figures.get("legs") or []:
        if leg["name"]:
            out[f"motion, {leg['name']}"] = f"{leg['motion_px_a_frame']:.2f} px/frame at {leg['closing_ftps']:.1f} ft/s"
    return out


def plots(figures, path):
    p, frames = figures["projection_error"], figures["by_frame"]
    t = np.arange(len(frames["range_ft"])) / figures["frame_rate_hz"]
    figure, axes = plt.subplots(1, 3, figsize=(12, 2.6))
    axes[0].bar(range(len(p["counts_by_px"])), p["counts_by_px"], color=AMBER, width=.9)
    axes[0].set(xlabel="projection error (px)", ylabel="features and frames")
    axes[1].plot(t, p["by_frame_px"], color=AMBER, lw=1)
    axes[1].set(xlabel="time (s)", ylabel="projection error, mean (px)", ylim=(0, None))
    axes[2].plot(t, frames["motion_px"], color=BLUE, lw=.8)
    axes[2].set(xlabel="time (s)", ylabel="motion (px/frame)", ylim=(0, None))
    twin = axes[2].twinx()
    twin.plot(t, frames["range_ft"], color="#4a5568", lw=.8, ls="--")
    twin.set_ylabel("range (ft), dashed")
    twin.grid(False)
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)


def overview(flights, path, columns=4, width=400):
    tiles = []
    for name, flight in flights:
        _, image = flight_look.picture(flight, len(flight) // 2, width, False)
        ImageDraw.Draw(image).text((6, 4), name, fill="white", font=flight_frames.font(17), stroke_width=2, stroke_fill="black")
        tiles.append(image)
    height = max(i.height for i in tiles)
    sheet = Image.new("RGB", (columns * (width + 4), -(-len(tiles) // columns) * (height + 4)), "white")
    for k, image in enumerate(tiles):
        sheet.paste(image, ((k % columns) * (width + 4), (k // columns) * (height + 4)))
    sheet.save(path)


def section(name, figures, values, pictures):
    rows, spec = [], dict(SPEC.get(figures["scenario"], []))
    for key in list(values) + [k for k in spec if k not in values]:
        rows.append(f"<tr><td>{html.escape(key.replace('_', ' '))}</td><td>{html.escape(str(values.get(key, '')))}</td><td>{html.escape(spec.get(key, ''))}</td></tr>")
    links = "".join(f" <a href='{file}'>{words}</a>" for words, file in pictures[1:])
    return (f"<h2 id='{name}'>{name}</h2><p>{html.escape(figures['about'])}{links}</p><a href='{pictures[0][1]}'><img src='{pictures[0][1]}' alt='frames of {name}'></a>"
            f"<img src='{name}.svg' alt='figures of {name}'><table style='columns:1'><tr><th></th><th>here</th><th>flight test</th></tr>{''.join(rows)}</table>")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flights", nargs="?", default="build/flights")
    parser.add_argument("--video", action="store_true", help="videos of each flight, plain and with truth")
    parser.add_argument("--types", default="build/gen/python", help="folder of the generated Python types")
    args = parser.parse_args()
    sys.path.insert(0, args.types)
    out = os.path.join(args.flights, "page")
    os.makedirs(out, exist_ok=True)
    parts, all_values, opened = [], {}, []
    names = sorted(n for n in os.listdir(args.flights) if all(os.path.exists(os.path.join(args.flights, n, f)) for f in ("manifest.toml", "figures.json")))
    if not names:
        sys.exit(f"flights_page.py: no flights with figures in {args.flights} (make flights)")
    for name in names:
        with open(os.path.join(args.flights, name, "figures.json")) as file:
            figures = json.load(file)
        all_values[name] = digest(figures)
        if figures["navigation"] == "true":
            continue  # the same pictures
        flight = flight_frames.Flight(os.path.join(args.flights, name))
        opened.append((name, flight))
        pictures = [("", f"{name}.png"), ("sheet with truth", f"{name}-truth.png")]
        flight_look.contact_sheet(flight, os.path.join(out, f"{name}.png"), False)
        flight_look.contact_sheet(flight, os.path.join(out, f"{name}-truth.png"), True)
        for truth in (False, True) if args.video else ():
            file = f"{name}{'-truth' if truth else ''}.mp4"
            flight_look.video(flight, os.path.join(out, file), truth, figures["frame_rate_hz"])
            pictures.append(("video with truth" if truth else "video", file))
        plots(figures, os.path.join(out, f"{name}.svg"))
        parts.append(section(name, figures, all_values[name], pictures))
        print(name, flush=True)
    overview(opened, os.path.join(out, "overview.png"))
    with open(os.path.join(out, "figures.json"), "w") as file:
        json.dump(all_values, file, indent=1)
    with open(os.path.join(out, "index.html"), "w") as file:
        file.write(f"<!doctype html><html lang='en'><meta charset='utf-8'><title>Cyclops flights</title><style>{STYLE}</style><body><h1>Generated flights</h1>"
                   "<p>Synthetic: a reconstruction of a C-12 drawn by a program, flown as the flight test's record says. Figures: docs/flights.md.</p>"
                   f"<img src='overview.png' alt='the middle frame of every flight'>{''.join(parts)}</body></html>")
    print(os.path.join(out, "index.html"))


if __name__ == "__main__":
    main()
