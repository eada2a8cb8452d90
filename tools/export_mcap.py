#!/usr/bin/python3
"""export_mcap.py FOLDER --out FILE.mcap: a sortie or flight for Foxglove and whatever else reads MCAP.

Each channel keeps its name and becomes JSON with a schema made of its LCM type. Thumbnails are foxglove.CompressedImage on THUMBNAIL, frames, if
asked for, on IMAGE: jpeg 8 bits, png the exact counts. log_time is the arrival on the service clock, publish_time the instant the message
speaks of where it names one on that clock. Files that say what rig and profile it was become attachments.
Needs the library (make mcap) and the generated types (make types). Exit code: 0 written, 1 cannot be done, 77 no library.
"""
import argparse
import base64
import io
import json
import os
import re
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
VENV = os.path.join(ROOT, "build/mcap/bin/python")
TYPES = {"TSPI_RECEIVER": "tspi_t", "TSPI_TANKER": "tspi_t", "TIME_MARK": "time_mark_t", "STROBE": "strobe_edge_t", "FRAME": "frame_index_t",
         "NAV": "nav_state_t", "PREDICTION": "prediction_set_t", "SUBIMAGE": "subimage_set_t", "CORNER": "corner_set_t", "TRACK": "track_set_t",
         "MEASUREMENT": "measurement_set_t", "HEALTH": "health_t", "CLOCK": "clock_state_t", "EVENT": "event_t", "TRUTH": "truth_t",
         "ACQUISITION": "acquisition_t", "CYCLOPS_MARK": "mark_t"}
USUAL = "MEASUREMENT|HEALTH|CLOCK|EVENT|NAV|FRAME|TSPI_.*|TIME_MARK"
ATTACHED = ("manifest.toml", "sortie.toml", "rig.toml", "profile.toml", "tanker.csv")
INSTANT = ("mid_exposure_ns", "service_time_ns")  # on the service clock
FORMATS = {"jpeg": ("JPEG", {"quality": 85}), "png": ("PNG", {"compress_level": 1})}
BITS = {0: 8, 1: 10, 2: 12, 3: 16}
IMAGE = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "foxglove.CompressedImage", "type": "object",
         "properties": {"timestamp": {"type": "object", "title": "time", "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0, "maximum": 999999999}}},
                        "frame_id": {"type": "string"}, "data": {"type": "string", "contentEncoding": "base64"}, "format": {"type": "string"}}}


def library():
    """Starts again with the Python of the library when this one has none."""
    try:
        import mcap.writer
        return mcap.writer
    except ImportError:
        if os.path.exists(VENV) and os.path.realpath(sys.prefix) != os.path.realpath(os.path.join(ROOT, "build/mcap")):
            os.execv(VENV, [VENV, *sys.argv])
        sys.stderr.write("export_mcap: no MCAP library; run: make mcap\n")
        sys.exit(77)


