"""evaluate_tools_test.py BUILD: the arithmetic of `make evaluate`, and its programs on a short flight."""
import csv
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)
sys.path.insert(0, "tools")
import evaluate
import evaluate_goals
import evaluate_learned
import evaluate_merge
import evaluate_metrics
import evaluate_pose
import evaluate_runs
import evaluate_trials
import profile_text

BUILD = sys.argv[1] if len(sys.argv) > 1 else "build"
RIG = {"fx": 1000.0, "fy": 1000.0, "cx": 512.0, "cy": 512.0}


class Folder(unittest.TestCase):
    def test_two_evaluations_do_not_share_one(self):
        with tempfile.TemporaryDirectory() as folder:
            first = evaluate.alone(folder)
            with self.assertRaisesRegex(SystemExit, "another evaluation is at work"):
                evaluate.alone(folder)
            first.close()
            evaluate.alone(folder).close()


class Poses(unittest.TestCase):
    def setUp(self):
        rng = np.random.default_rng(5)
        self.n, self.f = 400, 20
        self.points = rng.uniform(-4, 4, (self.f, 3))
        self.R = np.repeat(evaluate_pose.exponential(np.array([[.1, .4, -.2]])), self.n, 0)
        self.t = np.repeat(np.array([[1.0, -2.0, 25.0]]), self.n, 0)
        self.cov = np.broadcast_to(np.array([[.5, .2], [.2, .3]]), (self.n, self.f, 2, 2))
        self.exact, self.J = evaluate_pose.project(RIG, self.R, self.t, self.points)
        self.pixels = self.exact + rng.standard_normal(self.exact.shape) @ np.linalg.cholesky(self.cov[0, 0]).T
        self.used = np.ones((self.n, self.f), bool)

    def fit(self, **more):
        R, t, information = evaluate_pose.fit(RIG, self.points, self.pixels, self.cov, self.used, self.R, self.t, **more)
        return t - self.t, np.linalg.inv(information)[:, 3:, 3:]

    def test_the_derivative_is_that_of_the_projection(self):
        for k in range(6):
            e = np.zeros((self.n, 6))
            e[:, k] = 1e-6
            moved, _ = evaluate_pose.project(RIG, evaluate_pose.exponential(e[:, :3]) @ self.R, self.t + e[:, 3:], self.points)
            np.testing.assert_allclose((moved - self.exact) / 1e-6, self.J[..., k], rtol=1e-3, atol=1e-2)

    def test_with_honest_covariances_the_error_is_its_bound(self):
        for huber in (None, evaluate_pose.HUBER):
            error, bound = self.fit(huber=huber)
            ratio = (error ** 2).sum(1).mean() / np.trace(bound, axis1=1, axis2=2).mean()
            self.assertAlmostEqual(ratio, 1, delta=.2)

    def test_one_wrong_measurement_a_frame_does_not_carry_it_away(self):
        self.pixels[:, 3] += 40
        plain, bound = self.fit(huber=None)
        robust, _ = self.fit()
        self.assertLess(np.abs(robust).mean(), .2 * np.abs(plain).mean())
        self.assertLess(np.sqrt((robust ** 2).sum(1).mean()), 2 * np.sqrt(np.trace(bound, axis1=1, axis2=2).mean()))

    def test_what_has_no_covariance_is_not_used(self):
        cov = np.array(self.cov)
        cov[:, 0] = np.nan
        self.pixels[:, 0] = np.nan
        self.cov = cov
        error, bound = self.fit()
        self.assertTrue(np.isfinite(error).all() and np.isfinite(bound).all())

    def test_quaternions_and_rotation_vectors_agree(self):
        v = np.array([[.3, -.2, .5], [0, 0, 0]])
        a = np.linalg.norm(v, axis=1)[:, None]
        q = np.concatenate([np.cos(a / 2), v * np.divide(np.sin(a / 2), a, out=np.full_like(a, .5), where=a > 0)], 1)
        np.testing.assert_allclose(evaluate_pose.rotation(q), evaluate_pose.exponential(v), atol=1e-12)


