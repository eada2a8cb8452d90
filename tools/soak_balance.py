"""Does everything add up after a soak? Frames, TSPI, memory, descriptors."""
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import fault_judge

FLAT_KB_PER_MIN = 60.0   # 3.5 MB an hour: below it, memory counts as flat
WARM_UP = 0.25           # of the samples: buffers and stacks are touched for the first time
BLOCK_S = 15             # samples of one block are not independent: a lost camera is opened again with new buffers
DESCRIPTORS_MORE = 8     # a camera that is being opened again has some open twice


def slope(samples, key):
    """kB a minute with the 95 % interval: least squares, blocks of BLOCK_S drawn again and again (moving block bootstrap)."""
    rows = samples[int(len(samples) * WARM_UP):]
    if len(rows) < 4 * BLOCK_S:
        return None
    t = np.array([r["t"] for r in rows]) / 60
    v = np.array([float(r[key]) for r in rows])
    line = np.polyfit(t, v, 1)
    residual = v - np.polyval(line, t)
    chance = np.random.default_rng(1)
    starts = len(v) - BLOCK_S
    again = []
    for _ in range(500):
        noise = np.concatenate([residual[s:s + BLOCK_S] for s in chance.integers(0, starts, len(v) // BLOCK_S + 1)])[:len(v)]
        again.append(np.polyfit(t, np.polyval(line, t) + noise, 1)[0])
    low, high = np.quantile(again, [0.025, 0.975])
    return {"kb_per_min": round(float(line[0]), 2), "low": round(float(low), 2), "high": round(float(high), 2), "first_kb": float(v[:BLOCK_S].mean()), "last_kb": float(v[-BLOCK_S:].mean())}


def frames(run):
    """What became of every frame that the camera has numbered."""
    s, lost = run.service, run.service["frames_lost_by_cause"]
    between = fault_judge.between_streams(run)
    out = {"sent": len(run.numbered), "complete": s["frames_complete"], "incomplete": s["frames_incomplete"],
           "lost": {k: v for k, v in lost.items() if k not in ("queue_full", "no_room")}, "between streams": between}
    out["left over"] = out["sent"] - out["complete"] - out["incomplete"] - sum(out["lost"].values()) - between
    out["received by capture"] = out["complete"] + out["incomplete"] + lost["leader"] + lost["rows_unknown"] + lost.get("frozen", 0)
    out["refused inside"] = {"queue_full": lost["queue_full"], "no_room": lost["no_room"]}
    out["in chain"] = s["frames_in_chain"]
    out["left over inside"] = out["received by capture"] - sum(out["refused inside"].values()) - out["in chain"]
    return out


def tspi(run, name):
    """What became of every TSPI message of one aircraft."""
    s = run.service["tspi"][name]
    channel = f"TSPI_{name.upper()}"
    flooded = sum(f["struck"] for f in run.replay["faults"] if f["kind"] == "flood" and f["text"] == channel)
    sent = run.replay["channels"][channel]["sent"] + flooded
    out = {"sent": sent, "received": s["received"], "lost on the link": sent - s["received"], "refused": s["refused"], "guarded": s["guarded"], "used": s["accepted"],
           "duplicate": s["duplicate"], "too old": s["too_old"], "held back": s["held_back"] - 3 * s["jumps"]}
    for cause in ("flooded", "not_authentic", "replayed"):  # of services that tell these apart
        out[cause] = s.get(cause, 0)
    out["left over"] = out["received"] - sum(n for k, n in out.items() if k not in ("sent", "received", "lost on the link"))
    return out


def report(run, samples):
    if not run.service or not samples:
        return {"wrong": ["the service left no figures"], "memory": None}
    out = {"frames": frames(run), "tspi": {n: tspi(run, n) for n in ("receiver", "tanker")}, "memory": slope(samples, "rss_kb"),
           "descriptors": [samples[len(samples) // 4]["descriptors"], samples[-2 if len(samples) > 1 else -1]["descriptors"], max(r["descriptors"] for r in samples)],
           "threads": [samples[len(samples) // 4]["threads"], max(r["threads"] for r in samples)],
           "inputs_refused": run.service["inputs_refused"], "camera": run.service["camera"], "time": run.service["time"], "latency_ms": run.service["latency_ms"],
           "faults": {}, "late_ms": run.replay["max_late_ms"], "loops": run.replay["loops"],
           "measurements": sum(f.accepted for f in run.frames), "wrong_measurements": sum(f.wrong for f in run.frames),
           "wrong_times": sum(f.time_is_wrong for f in run.frames), "events_lost": run.service["events_lost"]}
    for f in run.replay["faults"]:
        seen = out["faults"].setdefault(f["kind"], [0, 0])
        seen[0] += 1
        seen[1] += f["struck"]
    out["wrong"] = verdict(out, run)
    return out


def verdict(r, run):
    wrong = []
    refused = run.service["inputs_refused"]["tspi"] + run.service["tspi"]["without_clock"]
    if abs(r["frames"]["left over"]) > sum(r["frames"]["refused inside"].values()):
        wrong.append(f"{r['frames']['left over']} frames of the camera are in no counter")
    if r["frames"]["left over inside"] != 0:
        wrong.append(f"{r['frames']['left over inside']} frames got lost between capture and chain without a counter")
    for name, t in r["tspi"].items():
        if t["left over"] < 0 or sum(x["left over"] for x in r["tspi"].values()) > refused:
            wrong.append(f"{t['left over']} TSPI messages of the {name} are in no counter")
        if t["lost on the link"] < 0:
            wrong.append(f"more TSPI of the {name} was received than sent")
    if r["memory"] and r["memory"]["low"] > FLAT_KB_PER_MIN:
        wrong.append(f"memory grows by {r['memory']['kb_per_min']} kB a minute")
    if r["descriptors"][1] > r["descriptors"][0] + DESCRIPTORS_MORE:
        wrong.append(f"descriptors went from {r['descriptors'][0]} to {r['descriptors'][1]}")
    if r["events_lost"]:
        wrong.append(f"{r['events_lost']} events found no room")
    return wrong


def text(r):
    if "frames" not in r:
        return "soak: " + "; ".join(r["wrong"])
    f, m = r["frames"], r["memory"]
    lines = [f"frames       {f['sent']} numbered by the camera = {f['complete']} complete + {f['incomplete']} incomplete + " +
             " + ".join(f"{n} {k}" for k, n in f["lost"].items() if n) + f" + {f['between streams']} between streams + {f['left over']} left over",
             f"             {f['received by capture']} received = {f['in chain']} in the chain + {f['refused inside']['queue_full']} queue full + {f['refused inside']['no_room']} no room + {f['left over inside']} left over"]
    for name, t in r["tspi"].items():
        lines.append(f"TSPI {name:8s}" + f"{t['sent']} sent = {t['lost on the link']} lost on the link + {t['received']} received = " +
                     " + ".join(f"{t[k]} {k}" for k in t if k not in ("sent", "received", "lost on the link") and (t[k] or k == "left over")))
    if m:
        lines.append(f"memory       {m['first_kb'] / 1024:.1f} to {m['last_kb'] / 1024:.1f} MB, {m['kb_per_min']:+.1f} kB a minute (95 %: {m['low']:+.1f} to {m['high']:+.1f})")
    else:
        lines.append("memory       too short to tell a slope (needs a minute and a half)")
    lines += [f"descriptors  {r['descriptors'][0]} at first, {r['descriptors'][1]} at last, at most {r['descriptors'][2]}; threads at most {r['threads'][1]}",
              f"camera       {r['camera']['starts']} starts, {r['camera']['losses']} losses; faults: {sum(v[0] for v in r['faults'].values())} of {len(r['faults'])} kinds; {r['loops']} rounds",
              f"frame times  by strobe {r['time']['by_strobe']}, camera clock {r['time']['by_camera_tick']}, arrival {r['time']['by_arrival']}, none {r['time']['unknown']}; wrong {r['wrong_times']}",
              f"measured     {r['measurements']}, of them wrong {r['wrong_measurements']}; latency p50 {r['latency_ms']['p50']:.1f}, p99 {r['latency_ms']['p99']:.1f} ms",
              "soak: " + ("; ".join(r["wrong"]) if r["wrong"] else "everything balances")]
    return "\n".join(lines)