class Out:
    """The file being written: schemas and channels as they are first needed."""

    def __init__(self, stream, module):
        self.writer = module.Writer(stream)
        self.writer.start(profile="", library="cyclops export_mcap")
        self.channels, self.counts = {}, {}

    def put(self, topic, name, make_schema, log_time, publish_time, value):
        if topic not in self.channels:
            s = self.writer.register_schema(name=name, encoding="jsonschema", data=json.dumps(make_schema()).encode())
            self.channels[topic] = self.writer.register_channel(topic=topic, message_encoding="json", schema_id=s)
        n = self.counts[topic] = self.counts.get(topic, 0) + 1
        self.writer.add_message(self.channels[topic], log_time=log_time, publish_time=publish_time, sequence=n, data=json.dumps(value, allow_nan=False).encode())

    def put_image(self, topic, format, log_time, publish_time, data):
        self.put(topic, "foxglove.CompressedImage", lambda: IMAGE, log_time, publish_time,
                 {"timestamp": {"sec": publish_time // 10**9, "nsec": publish_time % 10**9}, "frame_id": "camera", "format": format, "data": base64.b64encode(data).decode()})


class Export:
    def __init__(self, out, types, module_events, channels):
        import lcm_schema
        self.out, self.types, self.events = out, types, module_events
        self.wanted = re.compile(channels)
        self.folder = os.path.join(ROOT, "lcmtypes")
        self.schema = lcm_schema.schema
        self.values = lcm_schema.Values(self.folder)
        self.mid_exposure = {}  # by camera frame id, for the pixels
        self.unreadable = 0

    def log(self, path, leave_out=()):
        """All events of a log but those of channels that another log tells better."""
        for _, time_us, channel, payload in self.events(path):
            name = TYPES.get(channel)
            if name is None or channel in leave_out:
                continue
            try:
                message = getattr(self.types, name).decode(payload)
            except Exception as error:  # the generated decoder raises whatever its bytes lead to
                self.unreadable += 1
                if self.unreadable == 1:
                    sys.stderr.write(f"export_mcap: {path}: {channel} cannot be read: {error}\n")
                continue
            self.message(channel, name, time_us * 1000, message)

    def message(self, channel, name, log_time, message):
        instant = next((getattr(message, f) for f in INSTANT if getattr(message, f, 0) > 0), log_time)
        if channel == "FRAME":
            self.mid_exposure[message.camera_frame_id] = instant
            if message.thumbnail_bytes:
                self.out.put_image("THUMBNAIL", "jpeg", log_time, instant, bytes(message.thumbnail_jpeg))
            message.thumbnail_bytes, message.thumbnail_jpeg = 0, b""
        if self.wanted.fullmatch(channel):
            self.out.put(channel, f"cyclops.{name}", lambda: self.schema(self.folder, name), log_time, instant, self.values.of(name, message))

    def frames(self, path, format):
        import numpy as np
        from PIL import Image
        kind, options = FORMATS[format]
        for _, time_us, channel, payload in self.events(path):
            if channel != "FRAME_DATA":
                continue
            m = self.types.frame_data_t.decode(payload)
            if m.size_bytes == 0:
                continue
            counts = np.frombuffer(bytes(m.pixels), np.uint8 if m.pixel_format == 0 else np.dtype("<u2"))[:m.width_px * m.height_px].reshape(m.height_px, m.width_px)
            if format == "jpeg":
                counts = (counts >> (BITS[m.pixel_format] - 8)).astype(np.uint8)
            data = io.BytesIO()
            Image.fromarray(counts).save(data, kind, **options)
            self.out.put_image("IMAGE", format, time_us * 1000, self.mid_exposure.get(m.camera_frame_id, time_us * 1000), data.getvalue())


def attach(out, folder):
    for name in ATTACHED:
        path = os.path.join(folder, name)
        if os.path.exists(path):
            with open(path, "rb") as file:
                out.writer.add_attachment(create_time=0, log_time=0, name=name, media_type="text/plain", data=file.read())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="sortie or flight")
    parser.add_argument("--out", required=True, help="file to write; must not be there")
    parser.add_argument("--published", help="log of what was published, for a flight that is no sortie")
    parser.add_argument("--channels", default=USUAL, help="regular expression; all: .*")
    parser.add_argument("--frames", choices=sorted(FORMATS), help="the pixels too: jpeg 8 bits, png exact counts")
    parser.add_argument("--types", default=os.path.join(ROOT, "build/gen/python"), help="folder of the generated Python types")
    args = parser.parse_args()
    module = library()
    sys.path[:0] = [args.types, os.path.dirname(os.path.abspath(__file__))]
    import cyclops
    import event_log
    messages, published = os.path.join(args.folder, "messages.lcm"), args.published or os.path.join(args.folder, "published.lcm")
    if not os.path.exists(messages):
        parser.exit(1, f"export_mcap: {args.folder} is no flight: it has no messages.lcm\n")
    with open(args.out, "xb") as stream:
        out = Out(stream, module)
        export = Export(out, cyclops, event_log.events, args.channels)
        there = os.path.exists(published)
        export.log(messages, ("FRAME", "EVENT") if there else ())
        if there:
            export.log(published)
        if args.frames:
            export.frames(os.path.join(args.folder, "frames.lcm"), args.frames)
        attach(out, args.folder)
        out.writer.finish()
    print(f"{args.out}: " + ", ".join(f"{n} {topic}" for topic, n in sorted(out.counts.items())))
    if export.unreadable:
        print(f"{export.unreadable} messages could not be read: other message types than this program's")
    return 0


if __name__ == "__main__":
    sys.exit(main())
