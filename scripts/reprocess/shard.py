# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Reprocesses the sessions of a shard that are not current, in RESULTS, and writes the shard's rows.

The key of a session is a digest of its inputs, the toolbox and the options. It excludes --session-gates, which are
applied to the rows (summary.py). The results of a session are in sessions/CAMERA/SESSION, or in failed/CAMERA/SESSION
if it has no result, with row.json, which has the key and the row of the session. A folder is written atomically: it is
made in .state/work and moved.
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

from catalogue import input_digests
from files import digest, file_digest, json_text, read_table, table, write_atomically
from outcome import SHARD_COLUMNS, KEPT_FILES, read_outcome
from plausibility import WITHOUT_RESULT, count_inputs, format_counts

STATE = Path(".state")
TIME_LIMIT_S = 3600
COPYABLE = ("boards", "rotation", "dispersion", "check")  # inputs that no two sessions share


def result_folder(name, verdict):
    return Path("failed" if verdict in WITHOUT_RESULT else "sessions") / name


def compute_key(inputs, run):
    return digest(json_text([inputs, run["toolbox"], run["camera"]]))


def read_row(place):
    """Returns the row of a result; None if it cannot be read, or if it or a file of the result was changed."""
    try:
        row = json.loads((place / "row.json").read_text())
        is_unchanged = row.pop("checksum", None) in (None, digest(json_text(row)))
        is_intact = all(file_digest(place / file) == was for file, was in row.get("results", {}).items())
        return row if is_unchanged and is_intact else None
    except (OSError, ValueError):
        return None


def find_current_row(name, key):
    """Returns the row of the existing result with this key; None if there is none, or if the session crashed."""
    rows = (read_row(Path(place) / name) for place in ("sessions", "failed"))
    return next((row for row in rows if row and row["key"] == key and row["verdict"] != "crashed"), None)


class BatchProcess:
    """Process of vlp-calibrate --batch-stdin. It forks for each session, so that its libraries are loaded only once. It
    inherits the lock and may outlive this script by one session; its children do not outlive it."""

    def __init__(self, program, lock):
        self.program, self.lock, self.process = program, lock, None

    def ask(self, arguments):
        """Starts a session. Call answer() before the next one."""
        if self.process is None:
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "pass_fds": [self.lock.fileno()]}
            self.process = subprocess.Popen([self.program, "--batch-stdin"], **pipes)
        request = json.dumps({"arguments": [str(argument) for argument in arguments], "limit_s": TIME_LIMIT_S})
        try:
            self.process.stdin.write(request.encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # answer() reports the end of the process

    def answer(self):
        """Returns exit code (or the negative number of the signal that ended it), processor time in seconds, and the
        end of the output of the session."""
        answer = self.process.stdout.readline()
        if answer.endswith(b"\n"):
            answer = json.loads(answer)
            return answer["exit_code"], answer["cpu_s"], answer["output"]
        return self.end(), 0, ""

    def end(self):
        process, self.process = self.process, None
        if process is not None:
            process.communicate()
            return process.returncode

    def kill(self):
        """Kills the process and the session that it runs."""
        if self.process is not None:
            self.process.kill()
            self.end()


def start_session(run, each, name, work):
    """Starts vlp-calibrate on a session."""
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "session.json").unlink(missing_ok=True)  # from an interrupted run
    arguments = [Path(run["archive"]) / name, "-o", folder, "--quiet", "--no-report", "--threads", "1"]
    arguments += [f"--camera-id={name.split('/')[0]}", *shlex.split(run["camera"])]
    each.ask(arguments)


