"""Learnt models in an evaluation: each is learnt once by cyclops-learn, from flights whose navigation has a seed to tune with, and tried
on pictures that it was not learnt from. The kept model has the hash of all that it depends on in its name.
"""
import os
import shutil

import evaluate_runs as runs

SEED = 1  # of the flights learnt from; reports have 101 to 120
CONDITION = "12px-1hz"
MODELS = {  # tanker -> what is learnt from: scenarios, or recorded folders; @ takes a part, seconds
    "c12": ("s1@0-23", "block1"),
    "heavy": ("heavy-tour",),
    "cube": ("build/cube_6px.flight@0-3.4",)}
TRIED = (  # row of the report, model, flight, first frame that counts
    ("s1-learned", "c12", "s1", 720), ("s2-learned", "c12", "s2", 0), ("s4-learned", "c12", "s4", 0), ("block3-learned", "c12", "block3", 0), ("heavy-learned", "heavy", "heavy", 0),
    ("cube_6px-learned", "cube", "build/cube_6px.flight", 103))


def recorded(source):
    return "/" in source


def split(source):
    folder, _, part = source.partition("@")
    return folder, "@" + part if part else ""


def profile(source):
    """A recorded flight says itself when navigation is updated."""
    if recorded(source):
        return runs.content("config/default.toml").decode()
    return runs.profile_for("default", source, CONDITION, runs.frame_rate(source))


def wanted(flights, recorded_folders):
    """Rows of TRIED whose flights are part of this evaluation."""
    there = {os.path.normpath(f) for f in recorded_folders}
    return [t for t in TRIED if (t[2] in there if recorded(t[2]) else t[2] in flights)]


def model_path(setting, name):
    parts = []
    for source in MODELS[name]:
        folder, part = split(source)
        parts += [part, profile(folder), *(runs.recorded_content(folder) if recorded(folder) else [setting.flight_key(folder, "measured", SEED)])]
    return os.path.join(setting.models, f"{name}-{runs.sha(setting.programs['cyclops-learn'], *parts)[:20]}.csv")


def learn(setting, name, path):
    """One task: flies what is learnt from, learns, removes the flights."""
    work = os.path.join(setting.work, "learn-" + name)
    sources = []
    try:
        for source in MODELS[name]:
            folder, part = split(source)
            if not recorded(folder):
                runs.fly(setting, folder, "measured", SEED, os.path.join(work, folder))
            sources.append((folder if recorded(folder) else os.path.join(work, folder)) + part)
        os.makedirs(work, exist_ok=True)
        config = os.path.join(work, "profile.toml")
        with open(config, "w") as file:
            file.write(profile(split(MODELS[name][0])[0]))
        runs.call([setting.program("cyclops-learn"), *sources, "--config", config, "--out", path, "--strength", path.replace(".csv", ".json"), "--quiet"])
    finally:
        shutil.rmtree(work, ignore_errors=True)


def models(setting, rows, jobs):
    """({name: path of the model}, what failed); learns what is not there."""
    paths = {name: model_path(setting, name) for name in sorted({r[1] for r in rows})}
    tasks = [(1, f"learning {name}", learn, (setting, name, path)) for name, path in paths.items() if not os.path.exists(path)]
    failed = runs.in_parallel(tasks, jobs) if tasks else []
    return {n: p for n, p in paths.items() if os.path.exists(p)}, failed


def options(path, first):
    """Of cyclops-evaluate."""
    return ["--tanker", path, "--from", str(first)]
