"""flights_tools_test.py BUILD: the Python tools about flights: histogram modes, the standard set, hashes, the thesis' profiles."""
import os
import sys
import tempfile
import types
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)
sys.path.insert(0, "tools")
import flight_frames
import flights
import flights_page
import thesis_table


class Modes(unittest.TestCase):
    def test_two_humps_are_two_and_noise_on_one_is_not(self):
        self.assertEqual(flights_page.modes([0, 10, 100, 30, 10, 12, 30, 60, 80, 50, 20, 5, 0, 0]), [2, 8])
        self.assertEqual(flights_page.modes([0, 10, 60, 100, 95, 99, 70, 30, 5, 0, 0]), [4])

    def test_a_small_hump_far_out_does_not_stand_out(self):
        self.assertEqual(flights_page.modes([0, 50, 100, 50, 0, 0, 0, 5, 9, 5, 0]), [2])


class StandardSet(unittest.TestCase):
    def test_holds_every_scenario_and_the_true_ones_of_the_thesis(self):
        names = {name: (scenario, options) for name, scenario, options in flights.standard_set()}
        for file in os.listdir("config/scenarios"):
            if file != "base.toml":
                self.assertIn(file[:-5], names)
        self.assertEqual(names["s1-true"], ("s1", ["--navigation", "true"]))
        for flight, _, _, _ in thesis_table.RUNS.values():
            self.assertIn(flight, names)

    def test_a_flight_depends_on_all_its_bases(self):
        self.assertEqual([os.path.basename(p) for p in flights.inputs("s1-50.toml")], ["s1-50.toml", "s1.toml", "base.toml"])


class Looking(unittest.TestCase):
    def about(self, points):
        flight = object.__new__(flight_frames.Flight)
        flight.truth = {1: types.SimpleNamespace(n=len(points), u_px=[p[0] for p in points], v_px=[p[1] for p in points])}
        return flight.about_tanker(1, 1024, 1024)

    def test_a_picture_with_truth_holds_every_feature_and_stays_in_the_frame(self):
        for points in ([(300, 400), (700, 450)], [(500, 20), (560, 900)], [(5, 5), (30, 12)], [(900, 1000), (1500, 1010)]):
            left, top, width, height = self.about(points)
            self.assertAlmostEqual(width, 1.5 * height)
            self.assertTrue(left >= 0 and top >= 0 and left + width <= 1024.001 and top + height <= 1024.001, (points, left, top, width))
            if max(v for _, v in points) - min(v for _, v in points) < 1024 / 1.5:
                for u, v in points:
                    self.assertTrue(left <= min(u, 1024) <= left + width and top <= v <= top + height, (points, left, top, width))

    def test_without_features_it_is_as_wide_as_the_frame(self):
        self.assertEqual(self.about([])[2], 1024)
        self.assertEqual(self.about([(9000, 9000)])[2], 1024)


class Hashes(unittest.TestCase):
    def test_a_file_that_changed_has_another_digest(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "x")
            with open(path, "w") as file:
                file.write("one")
            first = flights.digest(path)
            with open(path, "w") as file:
                file.write("two")
            os.utime(path, ns=(1, 1))
            self.assertNotEqual(first, flights.digest(path))


class Profiles(unittest.TestCase):
    def test_change_what_they_are_asked_to_and_nothing_else(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "p.toml")
            thesis_table.profile(path, "alpha-beta", (.9, .25), 9)
            with open(path) as ours, open(thesis_table.PROFILE) as theirs:
                changed = [a.split("#")[0].strip() for a, b in zip(ours, theirs) if a != b]
            self.assertEqual(changed, ["gate_px = 9.0", 'filter = "alpha-beta"', "alpha = 0.9", "beta = 0.25"])

    def test_a_key_that_is_missing_is_an_error(self):
        saved, thesis_table.PROFILE = thesis_table.PROFILE, "config/scenarios/base.toml"
        try:
            with self.assertRaises(SystemExit):
                thesis_table.profile("/dev/null", "zoh", None, 6)
        finally:
            thesis_table.PROFILE = saved


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
