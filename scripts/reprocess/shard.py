# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Reprocesses the sessions of a shard that are not current, in RESULTS, and writes the shard's rows.

A session's key is a digest of its inputs, the toolbox and the options, without --session-gates: these are applied to
the rows (summary.py). What a session gives stands in
sessions/CAMERA/SESSION, or, when it has no result, in failed/CAMERA/SESSION, with row.json, which has the
key and the session's row. A folder appears whole: it is made in .state/work and moved.
"""
import fcntl
import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

from files import digest, input_digests, json_text, read_table, table, write_whole
from outcome import ALL, KEPT, outcome_of

STATE = Path(".state")
LONGEST_S = 3600
# Keeps the memory of an image for the next one: returned pages would be cleared again. Either of the two alone would
# keep glibc from learning how large a buffer it need not map anew.
ENVIRONMENT = {"MALLOC_TRIM_THRESHOLD_": str(256 << 20), "MALLOC_MMAP_THRESHOLD_": str(32 << 20), **os.environ}


WITHOUT_RESULT = ("no result", "crashed")


def place_of(name, verdict):
    return Path("failed" if verdict in WITHOUT_RESULT else "sessions") / name


def key_of(inputs, run):
    return digest(json_text([inputs, run["toolbox"], run["camera"]]))


def row_in(place):
    """The row of a result; None when it cannot be read."""
    try:
        return json.loads((place / "row.json").read_text())
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return None


def current(name, key):
    """The session as it stands, when it is of this key; what crashed is tried again."""
    for place in (Path("sessions") / name, Path("failed") / name):
        row = row_in(place)
        if row and row["key"] == key and row["verdict"] != "crashed":
            return row
    return None


class EachProcess:
    """vlp-calibrate --batch-stdin: a process that splits one off for each session, so that its libraries are loaded once.
    It holds the lock, too, and may outlive us by a session; what it splits off does not outlive it."""

    def __init__(self, program, lock):
        self.program, self.lock, self.process = program, lock, None

    def ask(self, arguments):
        """One session at a time: answer() before another."""
        if self.process is None:
            self.process = subprocess.Popen([self.program, "--batch-stdin"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            pass_fds=[self.lock.fileno()], env=ENVIRONMENT)
        request = json.dumps({"arguments": [str(argument) for argument in arguments], "limit_s": LONGEST_S})
        try:
            self.process.stdin.write(request.encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # there will be no answer

    def answer(self):
        """Its exit code, or the negative number of the signal that ended it, its processor time in seconds, and
        what it said at the end."""
        answer = self.process.stdout.readline()
        if answer.endswith(b"\n"):
            answer = json.loads(answer)
            return answer["exit_code"], answer["cpu_s"], answer["said"]
        return self.end(), 0, ""

    def end(self):
        process, self.process = self.process, None
        if process is not None:
            process.communicate()
            return process.returncode

    def kill(self):
        """With what it is at."""
        if self.process is not None:
            self.process.kill()
            self.end()


def begin(run, each, name, work):
    """Has vlp-calibrate begin with a session."""
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "session.json").unlink(missing_ok=True)  # of a run that was interrupted
    arguments = [Path(run["archive"]) / name, "-o", folder, "--quiet", "--no-report", "--threads", "1"]
    arguments += [f"--camera-id={name.split('/')[0]}", *shlex.split(run["camera"])]
    each.ask(arguments)


def same_file(source, target):
    """Under another name, too: what the programs have brought safely to disk is not written again."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def discard(result, name):
    """At once, so that no part of it is ever taken for a result."""
    old = STATE / "old" / name
    shutil.rmtree(old, ignore_errors=True)
    old.parent.mkdir(parents=True, exist_ok=True)
    result.rename(old)
    shutil.rmtree(old)


def put_aside(place, name, keep):
    """The former result goes to former/, by its key; with none to keep, of a crash, and without a row it is gone."""
    row = row_in(place) if keep > 0 else None
    if not row or row["verdict"] == "crashed":
        return discard(place, name)
    kept = Path("former") / name / row["key"][:12]
    kept.parent.mkdir(parents=True, exist_ok=True)
    if kept.exists():
        discard(kept, name)
    place.rename(kept)


