# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Lists the sessions of an archive in shards, and says what they are reprocessed with.

Writes into RESULTS/.state: run.json (toolbox and options), shards/N.list (a session a line, with the
number, size and latest change of its files: a glance that tells which shards to look into), shards.txt
(how many), again.txt (rows to make again), keep.txt (how many former results stay; no reason to run a shard again),
dates.csv (dates and rooms of sessions) and compare.json. What has not changed is not touched, so that Snakemake
runs the rest.
"""
import argparse
import re
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from checks import check, fail
from dates import dates_of
from files import digest, input_files, json_text, table, write_if_other, write_whole
from toolbox import toolbox


def sessions_in(archive):
    for camera in sorted(archive.iterdir()):
        if camera.is_dir() and not camera.name.startswith("."):
            for session in sorted(camera.iterdir()):
                if session.is_dir() and not session.name.startswith("."):
                    yield f"{camera.name}/{session.name}"


def glance(session):
    count = size = latest = 0
    for _, entry in input_files(session):
        count += 1
        if entry.is_file():
            status = entry.stat()
            size, latest = size + status.st_size, max(latest, status.st_mtime_ns)
    return f"{count} {size} {latest}"


def shard_ends(sessions, size, at_a_time):
    """Where each shard ends. Few of them are made alike in length and as many as end together, so that no
    core waits for the last; of many, all but the last stay as they are when sessions are added."""
    count = -(-sessions // size)
    if count >= 8 * at_a_time:
        return [min(end, sessions) for end in range(size, sessions + size, size)]
    count = min(sessions, -(-count // at_a_time) * at_a_time)
    return [sessions * (i + 1) // count for i in range(count)]


def write_shards(archive, state, size, at_a_time):
    sessions = list(sessions_in(archive))
    if not sessions:
        fail(f"{archive}: no sessions in it; ARCHIVE/CAMERA/SESSION/ is where captures are looked for")
    for name in sessions:
        if not re.fullmatch(r"\w[\w .-]*/\w[\w .-]*", name, re.ASCII):
            fail(f"{archive / name}: names of cameras and sessions are of letters, digits, '.', '_', '-' and blanks")
    dates = dates_of(archive, sessions)
    write_if_other(state / "dates.csv", table(["camera", "session", "date", "room"], dates))
    with ThreadPoolExecutor(16) as threads:  # most of it is waiting for the file system
        glances = list(threads.map(lambda name: glance(archive / name), sessions))
    lines = [f"{name}\t{seen}\n" for name, seen in zip(sessions, glances)]
    wanted = set()
    first = 0
    for number, end in enumerate(shard_ends(len(sessions), size, at_a_time)):
        file = state / "shards" / f"{number:06d}.list"
        wanted.add(file)
        write_if_other(file, "".join(lines[first:end]))
        first = end
    for file in set((state / "shards").glob("*.list")) - wanted:
        file.unlink()
    write_if_other(state / "shards.txt", f"{len(wanted)}\n")
    return len(sessions)


def again(state, summary):
    """The rows to make whatever Snakemake thinks: those that are missing beside a summary, and those
    with crashes, which may have been for want of memory or disk."""
    rows = [state / "rows" / f"{file.stem}.csv" for file in sorted((state / "shards").glob("*.list"))]
    wanted = [file for file in rows if (",crashed," in file.read_text() if file.exists() else summary.exists())]
    return [f".state/rows/{file.name}\n" for file in wanted]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("archive", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--gates", type=Path)
    parser.add_argument("--session-gates", type=Path)
    parser.add_argument("--previous", type=Path)
    parser.add_argument("--keep", type=int, default=0)
    parser.add_argument("--shard-size", type=int, default=50)
    parser.add_argument("--at-a-time", type=int, default=1)
    parser.add_argument("--camera-option", action="append", default=[])
    options = parser.parse_args()
    archive, results = options.archive.resolve(), options.results.resolve()
    check(options)
    state = results / ".state"
    (state / "logs").mkdir(parents=True, exist_ok=True)  # a cluster's jobs find it
    shutil.rmtree(state / "ran", ignore_errors=True)
    write_whole(state / "started", f"{time.time():.3f}\n")
    run = {
        "archive": str(archive),
        "bin": str(options.bin.resolve()),
        "camera": " ".join(options.camera_option),
        "session_gates": str(options.session_gates.resolve()) if options.session_gates else "",
        "session_gates_digest": digest(options.session_gates.read_text()) if options.session_gates else "",
        **toolbox(options.bin),
    }
    count = write_shards(archive, state, options.shard_size, options.at_a_time)
    write_whole(state / "again.txt", "".join(again(state, results / "summary.csv")))
    write_if_other(state / "keep.txt", f"{options.keep}\n")
    write_if_other(state / "run.json", json_text(run))
    previous = options.previous.resolve() if options.previous else None
    compare = {
        "previous": str(previous) if previous else "",
        "previous_digest": digest((previous / "summary.csv").read_text()) if previous else "",
        "gates": str(options.gates.resolve()) if options.gates else "",
        "gates_digest": digest(options.gates.read_text()) if options.gates else "",
    }
    write_if_other(state / "compare.json", json_text(compare))
    print(f"{count} sessions in {archive}")


if __name__ == "__main__":
    try:
        main()
    except (OSError, UnicodeDecodeError, ValueError) as failure:
        fail(failure)
