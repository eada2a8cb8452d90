"""Frames and truth of a flight folder for Python tools. Needs the generated types (build/gen/python) on sys.path."""
import os
import struct

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import event_log

GREEN, AMBER = "#48bb78", "#ecc94b"
LEAST_WIDTH = 160  # px of the camera in a picture with truth


def font(size):
    try:
        return ImageFont.truetype("DejaVuSans.ttf", size)
    except OSError:
        return ImageFont.load_default()


class Flight:
    def __init__(self, folder):
        import cyclops as lcm
        self.folder, self.lcm = folder, lcm
        self.truth = {}
        for _, _, channel, payload in event_log.events(os.path.join(folder, "messages.lcm")):
            if channel == "TRUTH":
                message = lcm.truth_t.decode(payload)
                self.truth[message.camera_frame_id] = message
        self.offsets = list(self._index())

    def _index(self):
        """(file, offset, bytes) of each frame, without its pixels being read."""
        for path in event_log.parts(os.path.join(self.folder, "frames.lcm")):
            with open(path, "rb") as file:
                while len(head := file.read(28)) == 28:
                    _, _, _, channel, size = struct.unpack(">IqqII", head)
                    if file.read(channel) == b"FRAME_DATA":
                        yield path, file.tell(), size
                    file.seek(size, os.SEEK_CUR)

    def __len__(self):
        return len(self.offsets)

    def frame(self, number):
        """(camera frame id, counts as a matrix)"""
        path, offset, size = self.offsets[number]
        with open(path, "rb") as file:
            file.seek(offset)
            head = self.lcm.frame_data_t.decode(file.read(size))
        kind = np.uint8 if head.pixel_format == 0 else np.dtype("<u2")
        return head.camera_frame_id, np.frombuffer(bytes(head.pixels), kind)[:head.width_px * head.height_px].reshape(head.height_px, head.width_px)

    def about_tanker(self, frame_id, width, height):
        """(left, top, width, height), 3 : 2, about all features in front of the camera, seen or not; of the whole frame when none is near it."""
        truth = self.truth.get(frame_id)
        points = [(truth.u_px[k], truth.v_px[k]) for k in range(truth.n if truth else 0)]
        points = [(min(max(u, 0), width), min(max(v, 0), height)) for u, v in points if -width < u < 2 * width and -height < v < 2 * height]
        if not points:
            return 0, (height - width / 1.5) / 2, width, width / 1.5
        low, high = np.min(points, axis=0), np.max(points, axis=0)
        size = min(max(1.2 * max(high[0] - low[0], 1.5 * (high[1] - low[1])), LEAST_WIDTH), width) * np.array([1, 1 / 1.5])
        left, top = np.clip((low + high - size) / 2, 0, np.array([width, height]) - size)
        return left, top, *size

    def draw_truth(self, image, frame_id, scale, left=0, top=0):
        """A ring round each visible feature, with its number, or a point when the tanker is small; amber: not scored. `image` begins at
        left, top and is `scale` times as large."""
        draw, small = ImageDraw.Draw(image), font(11)
        truth = self.truth.get(frame_id)
        shown_ones = [k for k in range(truth.n if truth else 0) if truth.visible[k] != 0]
        far = bool(shown_ones) and (max(truth.u_px[:truth.n]) - min(truth.u_px[:truth.n])) * scale < 200
        for k in shown_ones:
            x, y = (truth.u_px[k] + .5 - left) * scale, (truth.v_px[k] + .5 - top) * scale
            colour = GREEN if truth.visible[k] == 1 else AMBER
            if far:  # rings and numbers would hide the tanker
                draw.point((x, y), fill=colour)
                continue
            draw.ellipse((x - 3, y - 3, x + 3, y + 3), outline=colour)
            draw.text((x + 4, y - 12), str(truth.id[k]), fill=colour, font=small)


def shown(counts, full=4095):
    """8-bit picture of linear counts, as a screen wants it: gamma 2.2, the same for every flight."""
    table = np.round(255 * (np.arange(full + 1) / full) ** (1 / 2.2)).astype(np.uint8)
    return Image.fromarray(table[np.minimum(counts, full)])
