"""judge.py OUT: did the machine of `make gpio` do what it should? Prints the service's figures; exit 1 when not."""
import json
import pathlib
import sys

out = pathlib.Path(sys.argv[1])
wrong = []


def expect(true, what):
    if not true:
        wrong.append(what)


def number(name):
    path = out / name
    return int(path.read_text()) if path.exists() else -1


expect(number("tests.rc") == 0, "the tests on the lines failed, see tests.txt")
expect(number("service.rc") == 0, "service or replayer failed, see service.txt")
try:
    service, replay = json.loads((out / "service.json").read_text()), json.loads((out / "replay.json").read_text())
except OSError as e:
    sys.exit(f"gpio: FAILED: {e}")
time = service["time"]
frames = service["frames_in_chain"]
print(f"gpio: service: {frames} of {replay['frames_served']} frames; by strobe {time['by_strobe']}, camera clock {time['by_camera_tick']}, arrival {time['by_arrival']}; "
      f"{time['edges']} of {replay['gpio_pulses']} edges, lost {time['edges_lost']}; PPS {time['pps_edges']} of {replay['gpio_pps_pulses']}, marks {time['pps_marks']}; "
      f"scatter of edges {time['edge_scatter_us']:.1f} us, camera clock {time['camera_drift_ppm']:+.1f} ppm, GPS {time['gps_drift_ppm']:+.1f} ppm, sigma {time['gps_sigma_us']:.0f} us; "
      f"replayer late by {replay['max_late_ms']:.1f} ms at most")
expect(time["edges"] == replay["gpio_pulses"] > 0, "not every pulse came as an edge")
expect(time["edges_lost"] == 0, "edges were lost")
expect(time["pps_edges"] == replay["gpio_pps_pulses"] > 0, "not every PPS pulse came")
expect(time["pps_marks"] > 0, "PPS gave no time mark")
expect(frames >= 0.8 * replay["frames_served"], "frames were lost")
expect(time["by_strobe"] >= 0.8 * frames, "most frames should be timed by the strobe")
for w in wrong:
    print("gpio: FAILED:", w)
sys.exit(1 if wrong else 0)
