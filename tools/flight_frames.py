"""Frames and truth of a flight folder for Python tools. Needs the generated types (build/gen/python) on sys.path."""
import os
import struct

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import event_log

GREEN, AMBER = "#48bb78", "#ecc94b"


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

    def draw_truth(self, image, frame_id, scale):
        """A ring round each visible feature, with its number, or a point when the tanker is small; amber: not scored."""
        draw, small = ImageDraw.Draw(image), font(11)
        truth = self.truth.get(frame_id)
        shown_ones = [k for k in range(truth.n if truth else 0) if truth.visible[k] != 0]
        far = not shown_ones or (max(truth.u_px[k] for k in shown_ones) - min(truth.u_px[k] for k in shown_ones)) * scale < 90
        for k in shown_ones:
            x, y = (truth.u_px[k] + .5) * scale, (truth.v_px[k] + .5) * scale
            colour = GREEN if truth.visible[k] == 1 else AMBER
            if far:  # rings and numbers would hide the tanker
                draw.point((x, y), fill=colour)
                continue
            draw.ellipse((x - 4, y - 4, x + 4, y + 4), outline=colour)
            draw.text((x + 5, y - 11), str(truth.id[k]), fill=colour, font=small)


def shown(counts, full=4095):
    """8-bit picture of linear counts, as a screen wants it: gamma 2.2, the same for every flight."""
    table = np.round(255 * (np.arange(full + 1) / full) ** (1 / 2.2)).astype(np.uint8)
    return Image.fromarray(table[np.minimum(counts, full)])
