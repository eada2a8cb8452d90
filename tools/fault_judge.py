"""What a run of the whole rig with faults shows, measured on its logs: noticed by what and when, recovered when, lost, wrong.

Times are CLOCK_MONOTONIC of the host that ran it: HEALTH carries it, EVENT is put on it by when it was logged, SENT has it for every
frame. What the service says
about a frame is tied to what is true of it by block id and camera tick, so a wrong number or time of the service cannot hide.
"""
import csv
import json
import math
import os
import sys
from dataclasses import dataclass, field

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import event_log

WRONG_PX = 5.0         # as cyclops-score: further off than this, or nearer to another feature
HEALTHY_SHARE = 0.5    # of the measurements that the run without faults has of the same picture
WINDOW = 15            # frames, of which all but ONE_OFF are healthy: recovered
ONE_OFF = 1
TIME_SIGMAS, TIME_FLOOR_NS = 5, 200_000  # a mid-exposure time further off than both together is wrong
ALARM_TAIL_NS = 600_000_000


@dataclass
class Frame:
    """One frame that the camera sent."""
    flight_id: int
    host_ns: int
    shift_ns: int
    acquisition: int = 1
    sent: bool = True      # whole
    published: bool = False
    accepted: int = 0
    wrong: int = 0
    time_source: int = 3
    time_error_ns: float = 0.0
    time_sigma_ns: float = 0.0

    @property
    def time_is_wrong(self):
        return self.published and self.time_source != 3 and abs(self.time_error_ns) > TIME_SIGMAS * self.time_sigma_ns + TIME_FLOOR_NS


@dataclass
class Run:
    frames: list
    health: list
    events: list
    service: dict
    replay: dict
    crashed: str = ""
    numbered: list = field(default_factory=list)  # every frame that the camera has numbered, sent or not
    counters: dict = field(default_factory=dict)  # name: [(t_ns, value)]


def truth_of(flight, types):
    out = {}
    for _, _, channel, payload in event_log.events(os.path.join(flight, "messages.lcm")):
        if channel == "TRUTH":
            t = types.truth_t.decode(payload)
            out[t.camera_frame_id] = t
    return out


def wrong_ones(measurement, truth):
    n = 0
    seen = {i: (truth.u_px[k], truth.v_px[k], truth.visible[k]) for k, i in enumerate(truth.id)}
    for z in measurement.items:
        if not z.accepted or z.id not in seen or seen[z.id][2] == 2:
            continue
        u, v = z.raw_px
        error = math.hypot(u - seen[z.id][0], v - seen[z.id][1])
        other = min((math.hypot(u - x[0], v - x[1]) for i, x in seen.items() if i != z.id and x[2] == 1), default=1e9)
        n += error > WRONG_PX or other < error
    return n


def load(out, truth, types):
    """The run in folder OUT."""
    frames = {}
    with open(os.path.join(out, "sent.csv"), newline="") as file:
        for row in csv.DictReader(file):
            frames[int(row["block_id"]), int(row["tick_ns"])] = Frame(int(row["flight_id"]), int(row["host_ns"]), int(row["shift_ns"]), int(row["acquisition"]), row["sent"] == "1")
    run = Run([], [], [], read_json(out, "service.json"), read_json(out, "replay.json"))
    by_seq = {}
    logged, lead_ns = [], 1 << 62  # of the logger's clock before the host's monotonic one
    for _, time_us, channel, payload in event_log.events(os.path.join(out, "live.lcm")):
        if channel == "FRAME":
            m = types.frame_index_t.decode(payload)
            frame = frames.get((m.camera_frame_id, m.camera_tick_ns))
            if frame is None:
                continue
            by_seq[m.seq] = frame
            frame.published = True
            frame.time_source = m.time_source
            frame.time_sigma_ns = m.mid_exposure_sigma_ns
            if frame.flight_id in truth:
                frame.time_error_ns = m.mid_exposure_ns - truth[frame.flight_id].mid_exposure_ns - frame.shift_ns
        elif channel == "MEASUREMENT":
            m = types.measurement_set_t.decode(payload)
            frame = by_seq.get(m.seq)
            if frame is not None:
                frame.accepted = m.accepted
                frame.wrong = wrong_ones(m, truth[frame.flight_id]) if frame.flight_id in truth else 0
        elif channel == "HEALTH":
            m = types.health_t.decode(payload)
            run.health.append(m)
            lead_ns = min(lead_ns, time_us * 1000 - m.service_time_ns)
            for c in m.counters:
                run.counters.setdefault(c.name, []).append((m.service_time_ns, c.value))
        elif channel == "EVENT":
            logged.append((time_us * 1000, types.event_t.decode(payload)))
    # An event's own time may be that of a mark, on the flight's clock: when it was heard is what counts here.
    for heard_ns, e in logged:
        e.service_time_ns = heard_ns - lead_ns
        run.events.append(e)
    # A frame that was cut because the camera vanished on the way may still have been seen in part.
    run.numbered = sorted(frames.values(), key=lambda f: f.host_ns)
    run.frames = [f for f in run.numbered if f.sent or f.published]
    return run


def read_json(folder, name):
    try:
        with open(os.path.join(folder, name)) as file:
            return json.load(file)
    except (OSError, ValueError):
        return {}


def growth(run, name, begin_ns=0, end_ns=1 << 62):
    values = [v for t, v in run.counters.get(name, []) if begin_ns <= t <= end_ns]
    before = [v for t, v in run.counters.get(name, []) if t < begin_ns]
    return (values[-1] if values else 0) - (before[-1] if before else values[0] if values else 0)


