"""aspn_test.py BUILD: measurements under the names of ASPN-23; directions as docs/icd.md defines Z(t)."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)
sys.path[:0] = ["tools", "build/gen/python"]
import cyclops  # noqa: E402
import event_log  # noqa: E402

PITCH, FX, FY, CX, CY = 12e-6, 1041.6667, 1041.6667, 511.5, 511.5


def item(number, u, v, accepted=True):
    m = cyclops.measurement_t()
    m.id, m.accepted, m.ideal_px, m.raw_px, m.cov_px2 = number, accepted, [u, v], [u + 3, v], [0.25, 0.05, 0.16]
    m.z_m = [(CX - u) * PITCH, (CY - v) * PITCH]
    return m


def frame(seq, gps_ns, items):
    m = cyclops.measurement_set_t()
    m.seq, m.mid_exposure_ns, m.mid_exposure_gps_ns, m.items, m.n = seq, seq, gps_ns, items, len(items)
    return m


class Exported(unittest.TestCase):
    def export(self, frames, camera):
        with tempfile.TemporaryDirectory() as folder:
            event_log.write(f"{folder}/published.lcm", [(i, "MEASUREMENT", f.encode()) for i, f in enumerate(frames)])
            with open(f"{folder}/rig.toml", "w") as file:
                file.write(f"[camera]\ncx_px = {CX}\ncy_px = {CY}\n{camera}\n")
            done = subprocess.run([sys.executable, "tools/export_aspn.py", folder, "--out", f"{folder}/out", "--device", "0x10"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(f"{folder}/out") as file:
                return [json.loads(text) for text in file], done.stdout

    def test_directions_are_those_of_z(self):
        items = [item(2, 529.7, 511.5), item(15, 816.7, 613.75), item(3, 1, 2, accepted=False)]
        for camera in (f"fx_px = {FX}\nfy_px = {FY}", "focal_mm = 12.5000004\npitch_um = 12.0"):
            lines, _ = self.export([frame(1, 1_400_000_000_123_456_789, items)], camera)
            self.assertEqual(lines[0]["time_of_validity"]["elapsed_nsec"], 1_400_000_000_123_456_789)
            self.assertEqual((lines[0]["num_obs"], [o["remote_point"]["id"] for o in lines[0]["obs"]]), (2, [2, 15]))
            f = FX * PITCH
            for o, i in zip(lines[0]["obs"], items):
                self.assertAlmostEqual(o["obs"][0], -i.z_m[0] / f, places=9)
                self.assertAlmostEqual(o["obs"][1], -i.z_m[1] / f, places=9)
                self.assertEqual(o["covariance"][1], o["covariance"][2])
                self.assertAlmostEqual(o["covariance"][0] * FX**2, 0.25, places=6)
                self.assertAlmostEqual(o["covariance"][3] * FY**2, 0.16, places=6)

    def test_frames_are_numbered_without_gaps_and_need_gps_time(self):
        lines, said = self.export([frame(1, 0, []), frame(2, 10, []), frame(5, 20, [item(1, 5, 6)])], "fx_px = 1\nfy_px = 1")
        self.assertEqual([(t["header"]["sequence_id"], t["header"]["device_id"], t["num_obs"]) for t in lines], [(0, 16, 0), (1, 16, 1)])
        self.assertIn("1 without GPS time", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
