#!/usr/bin/python3
"""faults.py BUILD [--table FILE] [--flight DIR] [--out DIR] [--only WORD,WORD] [--relaxed]

Plays a flight through the whole rig once for each row of the table (config/faults/table.toml), each time with another fault, and
measures on the logs what the service noticed, how soon it was well again, what was lost and what was wrong (docs/faults.md).
A row that fails while the bench itself was more than LATE_MS late is flown again, at most TRIES times in all.
Prints the table and writes OUT/faults.json, .md and .html; ends with 1 when a row fails. --relaxed: no limits on time, for
machines that are busy with other things.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tomllib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "tools"))
import fault_judge
import fault_page

LATE_MS, TRIES = 100, 3  # a bench that was itself later than this proves nothing against the service: the row is flown again


def types_of(build):
    sys.path.insert(0, os.path.join(ROOT, "build/gen/python"))
    import cyclops
    return cyclops


def script_of(row, path, onset_s, duration_s):
    """Writes the row's faults as a script; each begins at onset_s and lasts duration_s unless it says otherwise."""
    def word(v):
        return json.dumps(v) if isinstance(v, (str, bool)) else repr(v)
    lines = ["seed = 7"]
    for fault in row.get("fault", []):
        fault = {"onset_s": onset_s, "duration_s": duration_s} | fault
        if fault.get("folder") == "DISK":
            fault["folder"] = os.path.abspath(os.path.join(os.path.dirname(path), "disk"))
        lines += ["[[fault]]"] + [f"{k} = {word(v)}" for k, v in fault.items()]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")


def fly(build, flight, out, row, table):
    """One run; an empty text, or why it did not end as it should."""
    shutil.rmtree(out, ignore_errors=True)
    os.makedirs(out)
    script = os.path.join(out, "faults.toml")
    script_of(row, script, table["onset_s"], table["duration_s"])
    options = ["--faults", script, "--sent", os.path.join(out, "sent.csv"), "--seconds", str(row.get("seconds", table["seconds"])), "--quiet"]
    env = os.environ | {"CYCLOPS_IDLE_S": str(row.get("idle_s", 2))}
    command = ["hil/rig.sh", build, flight, out, "-", "1"] + options
    if "disk_mb" in row:  # the service records onto a disk of its own
        env |= {"RECORD": "yes", "RECORD_IN": os.path.join(out, "disk"), "RECORD_OPTIONS": row.get("record_options", "")}
        command = ["hil/disk.sh", os.path.join(out, "disk"), str(row["disk_mb"])] + command
    with open(os.path.join(out, "rig.log"), "w") as log:
        done = subprocess.run(command, cwd=ROOT, env=env, stdout=log, stderr=subprocess.STDOUT)
    if done.returncode == 0 or done.returncode == row.get("exit_code", 0):
        return ""
    with open(os.path.join(out, "rig.log")) as log:
        return f"rig ended with {done.returncode}: " + " | ".join(log.read().split("\n")[-4:])


def is_absorbed(row, f):
    """It did no harm, and the row allows that nothing tells of it."""
    harmless = f["measurements_lost_percent"] <= row["limit"]["harmless_percent"] and f["wrong_times"] == 0 and f["frames_other_clock"] <= 1
    return bool(row.get("may_be_absorbed")) and harmless


