# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Reprocesses the sessions of a shard that are not current, in RESULTS, and writes the shard's rows.

A session's key is a digest of its inputs, the toolbox and the options. What a session gives stands in
sessions/CAMERA/SESSION, or, when it has no result, in failed/CAMERA/SESSION, with session.json, which
has the key, the verdict and the reason. A folder appears whole: it is made in .state/work and moved.
"""
import fcntl
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from files import digest, input_digest, json_text, table, write_whole
from outcome import COLUMNS, KEPT, cost_of, outcome_of

STATE = Path(".state")
COSTS = STATE / "costs"


def place_of(name, verdict):
    return Path("failed" if verdict in ("no result", "crashed") else "sessions") / name


def key_of(inputs, run):
    return digest(json_text([inputs, run["toolbox"], run["camera"], run["session_gates_digest"]]))


def current(name, key):
    """The session as it stands, when it is of this key; what crashed is tried again."""
    for place in (Path("sessions") / name, Path("failed") / name):
        try:
            session = json.loads((place / "session.json").read_text())
        except (FileNotFoundError, NotADirectoryError, ValueError):
            continue
        if session["key"] == key and session["verdict"] != "crashed":
            return session
    return None


def run_chain(run, names, work, lock):
    """The rule per stage of session.smk for sessions, one after another. Snakemake holds the lock, too: when
    it is told to end it ends its stages first, and may outlive us."""
    config = {key: run[key] for key in ("archive", "bin", "camera", "session_gates")}
    write_whole(work / "config.json", json_text({**config, "sessions": names}))
    subprocess.run(
        [sys.executable, "-m", "snakemake", "--snakefile", Path(__file__).parent / "session.smk"]
        + ["--configfile", "config.json", "--directory", work, "--cores", "1", "--scheduler", "greedy"]
        + ["--keep-going", "--nolock", "--rerun-incomplete", "--rerun-triggers", "mtime", "--quiet", "all"]
        + ["--latency-wait", "0"],
        cwd=work,
        pass_fds=[lock.fileno()],
        check=False,  # the outcome of each session says what came of it
    )


def same_file(source, target):
    """Under another name, too: what the programs have brought safely to disk is not written again."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def publish(session, work):
    """Takes what a session gave to its place, and nothing else of it remains. The work is left as it is,
    so that this can be done again."""
    name = f"{session['camera']}/{session['session']}"
    ready = STATE / "ready" / name
    shutil.rmtree(ready, ignore_errors=True)
    (ready / "logs").mkdir(parents=True)
    for file in KEPT:
        if (work / name / file).is_file():
            same_file(work / name / file, ready / KEPT[file])
    for log in sorted((work / name / "logs").glob("*.txt")):
        if log.stat().st_size > 0:
            same_file(log, ready / "logs" / log.name)
    write_whole(ready / "session.json", json_text(session))
    place = place_of(name, session["verdict"])
    place.parent.mkdir(parents=True, exist_ok=True)
    old = STATE / "old" / name
    shutil.rmtree(old, ignore_errors=True)
    old.parent.mkdir(parents=True, exist_ok=True)
    for former in (Path("sessions") / name, Path("failed") / name):
        if former.exists():
            former.rename(old)
            shutil.rmtree(old)
    ready.rename(place)


def stated_cost(name):
    """In seconds; empty when .state was taken away since."""
    try:
        return (COSTS / name).read_text()
    except FileNotFoundError:
        return ""


def reprocess(run, shard, names, lock):
    work = (STATE / "work" / shard).absolute()
    sessions, stale = {}, {}
    for name in names:
        inputs = input_digest(Path(run["archive"]) / name)
        key = key_of(inputs, run)
        sessions[name] = current(name, key)
        if sessions[name] is None:
            stale[name] = {"key": key, "inputs": inputs}
            begun = work / name
            # A run that was interrupted goes on, if it is of the same key.
            if begun.exists() and not (begun / key).exists():
                shutil.rmtree(begun)
            begun.mkdir(parents=True, exist_ok=True)
            (begun / key).touch()
    if stale:
        run_chain(run, list(stale), work, lock)
    for name, keys in stale.items():
        sessions[name] = outcome_of(work / name, name, run) | keys | {"version": run["version"]}
        write_whole(COSTS / name, cost_of(work / name))
        publish(sessions[name], work)
    shutil.rmtree(work, ignore_errors=True)
    print(f"{len(names)} sessions, {len(stale)} reprocessed")
    return [sessions[name] | {"cpu_s": stated_cost(name)} for name in names]


def main():
    shard = sys.argv[1]
    run = json.loads((STATE / "run.json").read_text())
    lines = (STATE / "shards" / f"{shard}.list").read_text().splitlines()
    (STATE / "locks").mkdir(exist_ok=True)
    with open(STATE / "locks" / shard, "w") as lock:
        # A job that the cluster gave up may still be at work.
        fcntl.flock(lock, fcntl.LOCK_EX)
        rows = reprocess(run, shard, [line.split("\t")[0] for line in lines], lock)
    write_whole(STATE / "rows" / f"{shard}.csv", table(COLUMNS, rows))


if __name__ == "__main__":
    main()
