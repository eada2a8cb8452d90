#!/usr/bin/python3
"""flight_look.py FLIGHT [--sheet FILE.png] [--video FILE.mp4] [--truth] [--types DIR]

Pictures of a flight for people: a contact sheet of twelve frames, a video (needs ffmpeg: make deps-extra), each of the whole frame or
of the tanker with its true features. Counts are shown with gamma 2.2 from 0 to full scale, the same for every flight.
"""
import argparse
import os
import shutil
import subprocess
import sys

import numpy as np
from PIL import Image, ImageDraw

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import flight_frames


def picture(flight, number, width, truth):
    """The whole frame, or with truth the part about the tanker: on the whole frame the rings would hide it."""
    frame_id, counts = flight.frame(number)
    image = flight_frames.shown(counts)
    left, top, across, down = flight.about_tanker(frame_id, image.width, image.height) if truth else (0, 0, image.width, image.height)
    scale = width / across
    size = width, 2 * round(down * scale / 2)  # even, for the video
    if not truth and scale < 1:
        image = image.resize(size, Image.Resampling.BOX)
    else:
        image = image.transform(size, Image.Transform.EXTENT, (left, top, left + across, top + down), Image.Resampling.BICUBIC)
    image = image.convert("RGB")
    if truth:
        flight.draw_truth(image, frame_id, scale, left, top)
    return frame_id, image


def contact_sheet(flight, path, truth, count=12):
    columns, width = (3, 600) if truth else (4, 400)
    picks = np.unique(np.linspace(0, len(flight) - 1, count).astype(int))
    tiles = [picture(flight, int(n), width, truth) for n in picks]
    height = tiles[0][1].height
    rows = -(-len(tiles) // columns)
    sheet = Image.new("RGB", (columns * (width + 4), rows * (height + 4)), "white")
    for k, (frame_id, image) in enumerate(tiles):
        ImageDraw.Draw(image).text((6, 4), f"frame {frame_id}", fill="white", font=flight_frames.font(15), stroke_width=2, stroke_fill="black")
        sheet.paste(image, ((k % columns) * (width + 4), (k // columns) * (height + 4)))
    sheet.save(path)


def video(flight, path, truth, rate_hz):
    if not shutil.which("ffmpeg"):
        sys.exit("flight_look.py: ffmpeg is missing (make deps-extra)")
    width = 960 if truth else 768
    _, first = picture(flight, 0, width, truth)
    command = ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{first.width}x{first.height}", "-r", f"{rate_hz:g}", "-i", "-",
               "-c:v", "libx264", "-crf", "21", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-movflags", "+faststart", path]
    process = subprocess.Popen(command, stdin=subprocess.PIPE)
    try:
        for n in range(len(flight)):
            process.stdin.write(picture(flight, n, width, truth)[1].tobytes())
        process.stdin.close()
    except BrokenPipeError:
        pass
    if process.wait():
        sys.exit(f"flight_look.py: ffmpeg could not write {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flight")
    parser.add_argument("--sheet", help="contact sheet, PNG")
    parser.add_argument("--video", help="MP4")
    parser.add_argument("--rate", type=float, default=30, help="frames a second of the video")
    parser.add_argument("--truth", action="store_true", help="draw the true features")
    parser.add_argument("--types", default="build/gen/python", help="folder of the generated Python types")
    args = parser.parse_args()
    sys.path.insert(0, args.types)
    flight = flight_frames.Flight(args.flight)
    if args.sheet:
        contact_sheet(flight, args.sheet, args.truth)
    if args.video:
        video(flight, args.video, args.truth, args.rate)


if __name__ == "__main__":
    main()