class Figures(unittest.TestCase):
    def test_a_spell_ends_with_a_right_measurement_or_the_track(self):
        t = np.arange(8) * 1.0
        self.assertEqual(evaluate_metrics.wrong_spells(t, [1, 1, 0, 1, 1, 1, 1, 1], [0, 9, 0, 9, 1, 9, 9, 9], [1] * 8), [(1, 3), (5, 7)])
        self.assertEqual(evaluate_metrics.wrong_spells(t, [1, 1, 0, 1, 0, 0, 0, 0], [9, 9, 0, 9, 0, 0, 0, 0], [1, 1, 0, 1, 1, 1, 1, 1]), [(0, 1), (3, 3)])
        self.assertEqual(evaluate_metrics.wrong_spells(t, [1] * 8, [1] * 8, [1] * 8), [])

    def test_the_95_percent_ellipse_holds_95_percent(self):
        rng = np.random.default_rng(1)
        C = np.array([[2.0, .9], [.9, 1.0]])
        x = rng.standard_normal((40000, 2)) @ np.linalg.cholesky(C).T
        d2 = evaluate_metrics.mahalanobis2(x[:, 0], x[:, 1], C[0, 0], C[0, 1], C[1, 1])
        self.assertAlmostEqual((d2 < evaluate_metrics.CHI2_95).mean(), .95, delta=.005)
        self.assertAlmostEqual(d2.mean() / 2, 1, delta=.02)
        self.assertEqual(evaluate_metrics.mahalanobis2(1.0, 1.0, 0.0, 0.0, 1.0), np.inf)

    def test_nothing_measured_is_no_error_of_zero(self):
        self.assertEqual(evaluate_metrics.distribution([]), {"n": 0})
        self.assertIsNone(evaluate_metrics.share(0, 0))

    def test_lock_needs_half_of_the_features_and_must_last(self):
        kind = np.dtype([("frame", "i4"), ("measured", "i1"), ("u", "f8"), ("v", "f8"), ("true_u", "f8"), ("true_v", "f8")])
        rows = np.zeros(4 * 60, kind)
        rows["frame"] = np.repeat(np.arange(60), 4)
        t = np.arange(60) / 30
        rows["measured"][rows["frame"] >= 20] = 1
        rows["measured"][rows["frame"] == 10] = 1  # one frame is no lock
        rows["u"][(rows["frame"] >= 20) & (rows["frame"] < 26)] = 7  # locked to something else
        self.assertAlmostEqual(evaluate_trials.lock_s(t, rows, 0, 60), 26 / 30)
        rows["u"] = 7
        self.assertIsNone(evaluate_trials.lock_s(t, rows, 0, 60))


class Merging(unittest.TestCase):
    def result(self, seed, mean):
        return {"flight": "s1", "condition": "12px-1hz", "profile": "default", "seed": seed, "series": {}, "counts": {"error": [1, seed], "features": {str(seed): {"visible": [1]}}},
                "scalars": {"measurements_a_frame": 20 + seed, "error_px": {"n": 9, "mean": mean} if mean is not None else {"n": 0}, "list": [1, 2]}}

    def test_means_are_over_the_seeds_that_have_the_figure(self):
        g = evaluate_merge.groups([self.result(2, 3.0), self.result(1, 1.0), self.result(3, None)])["s1", "12px-1hz", "default"]
        self.assertEqual((g["runs"], g["seeds"], g["mean"]["error_px.mean"], g["worst"]["error_px.mean"], g["worst"]["measurements_a_frame"]), (3, [1, 2, 3], 2.0, 3.0, 21))
        self.assertEqual(g["counts"], {"error": [3, 6], "features": {"1": {"visible": [1]}, "2": {"visible": [1]}, "3": {"visible": [1]}}})

    def test_a_goal_needs_a_figure_and_enough_measurements(self):
        test = evaluate_goals.below(1.0)
        self.assertTrue(evaluate_goals.line("x", "s1", .9, test)["met"])
        self.assertFalse(evaluate_goals.line("x", "s1", 1.1, test)["met"])
        self.assertFalse(evaluate_goals.line("x", "s1", None, test)["met"])
        self.assertFalse(evaluate_goals.line("x", "s1", .1, test, a_frame=3)["met"])
        self.assertFalse(evaluate_goals.line("x", "s1", .99, evaluate_goals.between(.93, .97))["met"])

    def test_never_flagged_is_the_worst(self):
        one = {"trial": "frozen link", "flagged_s": .5, "flagged_before": 0, "wrong": 1, "measured": 100, "hidden": 0}
        plain = {**one, "trial": "undisturbed", "wrong": 0}
        m = evaluate_trials.merged([one, {**one, "flagged_s": None}, plain])
        self.assertEqual((m["frozen link"]["flagged_s_worst"], m["frozen link"]["flagged_s_never"], m["frozen link"]["wrong_more"]), (14.0, 1, .01))


