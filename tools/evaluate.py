#!/usr/bin/python3
"""evaluate.py BUILD [options]: what the chain does on every standard flight, under several conditions of navigation, for many seeds.

Goes on where it was stopped: a run is done again only when program, profile, scenario, seed or the definition of a figure changed.
Writes OUT/report.json, report.txt and report.html (default build/evaluate). docs/evaluation.md says what each figure is.
"""
import argparse
import fcntl
import json
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # parallel are the runs
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import evaluate_goals
import evaluate_learned
import evaluate_merge
import evaluate_report
import evaluate_runs as runs
import evaluate_trials
import flights

CORE = ("s1", "s2", "s3", "s4", "low-sun-out", "twilight", "night", "low-sun-in", "block0", "block1", "block2", "block3", "block4", "turn", "wing-rock", "heavy")
SEGMENTS = ("s1", "s2", "s3", "s4")  # also without projection error and with navigation at every frame
ALL_SEEDS = {(f, evaluate_goals.REAL) for _, f, *_ in evaluate_goals.goals()}  # what a goal speaks of; the rest flies the first few


def numbers(text):
    """"1-3,7" -> [1, 2, 3, 7]"""
    out = []
    for part in text.split(","):
        a, _, b = part.partition("-")
        out += range(int(a), int(b or a) + 1)
    return out


def plan(args, setting, models):
    """[(key, flight flown, seed, navigation, program, text, names, options)]"""
    out = []

    def add(flight, condition, seed, shown, text, program="cyclops-evaluate", row=None, options=()):
        navigation = runs.CONDITIONS["12px-1hz" if condition == runs.BESIDE else condition][0]
        names = {"flight": row or flight, "condition": condition, "seed": seed, "profile": shown}
        out.append((setting.run_key(flight, navigation, seed, text, program, options), flight, seed, navigation, program, text, names, options))

    for flight in args.flights:
        rate = runs.frame_rate(flight)
        for condition in args.conditions or (("12px-1hz", "12px", "true-1hz") if flight in SEGMENTS else ("12px-1hz",)):
            for profile in args.profiles:
                few = 1 if runs.CONDITIONS[condition][0] == "true" else None if (flight, condition) in ALL_SEEDS and profile == evaluate_goals.PROFILE else args.few  # without errors all seeds are the same
                for seed in args.seeds[:few]:
                    add(flight, condition, seed, profile, runs.profile_for(profile, flight, condition, rate))
        if flight in SEGMENTS and args.peers:
            for program, profile, shown in [("cyclops-evaluate", "default", "default"), *((p, "thesis-2007", p.removeprefix("cyclops-")) for p in args.peers)]:
                text = runs.profile_for(profile, flight, "12px-1hz", rate)  # a peer reads no more of it than when navigation updates
                add(flight, runs.BESIDE, args.seeds[0], shown, text, program, options=("--frames", str(runs.PEER_FRAMES)))
    for row, model, flight, first in args.learned:
        if model in models and not evaluate_learned.recorded(flight):
            for seed in args.seeds[:None if (row, evaluate_learned.CONDITION) in ALL_SEEDS else args.few]:
                add(flight, evaluate_learned.CONDITION, seed, evaluate_goals.PROFILE, evaluate_learned.profile(flight), row=row, options=evaluate_learned.options(models[model], first))
    return out


def plan_recorded(args, setting, models):
    """[(key, folder, program, profile text, names, options)]: flights that are there, with the profiles as they are, the peers and the models learnt."""
    out = []

    def add(folder, row, program, text, shown, options=()):
        names = {"flight": row, "condition": "as it is", "seed": 0, "profile": shown}
        out.append((runs.recorded_key(setting, folder, text, program, options), folder, program, text, names, options))

    for folder in args.recorded:
        flight = os.path.basename(os.path.normpath(folder)).removesuffix(".flight")
        for program, profile, shown in [("cyclops-evaluate", p, p) for p in args.profiles] + [(p, "thesis-2007", p.removeprefix("cyclops-")) for p in args.peers]:
            add(folder, flight, program, runs.content(f"config/{profile}.toml").decode(), shown)
    for row, model, flight, first in args.learned:
        if model in models and evaluate_learned.recorded(flight):
            add(flight, row, "cyclops-evaluate", evaluate_learned.profile(flight), evaluate_goals.PROFILE, evaluate_learned.options(models[model], first))
    return out


def do_runs(args, setting, planned, recorded):
    todo = {}
    for key, flight, seed, navigation, program, text, names, options in planned:
        if not os.path.exists(os.path.join(setting.runs, key + ".json")):
            todo.setdefault((names["condition"] == runs.BESIDE, flight, navigation, seed), []).append((key, program, text, names, options))
    missing = sum(map(len, todo.values()))
    print(f"{len(planned)} runs, {len(planned) - missing} of them known, {args.jobs} at a time", flush=True)
    tasks = [(len(wanted), f"{flight} {navigation} seed {seed}{' peers' if peers else ''}", runs.job, (setting, flight, navigation, seed, wanted)) for (peers, flight, navigation, seed), wanted in sorted(todo.items(), key=lambda t: t[0][0])]
    tasks += [(1, f"{r[4]['flight']} {r[4]['profile']}", runs.recorded_job, (setting, r[1], r[0], *r[2:])) for r in recorded if not os.path.exists(os.path.join(setting.runs, r[0] + ".json"))]
    return runs.in_parallel(tasks, args.jobs) if tasks else []


