"""fault_judge_test.py BUILD: what the judges of `make faults` and `make soak` conclude from runs that are made up."""
import os
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
os.chdir(ROOT)
sys.path.insert(0, "tools")
import fault_judge
import faults
import soak
import soak_balance
from fault_judge import Frame, Run

PERIOD_NS = 33_333_333
LIMIT = {"noticed_s": 1, "recovered_s": 1, "lost_percent": 10, "wrong_percent": 0.1, "wrong_times": 0, "unaccounted": 0, "harmless_percent": 5}


def frames(n, bad=()):
    return [Frame(i, i * PERIOD_NS, 0, published=True, accepted=0 if i in bad else 30, time_source=0) for i in range(n)]


def run_of(sent, **service):
    s = {"frames_complete": len(sent), "frames_incomplete": 0, "frames_lost_by_cause": {"gap": 0, "leader": 0, "rows_unknown": 0, "queue_full": 0, "no_room": 0},
         "frames_in_chain": len(sent)} | service
    return Run(sent, [], [], s, {"faults": []}, numbered=sent)


class Recovery(unittest.TestCase):
    usual = {i: 30 for i in range(200)}

    def test_is_the_first_frame_from_which_nearly_all_are_healthy(self):
        run = run_of(frames(200, bad=range(60, 100)))
        self.assertAlmostEqual(fault_judge.recovery_s(run, self.usual, 90 * PERIOD_NS), 10 * PERIOD_NS * 1e-9, places=6)

    def test_never_comes_when_frames_stay_on_another_clock(self):
        run = run_of(frames(200))
        for f in run.frames[60:]:
            f.time_source = 2
        self.assertIsNone(fault_judge.recovery_s(run, self.usual, 90 * PERIOD_NS))


class Times(unittest.TestCase):
    def test_an_error_beyond_what_is_stated_is_wrong_and_one_within_is_not(self):
        self.assertTrue(Frame(1, 0, 0, published=True, time_source=0, time_error_ns=1e6, time_sigma_ns=5e4).time_is_wrong)
        self.assertFalse(Frame(1, 0, 0, published=True, time_source=2, time_error_ns=1e7, time_sigma_ns=5e6).time_is_wrong)


class Accounts(unittest.TestCase):
    def test_a_frame_in_no_counter_is_found(self):
        run = run_of(frames(100), frames_complete=99)
        self.assertEqual(fault_judge.unaccounted(run), 1)
        self.assertEqual(soak_balance.frames(run)["left over"], 1)

    def test_frames_sent_while_a_stream_was_opened_are_between_streams(self):
        sent = frames(100)
        for f in sent[:5] + sent[97:]:
            f.published = False
        run = run_of(sent, frames_complete=92)
        self.assertEqual(fault_judge.between_streams(run), 8)
        self.assertEqual(fault_judge.unaccounted(run), 0)

    def test_floods_count_as_sent(self):
        run = run_of([])
        run.service["tspi"] = {"tanker": {"received": 140, "refused": 50, "guarded": 0, "accepted": 84, "duplicate": 6, "too_old": 0, "held_back": 0, "jumps": 0}}
        run.replay = {"channels": {"TSPI_TANKER": {"sent": 100}}, "faults": [{"kind": "flood", "text": "TSPI_TANKER", "struck": 50}]}
        t = soak_balance.tspi(run, "tanker")
        self.assertEqual((t["sent"], t["lost on the link"], t["left over"]), (150, 10, 0))


class Memory(unittest.TestCase):
    def test_a_leak_is_told_from_noise(self):
        def samples(kb_per_s):
            return [{"t": t, "rss_kb": 500_000 + kb_per_s * t + (t * 7919 % 13) * 20} for t in range(400)]
        self.assertGreater(soak_balance.slope(samples(10), "rss_kb")["low"], soak_balance.FLAT_KB_PER_MIN)
        self.assertLess(abs(soak_balance.slope(samples(0), "rss_kb")["kb_per_min"]), soak_balance.FLAT_KB_PER_MIN)


class Verdict(unittest.TestCase):
    good = {"crashed": "", "struck": 3, "measurements_lost_percent": 1.0, "wrong_times": 0, "frames_other_clock": 0, "noticed": {"camera.lost": 0.5}, "recovered_s": 0.2,
            "wrong": 0, "wrong_without_fault": 0, "measurements": 5000, "frames_unaccounted": 0, "alarms_at_end": []}
    row = {"name": "x", "notice": ["camera.lost"], "limit": LIMIT}

    def test_passes_what_is_within_its_limits(self):
        self.assertEqual(faults.verdict(self.row, self.good, False), [])

    def test_fails_a_row_for_each_thing_that_is_not(self):
        for change in ({"noticed": {}}, {"noticed": {"camera.lost": 1.5}}, {"recovered_s": None}, {"recovered_s": 1.4}, {"measurements_lost_percent": 11}, {"wrong": 9},
                       {"wrong_times": 1}, {"frames_unaccounted": -1}, {"alarms_at_end": ["camera is silent"]}, {"crashed": "rig ended with 1"}, {"struck": 0}):
            self.assertEqual(len(faults.verdict(self.row, self.good | change, False)), 1, change)


class Script(unittest.TestCase):
    def test_of_a_seed_is_always_the_same_and_leaves_calm_at_both_ends(self):
        text = soak.draw_script(180, 3)
        self.assertEqual(text, soak.draw_script(180, 3))
        self.assertNotEqual(text, soak.draw_script(180, 4))
        onsets = [float(line.split("=")[1]) for line in text.splitlines() if line.startswith("onset_s")]
        self.assertTrue(len(onsets) > 30 and min(onsets) >= soak.CALM_S and max(onsets) <= 180 - soak.CALM_S)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