class Settings(unittest.TestCase):
    def test_seeds_are_read_as_ranges(self):
        self.assertEqual(evaluate.numbers("1-3,7"), [1, 2, 3, 7])

    def test_a_key_that_is_missing_or_double_is_an_error(self):
        self.assertEqual(profile_text.changed("a = 1 # x\nb = 2\n", {"a": "7"}, "p"), "a = 7 # x\nb = 2\n")
        for text in ("b = 2\n", "a = 1\na = 2\n"):
            with self.assertRaises(SystemExit):
                profile_text.changed(text, {"a": "7"}, "p")

    def test_navigation_at_1_hz_is_a_number_of_frames(self):
        self.assertIn("update_every_n_frames = 30", evaluate_runs.profile_for("default", "s1", "12px-1hz", evaluate_runs.frame_rate("s1")))
        self.assertIn("update_every_n_frames = 5", evaluate_runs.profile_for("default", "block0", "12px-1hz", evaluate_runs.frame_rate("block0")))
        self.assertIn("gate_px = 16.0", evaluate_runs.profile_for("thesis-2007", "s3", "12px-1hz", 30))
        self.assertIn("gate_px = 6.0", evaluate_runs.profile_for("thesis-2007", "s1", "true-1hz", 30))


class LearnedModels(unittest.TestCase):
    def test_no_picture_that_was_learnt_from_is_scored(self):
        for row, model, flight, first in evaluate_learned.TRIED:
            for folder, part in map(evaluate_learned.split, evaluate_learned.MODELS[model]):
                rate = 30 if evaluate_learned.recorded(flight) else evaluate_runs.frame_rate(flight)
                if folder == flight:
                    self.assertLess(float(part.split("-")[1]) * rate, first, row)

    def test_what_is_learnt_from_has_no_seed_of_the_report(self):
        self.assertIn(evaluate_learned.SEED, range(1, 21))

    def test_rows_go_with_their_flights(self):
        rows = lambda *a: [t[0] for t in evaluate_learned.wanted(*a)]
        self.assertEqual(rows(["s2", "s3"], []), ["s2-learned"])
        self.assertEqual(rows([], ["build/cube_6px.flight/"]), ["cube_6px-learned"])

    def test_the_goals_have_rows(self):
        there = {(row, evaluate_learned.CONDITION) for row, *_ in evaluate_learned.TRIED}
        for what, flight, condition, *_ in evaluate_goals.goals():
            if what.startswith("learned"):
                self.assertIn((flight, condition), there)