def kept(setting, keys):
    for key in keys:
        path = os.path.join(setting.runs, key + ".json")
        if os.path.exists(path):
            with open(path) as file:
                yield json.load(file)


def do_trials(args, setting):
    """Trials fly S1 with the first seeds; (figures by trial, what failed)"""
    seeds = args.seeds[:args.trials]
    keys = {(name, seed): evaluate_trials.key(setting, name, args.profiles[0], seed) for name in evaluate_trials.TRIALS for seed in seeds}
    tasks = []
    for seed in seeds:
        names = [n for n in evaluate_trials.TRIALS if not os.path.exists(os.path.join(setting.runs, keys[n, seed] + ".json"))]
        if names:
            tasks.append((len(names), f"trials of seed {seed}", evaluate_trials.job, (setting, seed, args.profiles[0], names)))
    failed = runs.in_parallel(tasks, args.jobs) if tasks else []
    return evaluate_trials.merged(kept(setting, keys.values())), failed


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--flights", type=lambda s: s.split(","), default=list(CORE))
    parser.add_argument("--profiles", type=lambda s: s.split(","), default=["default"], help="names of config/*.toml")
    parser.add_argument("--seeds", type=numbers, default=numbers("101-120"), help="of navigation, as 1-20: 1 to 20 to tune with, 101 to 120 to report")
    parser.add_argument("--few", type=int, default=5, help="seeds of what no goal speaks of")
    parser.add_argument("--conditions", type=lambda s: s.split(","), help=f"of {', '.join(runs.CONDITIONS)}; default: by flight")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--out", default="build/evaluate")
    parser.add_argument("--cache", default="build/flights/cache", help="pictures of the flights")
    parser.add_argument("--trials", type=int, default=5, help="seeds that fly the disturbed flights, 0 for none")
    parser.add_argument("--peers", action=argparse.BooleanOptionalAction, default=True, help="other people's trackers, where they are built: the first seed of S1 to S4")
    parser.add_argument("--learned", action=argparse.BooleanOptionalAction, default=True, help="models that cyclops-learn makes of other flights, where it is built")
    parser.add_argument("--recorded", type=lambda s: [f for f in s.split(",") if f], default=[f for f in ("build/cube_6px.flight",) if os.path.isdir(f)], help="folders of flights with truth that are run as they are")
    parser.add_argument("--accepted", default="docs/evaluation.json", help="figures of the run that was accepted last")
    parser.add_argument("--accept", metavar="REASON", help="make this run the accepted one (docs/evaluation.json, evaluation-figures.md), and why")
    args = parser.parse_args()
    args.seeds_text = f"{args.seeds[0]} to {args.seeds[-1]}" if args.seeds == list(range(args.seeds[0], args.seeds[-1] + 1)) else " ".join(map(str, args.seeds))
    known = {scenario for _, scenario, _ in flights.standard_set()}
    if set(args.flights) - known:
        sys.exit(f"evaluate.py: no scenario {', '.join(sorted(set(args.flights) - known))}; there are: {' '.join(sorted(known))}")
    if set(args.conditions or ()) - set(runs.CONDITIONS):
        sys.exit(f"evaluate.py: conditions are {', '.join(runs.CONDITIONS)}")
    return args


def alone(folder):
    """Holds the folder until the program ends; two evaluations in one would take each other's runs apart."""
    os.makedirs(folder, exist_ok=True)
    lock = open(os.path.join(folder, "lock"), "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        sys.exit(f"evaluate: another evaluation is at work in {folder}; give this one a folder of its own with --out")
    return lock


def main():
    os.chdir(flights.ROOT)
    args = arguments()
    lock = alone(args.out)  # noqa: F841, held to the end
    setting = runs.Setting(args.build, args.out, args.cache)
    args.peers = [p for p in runs.PEERS if p in setting.programs] if args.peers else []
    args.learned = evaluate_learned.wanted(args.flights, args.recorded) if args.learned and "cyclops-learn" in setting.programs else []
    models, failed = evaluate_learned.models(setting, args.learned, args.jobs)
    planned, recorded = plan(args, setting, models), plan_recorded(args, setting, models)
    failed += do_runs(args, setting, planned, recorded)
    groups = evaluate_merge.groups(kept(setting, (p[0] for p in planned + recorded)))
    trials, failed_trials = do_trials(args, setting)
    goals = evaluate_goals.table(groups, trials)
    before = None
    if os.path.exists(args.accepted):
        with open(args.accepted) as file:
            before = json.load(file)
    report = evaluate_merge.small(groups, goals, trials, args.seeds_text, failed + failed_trials)
    text = evaluate_report.text(report, before)
    print(text)
    with open(os.path.join(args.out, "report.txt"), "w") as file:
        file.write(text + "\n")
    with open(os.path.join(args.out, "report.json"), "w") as file:
        json.dump(report, file, indent=1)
    evaluate_report.page(report, groups, before, args.out)
    if args.accept:
        report["reason"] = args.accept
        with open(args.accepted, "w") as file:
            file.write(evaluate_merge.compact(report))
        with open(os.path.splitext(args.accepted)[0] + "-figures.md", "w") as file:
            file.write(evaluate_report.markdown(report))
    sys.exit(1 if report["failed"] else 0)


if __name__ == "__main__":
    main()