def link_or_copy(source, target):
    """Links the file, or copies it if links are not supported: data that is on the disk is not written again."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


def delete_result(result, name):
    """Deletes a result. It is renamed first, so that an incomplete folder is never treated as a result."""
    old = STATE / "old" / name
    shutil.rmtree(old, ignore_errors=True)
    old.parent.mkdir(parents=True, exist_ok=True)
    result.rename(old)
    shutil.rmtree(old)


def archive_result(place, name, keep):
    """Moves a former result to former/KEY. Deletes it if none is kept, if it crashed, or if it was changed."""
    row = read_row(place) if keep > 0 else None
    if not row or row["verdict"] == "crashed":
        return delete_result(place, name)
    kept = Path("former") / name / row["key"][:12]
    kept.parent.mkdir(parents=True, exist_ok=True)
    if kept.exists():
        delete_result(kept, name)
    place.rename(kept)


def delete_old_results(name, keep):
    """Deletes all former results except the last `keep`. If none of these has a result, the last one with a result
    replaces the oldest of them, so that a lost result remains available."""
    formers = sorted((Path("former") / name).glob("*/row.json"), key=lambda row: row.stat().st_mtime_ns)
    verdicts = {file: (read_row(file.parent) or {"verdict": "crashed"})["verdict"] for file in formers}
    usable = [file for file in formers if verdicts[file] not in WITHOUT_RESULT]
    kept = formers[max(0, len(formers) - keep) :]
    if kept and usable and usable[-1] not in kept:
        kept[0] = usable[-1]
    for file in formers:
        if file not in kept:
            delete_result(file.parent, name)


def publish(row, work, keep=0):
    """Moves the results of a session to their folder and keeps `keep` former ones. The work folder is unchanged, so
    that the call can be repeated."""
    name = f"{row['camera']}/{row['session']}"
    ready = STATE / "ready" / name
    shutil.rmtree(ready, ignore_errors=True)
    ready.mkdir(parents=True)
    for file in KEPT_FILES:
        if (work / name / file).is_file():
            link_or_copy(work / name / file, ready / KEPT_FILES[file])
    row = row | {"results": {file.name: file_digest(file) for file in ready.iterdir()}}
    write_atomically(ready / "row.json", json_text(row | {"checksum": digest(json_text(row))}))
    place = result_folder(name, row["verdict"])
    place.parent.mkdir(parents=True, exist_ok=True)
    for former in (Path("sessions") / name, Path("failed") / name):
        if former.exists():
            archive_result(former, name, keep)
    ready.rename(place)
    delete_old_results(name, keep)
    return sum(file.stat().st_size for file in place.iterdir())


def append_line(folder, shard, *words):
    (STATE / folder).mkdir(exist_ok=True)
    with open(STATE / folder / shard, "a") as log:
        log.write("\t".join(words) + "\n")


def expect_inputs(name, inputs, counts):
    """Returns the columns `files`, the number of files of each input, `expected`, the largest one so far, and
    `former_inputs`, the last other digest of the inputs."""
    old = read_row(Path("sessions") / name) or read_row(Path("failed") / name) or {}
    expected = format_counts(count_inputs(old.get("expected", "")) | counts)
    former = old["inputs"] if old.get("inputs", inputs) != inputs else old.get("former_inputs", "")
    return {"files": format_counts(counts), "expected": expected, "former_inputs": former}


def read_previous_rows(shard):
    """Returns {CAMERA/SESSION: row} of the previous run; empty if the rows cannot be read."""
    try:
        return {f"{row['camera']}/{row['session']}": row for row in read_table(STATE / "rows" / f"{shard}.csv")}
    except (FileNotFoundError, KeyError):
        return {}


def reprocess(run, shard, fingerprints, lock, keep):
    """Processes the sessions that are not current, and returns all rows. fingerprints: {CAMERA/SESSION: fingerprint of
    its files}; an unchanged fingerprint implies unchanged inputs. While vlp-calibrate runs, the results of the previous
    session are moved and the inputs of the next one are checked, because both mostly wait for the disk."""
    work = (STATE / "work" / shard).absolute()
    each = BatchProcess(Path(run["bin"]) / "vlp-calibrate", lock)
    before, rows, made, at_work = read_previous_rows(shard), {}, 0, None

    def finish(name, known, unreadable, answer):
        exit_code, seconds, output = answer
        row = read_outcome(work / name, name, exit_code, output.replace(run["archive"] + "/", "")) | known
        if unreadable:
            row["remarks"] = "; ".join(filter(None, [row.get("remarks"), *unreadable]))
            row["verdict"] = "review" if row["verdict"] == "pass" else row["verdict"]
        if "gates.yaml" in known["parts"] and "gate_metrics" in row:
            row["gate_metrics"] = ""
        cost = f"{seconds:.3f}"
        append_line("costs", shard, name, cost, f"{time.time():.3f}")  # a session may move to another shard
        size = publish(row, work, keep)
        append_line("ran", shard, name, row["verdict"], cost, str(size))  # also if the run is killed and continued
        shutil.rmtree(work / name)
        rows[name] |= row

    try:
        for name, fingerprint in fingerprints.items():
            row, known = None, before.get(name)
            if known and known.get("fingerprint") == fingerprint:
                row = find_current_row(name, compute_key(known["inputs"], run))
            if row is None:
                inputs, parts, counts, unreadable = input_digests(Path(run["archive"]) / name)
                key = compute_key(inputs, run)
                row = find_current_row(name, key)
            rows[name] = (row or {}) | {"fingerprint": fingerprint}
            if row is None:
                answer = each.answer() if at_work else None
                start_session(run, each, name, work)
                if at_work:
                    finish(*at_work, answer)
                known = {"key": key, "inputs": inputs, "parts": parts, "version": run["version"]}
                known |= {"options": run["camera"], "toolbox": run["toolbox"][:12]}
                at_work = name, known | expect_inputs(name, inputs, counts), unreadable
                made += 1
        if at_work:
            finish(*at_work, each.answer())
        each.end()
    finally:
        each.kill()  # after an error it still runs a session
    shutil.rmtree(work, ignore_errors=True)
    print(f"{len(rows)} sessions, {made} reprocessed")
    return list(rows.values())


def main():
    shard = sys.argv[1]
    run, keep = json.loads((STATE / "run.json").read_text()), int((STATE / "keep.txt").read_text())
    lines = (STATE / "shards" / f"{shard}.list").read_text().splitlines()
    (STATE / "locks").mkdir(exist_ok=True)
    with open(STATE / "locks" / shard, "w") as lock:
        # A job that the cluster abandoned may still run.
        fcntl.flock(lock, fcntl.LOCK_EX)
        rows = reprocess(run, shard, dict(line.split("\t") for line in lines), lock, keep)
    for row in rows:
        row["copyable"] = json.dumps({part: row["parts"][part][:16] for part in COPYABLE if part in row["parts"]})
    write_atomically(STATE / "rows" / f"{shard}.csv", table(SHARD_COLUMNS, rows))


if __name__ == "__main__":
    main()