def keep_the_last(name, keep):
    """Deletes all former results but the last `keep`. If these have the verdict "no result", the last other one stays
    in place of the oldest of them, so that a lost result can still be seen."""
    formers = sorted((Path("former") / name).glob("*/row.json"), key=lambda row: row.stat().st_mtime_ns)
    verdicts = {file: (row_in(file.parent) or {"verdict": "crashed"})["verdict"] for file in formers}
    usable = [file for file in formers if verdicts[file] not in WITHOUT_RESULT]
    kept = formers[max(0, len(formers) - keep) :]
    if kept and usable and usable[-1] not in kept:
        kept[0] = usable[-1]
    for file in formers:
        if file not in kept:
            discard(file.parent, name)


def publish(row, work, keep=0):
    """Moves the results of a session to their place and keeps `keep` former ones. The work is left unchanged, so that
    this can be repeated."""
    name = f"{row['camera']}/{row['session']}"
    ready = STATE / "ready" / name
    shutil.rmtree(ready, ignore_errors=True)
    ready.mkdir(parents=True)
    for file in KEPT:
        if (work / name / file).is_file():
            same_file(work / name / file, ready / KEPT[file])
    write_whole(ready / "row.json", json_text(row))
    place = place_of(name, row["verdict"])
    place.parent.mkdir(parents=True, exist_ok=True)
    for former in (Path("sessions") / name, Path("failed") / name):
        if former.exists():
            put_aside(former, name, keep)
    ready.rename(place)
    keep_the_last(name, keep)
    return sum(file.stat().st_size for file in place.iterdir())


def tell(folder, shard, *words):
    (STATE / folder).mkdir(exist_ok=True)
    with open(STATE / folder / shard, "a") as told:
        told.write("\t".join(words) + "\n")


def tell_run(shard, row, cost, size):
    """A line for what this run did, also of one that is killed and goes on."""
    tell("ran", shard, f"{row['camera']}/{row['session']}", row["verdict"], cost, str(size))


def rows_before(shard):
    """Of each session: its row of the last time; none when that cannot be read."""
    try:
        return {f"{row['camera']}/{row['session']}": row for row in read_table(STATE / "rows" / f"{shard}.csv")}
    except (FileNotFoundError, KeyError):
        return {}


def reprocess(run, shard, glances, lock, keep):
    """glances: {CAMERA/SESSION: glance at its files}; while that is the same the digest of the inputs is.
    What a session gave comes to its place, and the next one's inputs are looked at, while vlp-calibrate is at work: they
    wait for the disk, mostly."""
    work = (STATE / "work" / shard).absolute()
    each = EachProcess(Path(run["bin"]) / "vlp-calibrate", lock)
    before, rows, made, at_work = rows_before(shard), {}, 0, None

    def finish(name, known, answer):
        ended, seconds, said = answer
        row = outcome_of(work / name, name, ended, said.replace(run["archive"] + "/", "")) | known
        if "gates.yaml" in known["parts"] and "gate_metrics" in row:
            row["gate_metrics"] = ""
        cost = f"{seconds:.3f}"
        tell("costs", shard, name, cost, f"{time.time():.3f}")  # a session may come to another shard
        tell_run(shard, row, cost, publish(row, work, keep))
        shutil.rmtree(work / name)
        rows[name] |= row

    try:
        for name, glance in glances.items():
            row, known = None, before.get(name)
            if known and known.get("glance") == glance:
                row = current(name, key_of(known["inputs"], run))
            if row is None:
                inputs, parts = input_digests(Path(run["archive"]) / name)
                key = key_of(inputs, run)
                row = current(name, key)
            rows[name] = (row or {}) | {"glance": glance}
            if row is None:
                answer = each.answer() if at_work else None
                begin(run, each, name, work)
                if at_work:
                    finish(*at_work, answer)
                at_work = name, {"key": key, "inputs": inputs, "parts": parts, "version": run["version"]}
                made += 1
        if at_work:
            finish(*at_work, each.answer())
        each.end()
    finally:
        each.kill()  # when this failed it is at a session that nobody waits for
    shutil.rmtree(work, ignore_errors=True)
    print(f"{len(rows)} sessions, {made} reprocessed")
    return list(rows.values())


def main():
    shard = sys.argv[1]
    run, keep = json.loads((STATE / "run.json").read_text()), int((STATE / "keep.txt").read_text())
    lines = (STATE / "shards" / f"{shard}.list").read_text().splitlines()
    (STATE / "locks").mkdir(exist_ok=True)
    with open(STATE / "locks" / shard, "w") as lock:
        # A job that the cluster gave up may still be at work.
        fcntl.flock(lock, fcntl.LOCK_EX)
        rows = reprocess(run, shard, dict(line.split("\t") for line in lines), lock, keep)
    write_whole(STATE / "rows" / f"{shard}.csv", table(ALL, rows))


if __name__ == "__main__":
    main()
