"""mcap_test.py BUILD: a sortie that is made up, exported to MCAP and read back by the library itself. Skipped without it (make mcap)."""
import base64
import io
import json
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)
VENV = "build/mcap/bin/python"
try:
    from mcap.reader import make_reader
except ImportError:
    if not os.path.exists(VENV) or os.environ.get("CYCLOPS_MCAP_TRIED"):
        print("skipped: no MCAP library; make mcap gets it")
        sys.exit(0)
    os.environ["CYCLOPS_MCAP_TRIED"] = "yes"
    os.execv(VENV, [VENV, *sys.argv])

sys.path[:0] = ["tools", "build/gen/python"]
import cyclops  # noqa: E402
import event_log  # noqa: E402
import lcm_schema  # noqa: E402
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

SECOND = 10**9
JPEG = b"\xff\xd8 not really \xff\xd9"
WIDTH, HEIGHT = 6, 4
COUNTS = (np.arange(WIDTH * HEIGHT).reshape(HEIGHT, WIDTH) * 170).astype("<u2")


def made(name, **values):
    m = getattr(cyclops, name)()
    for key, value in values.items():
        setattr(m, key, value)
    return m.encode()


def measurement(seq):
    item = cyclops.measurement_t()
    item.id, item.accepted, item.nis, item.raw_px = 7, True, float("nan"), [1.5, 2.5]
    return made("measurement_set_t", seq=seq, mid_exposure_ns=seq * SECOND, mid_exposure_gps_ns=1_400_000_000_123_456_789, accepted=1, n=1, items=[item])


def write_sortie(folder):
    event_log.write(f"{folder}/messages.lcm", [(10, "TSPI_TANKER", made("tspi_t", seq=3)), (20, "STROBE", made("strobe_edge_t")),
                                               (30, "FRAME", made("frame_index_t", camera_frame_id=1, thumbnail_jpeg=b"")), (40, "EVENT", made("event_t"))])
    event_log.write(f"{folder}/published.lcm", [(1_000_000 * i + 100, "MEASUREMENT", measurement(i)) for i in range(1, 6)] +
                    [(1_000_100, "FRAME", made("frame_index_t", seq=1, camera_frame_id=1, mid_exposure_ns=SECOND, thumbnail_bytes=len(JPEG), thumbnail_jpeg=JPEG)),
                     (2_000_000, "HEALTH", made("health_t", number=1, alarm_line="camera is silent")), (2_000_001, "EVENT", made("event_t", code="mark", level=4)),
                     (3_000_000, "HEALTH", b"not a message"), (4_000_000, "SEAL", b"not exported")])
    event_log.write(f"{folder}/frames.lcm", [(1_000_200, "FRAME_DATA", made("frame_data_t", camera_frame_id=1, pixel_format=2, width_px=WIDTH, height_px=HEIGHT, missing_row_mask=b"",
                                                                               size_bytes=COUNTS.nbytes, pixels=COUNTS.tobytes()))])
    with open(f"{folder}/rig.toml", "w") as file:
        file.write("# rig\n")


class Exported(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            write_sortie(folder)
            cls.said = subprocess.run([sys.executable, "tools/export_mcap.py", folder, "--out", f"{folder}/out.mcap", "--frames", "png"], capture_output=True, text=True)
            cls.again = subprocess.run([sys.executable, "tools/export_mcap.py", folder, "--out", f"{folder}/out.mcap"], capture_output=True, text=True)
            with open(f"{folder}/out.mcap", "rb") as file:
                cls.data = file.read()

    def messages(self, topic):
        return [(s, m, json.loads(m.data)) for s, _, m in make_reader(io.BytesIO(self.data)).iter_messages(topics=[topic])]

    def test_every_message_is_there_once(self):
        summary = make_reader(io.BytesIO(self.data)).get_summary()
        counts = {c.topic: summary.statistics.channel_message_counts[i] for i, c in summary.channels.items()}
        self.assertEqual(counts, {"TSPI_TANKER": 1, "MEASUREMENT": 5, "FRAME": 1, "THUMBNAIL": 1, "HEALTH": 1, "EVENT": 1, "IMAGE": 1})
        self.assertEqual(self.said.returncode, 0, self.said.stderr)
        self.assertIn("1 messages could not be read", self.said.stdout)

    def test_values_are_those_of_the_messages(self):
        schema, message, value = self.messages("MEASUREMENT")[2]
        self.assertEqual((message.log_time, message.publish_time), (3_000_100_000, 3 * SECOND))
        self.assertEqual((value["seq"], value["mid_exposure_gps_ns"]), (3, 1_400_000_000_123_456_789))
        self.assertEqual(value["items"][0]["raw_px"], [1.5, 2.5])
        self.assertIs(value["items"][0]["accepted"], True)
        self.assertIsNone(value["items"][0]["nis"])
        self.assertEqual(schema.encoding, "jsonschema")
        self.assertEqual(self.messages("EVENT")[0][2]["code"], "mark")

    def test_schemas_name_every_field_with_its_unit(self):
        schema = json.loads(self.messages("MEASUREMENT")[0][0].data)
        item = schema["properties"]["items"]["items"]["properties"]
        self.assertEqual(item["z_m"]["maxItems"], 2)
        self.assertIn("px^2", item["cov_px2"]["description"])
        for path in sorted(os.listdir("lcmtypes")):
            if path.endswith(".lcm"):
                name = path[:-4]
                self.assertEqual([f[1] for f in lcm_schema.fields(f"lcmtypes/{path}")], getattr(cyclops, name).__slots__, path)

    def test_pictures_are_what_was_recorded(self):
        _, message, thumbnail = self.messages("THUMBNAIL")[0]
        self.assertEqual((base64.b64decode(thumbnail["data"]), thumbnail["format"], thumbnail["timestamp"]), (JPEG, "jpeg", {"sec": 1, "nsec": 0}))
        _, message, picture = self.messages("IMAGE")[0]
        self.assertEqual(message.publish_time, SECOND)
        np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(base64.b64decode(picture["data"])))), COUNTS)

    def test_the_rig_goes_with_it_and_nothing_is_written_over(self):
        self.assertEqual([(a.name, a.data) for a in make_reader(io.BytesIO(self.data)).iter_attachments()], [("rig.toml", b"# rig\n")])
        self.assertNotEqual(self.again.returncode, 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