class Programs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory()
        cls.flight = cls.call("flight", "--scenario", "config/scenarios/embedded.toml", "--frames", "20", "--cache", cls.path("cache"), "--quiet", "--out", cls.path("one"))

    @classmethod
    def tearDownClass(cls):
        cls.work.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.work.name, name)

    @classmethod
    def call(cls, program, *arguments):
        subprocess.run([f"{BUILD}/bin/cyclops-{program}", *arguments], check=True, stdout=subprocess.DEVNULL)

    def tables(self, flight):
        self.call("evaluate", self.path(flight), "--config", "config/default.toml", "--out", self.path(flight + "-tables"))
        return evaluate_metrics.load(self.path(flight + "-tables"))

    def test_tables_say_what_the_scores_say(self):
        features, frames, rig = self.tables("one")
        self.call("offline", self.path("one"), "--config", "config/default.toml", "--scores", self.path("scores.csv"), "--quiet")
        with open(self.path("scores.csv"), newline="") as file:
            scores = list(csv.DictReader(file))
        self.assertEqual((len(features), len(frames)), (len(scores), 20))
        for name, column in (("id", "id"), ("truth", "truth"), ("measured", "measured"), ("true_u", "true_u"), ("track_state", "track_state")):
            np.testing.assert_allclose(features[name], [float(s[column]) for s in scores], atol=1e-4)
        m = features["measured"] > 0
        self.assertGreater(m.sum(), 100)
        np.testing.assert_allclose(features["v"][m], [float(s["v"]) for s, k in zip(scores, m) if k], atol=1e-3)
        found = evaluate_metrics.figures(features, frames, rig)
        self.assertGreater(found["scalars"]["position"]["frames"], 10)
        self.assertLess(found["scalars"]["error_px"]["median"], 2)

    def test_a_learnt_feature_is_where_the_true_pose_puts_it(self):
        # GIVEN a model whose learnt points are the surveyed ones under other ids, frames scored from the sixth on
        with open(self.path("one/tanker.csv"), newline="") as file:
            lines = list(csv.DictReader(line for line in file if not line.startswith("#")))
        axes = [k for k in lines[0] if k.split("_")[0] in "xyz"]
        with open(self.path("learnt.csv"), "w") as file:
            file.write("id,x,y,z,kind,enabled\n")
            for r in lines:
                place = ",".join(r[k] for k in axes)
                file.write(f"{r['id']},{place},corner,0\n{int(r['id']) + 1000},{place},learnt,1\n")
        self.call("evaluate", self.path("one"), "--out", self.path("learnt"), "--tanker", self.path("learnt.csv"), "--from", "5")
        rows, frames, rig = evaluate_metrics.load(self.path("learnt"))
        self.assertEqual((len(frames), rig["first_frame"]), (15, 5))
        plain = self.tables("one")[0]
        place = {(r["frame"] - 5, r["id"] + 1000): r for r in plain}
        learnt = rows[rows["id"] > 1000]
        self.assertGreater(len(learnt), 15 * 25)
        for name in ("true_u", "true_v", "true_ideal_u", "true_ideal_v"):
            np.testing.assert_allclose(learnt[name], [place[r["frame"], r["id"]][name] for r in learnt], atol=.05)
        found = evaluate_metrics.figures(rows, frames, rig)["scalars"]
        self.assertGreater(found["measurements_a_frame"], 15)
        self.assertLess(found["error_px"]["median"], 2)

    def test_a_step_moves_what_navigation_says_from_its_time_on(self):
        self.call("disturb", self.path("one"), "--out", self.path("step"), "--at", "0.3", "--position", "2", "--seed", "4")
        plain, stepped = self.tables("one")[0], self.tables("step")[0]
        moved = np.hypot(stepped["predicted_u"] - plain["predicted_u"], stepped["predicted_v"] - plain["predicted_v"])
        self.assertLess(np.nanmax(moved[plain["frame"] < 8]), 1e-3)
        self.assertGreater(np.nanmin(moved[(plain["frame"] >= 11) & (plain["truth"] == 1)]), 3)
        self.assertTrue(os.path.samefile(self.path("one/frames.lcm"), self.path("step/frames.lcm")))

    def test_an_occluded_camera_sees_nothing(self):
        self.call("disturb", self.path("one"), "--out", self.path("dark"), "--occlude", "10", "14", "--last-frame", "16")
        features, frames, _ = self.tables("dark")
        self.assertEqual(len(frames), 16)
        dark = (features["frame"] >= 9) & (features["frame"] <= 13)
        self.assertEqual(features["truth"][dark].max(), 0)
        self.assertEqual(features["measured"][dark].sum(), 0)
        self.assertGreater(features["measured"][~dark].sum(), 50)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