def verdict(row, f, relaxed):
    """Why the row fails; empty: it passes."""
    why = []
    if f["crashed"]:
        why.append(f["crashed"])
    if f["struck"] == 0:
        why.append("the fault never struck")
    limit = row["limit"]
    absorbed = is_absorbed(row, f)
    noticed = {n: t for n, t in f["noticed"].items() if any(n == d for d in row.get("notice", []))}
    if row.get("notice") and not noticed and not absorbed:
        why.append("not noticed by " + " or ".join(row["notice"]))
    if noticed and not absorbed and not relaxed and min(noticed.values()) > limit["noticed_s"]:
        why.append(f"noticed after {min(noticed.values())} s, limit {limit['noticed_s']}")
    if f["recovered_s"] is None:
        why.append("did not recover")
    elif not relaxed and f["recovered_s"] > limit["recovered_s"]:
        why.append(f"recovered after {f['recovered_s']:.1f} s, limit {limit['recovered_s']}")
    if not relaxed and f["measurements_lost_percent"] > limit["lost_percent"]:
        why.append(f"{f['measurements_lost_percent']} % of the measurements lost, limit {limit['lost_percent']}")
    more_wrong = 100 * (f["wrong"] - f["wrong_without_fault"]) / max(1, f["measurements"])
    if more_wrong > limit["wrong_percent"]:
        why.append(f"{more_wrong:.1f} % wrong measurements, limit {limit['wrong_percent']}")
    if f["wrong_times"] > limit["wrong_times"]:
        why.append(f"{f['wrong_times']} wrong times, limit {limit['wrong_times']}")
    if f["frames_unaccounted"] is not None and abs(f["frames_unaccounted"]) > limit["unaccounted"]:
        why.append(f"{f['frames_unaccounted']} frames in no counter")
    left = [a for a in f["alarms_at_end"] if a not in row.get("alarms_of_host", [])]
    if left and not relaxed:
        why.append("alarm at the end: " + ", ".join(left))
    return why


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("build")
    p.add_argument("--table", default="config/faults/table.toml")
    p.add_argument("--flight", default="build/flights/faults")
    p.add_argument("--out", default="build/faults")
    p.add_argument("--only", default="", help="rows whose name contains one of these words")
    p.add_argument("--relaxed", action="store_true")
    a = p.parse_args()
    os.chdir(ROOT)
    types = types_of(a.build)
    with open(a.table, "rb") as file:
        table = tomllib.load(file)
    truth = fault_judge.truth_of(a.flight, types)
    words = [w for w in a.only.split(",") if w]
    rows = [r for r in table["row"] if not words or any(w in r["name"] for w in words)]
    if not rows:
        sys.exit(f"faults.py: no row's name contains {a.only}")

    out = os.path.join(a.out, "none")
    longest = max(r.get("seconds", table["seconds"]) for r in table["row"])
    crashed = fly(a.build, a.flight, out, {"fault": [], "seconds": longest}, table)
    reference_run = fault_judge.load(out, truth, types)
    reference_run.crashed = crashed
    usual = {f.flight_id: f.accepted for f in reference_run.frames}
    reference = fault_judge.figures(reference_run, None, usual)
    results = []
    print(fault_page.header(), flush=True)
    print(fault_page.line({"name": "none", "figures": reference, "why": [crashed] if crashed else [], "notice": []}), flush=True)
    for row in rows:
        row["limit"] = table["limit"] | row.get("limit", {})
        row["alarms_of_host"] = table.get("alarms_of_host", []) + row.get("alarms_of_bench", [])
        if "disk_mb" in row and os.geteuid() != 0:
            print(f"{row['name']}: not tried, a disk of its own needs root")
            continue
        out = os.path.join(a.out, row["name"].replace(" ", "_").replace("%", "pc").replace(",", ""))
        for tries in range(1, TRIES + 1):
            crashed = fly(a.build, a.flight, out, row, table)
            run = fault_judge.load(out, truth, types)
            run.crashed = crashed
            f = fault_judge.figures(run, reference_run, usual)
            result = {"name": row["name"], "fault": row["fault"], "notice": row.get("notice", []), "limit": row["limit"], "figures": f,
                      "why": verdict(row, f, a.relaxed), "tries": tries, "absorbed": is_absorbed(row, f)}
            if not result["why"] or (f["late_ms"] < LATE_MS and f["struck"] > 0):
                break
        results.append(result)
        print(fault_page.line(result), flush=True)
    failed = [r for r in results if r["why"]]
    fault_page.write(a.out, reference, results, table)
    print(f"\n{len(results) - len(failed)} faults passed, {len(failed)} failed; {a.out}/faults.html, .md, .json")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