def alarms_of(health):
    """Their texts, whether an alarm is a text or has one."""
    return [getattr(a, "text", a) for a in health.alarms]


def when_sent(run, flight_id):
    return next((f.host_ns for f in run.frames if f.flight_id >= flight_id), 1 << 62)


def notices(run, reference, begin_ns, end_ns):
    """Everything that told of trouble between the two times: {name: ns of the first}. A counter tells when it has grown by more
    than it grew in the run without faults from the same picture to the end."""
    out = {}
    begin_id = next((f.flight_id for f in run.frames if f.host_ns >= begin_ns), 0)
    reference_ns = when_sent(reference, begin_id) if reference else 0
    for e in run.events:
        if begin_ns <= e.service_time_ns <= end_ns and e.level in (0, 1, 2) and e.code != "camera.started":
            out.setdefault(e.code if not e.source.startswith("tspi.") else f"{e.source}: {e.code}", e.service_time_ns)
    for h in run.health:
        if begin_ns <= h.service_time_ns <= end_ns:
            for a in alarms_of(h):
                out.setdefault(a, h.service_time_ns)
    for name, series in run.counters.items():
        if name in ("capture.complete", "time.edges", "chain.consensus", "capture.starts", "record.frames", "record.inputs", "record.published", "record.frame_megabytes") or name.endswith(".received"):
            continue
        before = [v for t, v in series if t < begin_ns]
        base = before[-1] if before else 0
        usual = growth(reference, name, reference_ns, reference.frames[-1].host_ns) if reference else 0
        first = next((t for t, v in series if begin_ns <= t <= end_ns and v - base > usual), None)
        if first is not None:
            out.setdefault(name, first)
    return out


def recovery_s(run, usual, until_ns):
    """From the end of the fault to the first of WINDOW frames in a row that are healthy; None: never."""
    good = [f.published and f.time_source == 0 and f.accepted >= HEALTHY_SHARE * usual.get(f.flight_id, 0) for f in run.frames]
    for i in range(len(good) - WINDOW + 1):
        if run.frames[i].host_ns >= until_ns and good[i] and sum(good[i:i + WINDOW]) >= WINDOW - ONE_OFF:
            return max(0.0, (run.frames[i].host_ns - until_ns) * 1e-9)
    return None


def alarms_at_end(run):
    """Alarms that were still there while the last frames came."""
    if not run.frames:
        return ["no frame was sent"]
    end = run.frames[-1].host_ns
    last = [h for h in run.health if end - ALARM_TAIL_NS <= h.service_time_ns <= end]
    return alarms_of(last[-1]) if last else ["no HEALTH"]


def between_streams(run):
    """Frames that were numbered before the first or after the last that the service had of that stream: it was being opened, or had
    been given up."""
    by_stream = {}
    for f in run.numbered:
        by_stream.setdefault(f.acquisition, []).append(f)
    n = 0
    for stream in by_stream.values():
        seen = [i for i, f in enumerate(stream) if f.published]
        n += len(stream) if not seen else seen[0] + len(stream) - 1 - seen[-1]
    return n


def unaccounted(run):
    """Frames that the camera numbered, that were not between streams, and are in no counter of the service. None: it left no figures."""
    s = run.service
    if not s:
        return None
    return len(run.numbered) - between_streams(run) - s["frames_complete"] - s["frames_incomplete"] - sum(
        n for cause, n in s["frames_lost_by_cause"].items() if cause not in ("queue_full", "no_room"))


def figures(run, reference, usual):
    """All that is measured on one run. `usual`: {flight_id: measurements of the run without faults}."""
    faults = run.replay.get("faults", [])
    begin = min((f["from_ns"] for f in faults if f["from_ns"]), default=0)
    until = max((f["until_ns"] for f in faults if f["until_ns"]), default=0)
    end = run.frames[-1].host_ns if run.frames else 0
    # Only what happened while frames came: the end of every replay is a loss of the camera.
    seen = notices(run, reference, begin, end) if begin else {}
    hit = [f for f in run.frames if f.host_ns >= begin]
    expected = sum(usual.get(f.flight_id, 0) for f in hit)
    timed = [f for f in hit if f.published and f.time_source != 3]
    return {
        "struck": sum(f["struck"] for f in faults),
        "noticed": {name: round((t - begin) * 1e-9, 2) for name, t in sorted(seen.items(), key=lambda x: x[1])},
        "recovered_s": recovery_s(run, usual, until) if until else 0.0,
        "first_id": hit[0].flight_id if hit else 0,
        "frames_sent": len(hit),
        "frames_not_measured": sum(not f.published for f in hit),
        "frames_unaccounted": unaccounted(run),
        "frames_other_clock": sum(f.published and f.time_source != 0 for f in hit),
        "measurements_lost_percent": round(100 * (1 - sum(f.accepted for f in hit) / expected), 1) if expected else 0.0,
        "measurements": sum(f.accepted for f in hit),
        "wrong": sum(f.wrong for f in hit),
        "wrong_without_fault": sum(f.wrong for f in (reference or run).frames if f.flight_id >= (hit[0].flight_id if hit else 0)),
        "wrong_times": sum(f.time_is_wrong for f in hit),
        "worst_time_us": round(max((abs(f.time_error_ns) for f in timed if f.time_source == 0), default=0) * 1e-3, 1),
        "alarms_at_end": alarms_at_end(run),
        "late_ms": round(run.replay.get("max_late_ms", 0), 1),
        "acquisitions": run.service.get("camera", {}).get("starts", 0),
        "crashed": run.crashed,
    }
