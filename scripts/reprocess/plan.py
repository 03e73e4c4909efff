# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Lists the sessions of an archive in shards, and says what they are reprocessed with.

Writes into RESULTS/.state: run.json (toolbox and options), catalogue.sqlite (catalogue.py), shards/N.list (a
session a line, with the glance at its files), shards.txt (how many), to_do.txt (the shards that Snakemake has to know
of), again.txt (rows to make again), dates.csv (dates and rooms of sessions), compare.json (earlier results, gates,
sessions that vanished), keep.txt (how many former results stay) and session_gates.json (limits of --session-gates). The
last two are no reason to run a shard again. What has not changed is not touched, so that Snakemake runs the rest.
"""
import argparse
import gc
import re
import shutil
import sqlite3
import time
from pathlib import Path

from catalogue import LOOKS, Catalogue
from checks import INCOMPLETE, check, fail
from dates import dates_of
from files import digest, json_text, table, write_if_other, write_whole
from layout import LAYOUT, check_layout, describe_wrong_level, sessions_in
from session_gates import read_limits
from toolbox import toolbox


def results_in(results):
    """Returns the sessions that have a folder in RESULTS."""
    places = [results / place for place in ("sessions", "failed")]
    return {name for place in places if place.is_dir() for name in sessions_in(place)}


def shard_ends(sessions, size, at_a_time):
    """Where each shard ends. Few of them are made alike in length and as many as end together, so that no
    core waits for the last; of many, all but the last stay as they are when sessions are added."""
    count = -(-sessions // size)
    if count >= 8 * at_a_time:
        return [min(end, sessions) for end in range(size, sessions + size, size)]
    count = min(sessions, -(-count // at_a_time) * at_a_time)
    return [sessions * (i + 1) // count for i in range(count)]


def shards_of(sessions, catalogue, size, at_a_time):
    """{number: sessions}. Where there are many, a session stays in its shard, so that new ones do not move the others
    to other shards: they fill the last one, and go to further ones."""
    if len(sessions) < 8 * at_a_time * size or catalogue.stated.get("shard_size") != str(size):
        ends = shard_ends(len(sessions), size, at_a_time)
        return {number: sessions[first:end] for number, (first, end) in enumerate(zip([0, *ends], ends))}
    shards, new = {}, []
    for name in sessions:
        number = catalogue.shard_of(name)
        if number is None:
            new.append(name)
        else:
            shards.setdefault(number, []).append(name)
    last = max(shards, default=0)
    for name in new:
        if len(shards.get(last, [])) >= size:
            last += 1
        shards.setdefault(last, []).append(name)
    return {number: sorted(names) for number, names in sorted(shards.items())}


def list_sessions(archive):
    """Exits if there are none or if none has inputs, so that earlier results are kept."""
    sessions = sessions_in(archive)
    if not sessions:
        fail(f"{archive}: no sessions in it; " + (describe_wrong_level(archive) or LAYOUT))
    well_named = re.compile(r"\w[\w .-]*/\w[\w .-]*", re.ASCII)
    for name in sessions:
        if not well_named.fullmatch(name):
            fail(f"{archive / name}: names of cameras and sessions are of letters, digits, '.', '_', '-' and blanks")
    if problem := check_layout(archive, sessions):
        fail(problem, INCOMPLETE)
    return sessions


def write_shards(archive, sessions, state, options):
    dates = dates_of(archive, sessions)
    write_if_other(state / "dates.csv", table(["camera", "session", "date", "room"], dates))
    catalogue = Catalogue(state / "catalogue.sqlite", archive, options.rebuild_catalogue)
    look = options.scan or catalogue.look_for(len(sessions))
    seen = dict(zip(sessions, catalogue.glances(sessions, look)))
    shards = shards_of(sessions, catalogue, options.shard_size, options.at_a_time)
    wanted = set()
    for number, names in shards.items():
        file = state / "shards" / f"{number:06d}.list"
        wanted.add(file.name)
        write_if_other(file, "".join(f"{name}\t{seen[name]}\n" for name in names))
    for file in (state / "shards").glob("*.list"):
        if file.name not in wanted:
            file.unlink()
    write_if_other(state / "shards.txt", f"{len(wanted)}\n")
    catalogue.save(shards, options.shard_size)
    return looked_at(catalogue, look)


def looked_at(catalogue, look):
    if look == "files":
        return "checked all files"
    if not catalogue.all_files_at_ns():
        return "checked folders and tables, never all files"
    day = time.strftime("%Y-%m-%d", time.localtime(catalogue.all_files_at_ns() / 1e9))
    return f"checked folders and tables, all files last on {day}"


def changed_at(file):
    """None without it."""
    try:
        return file.stat().st_mtime_ns
    except FileNotFoundError:
        return None


def to_do(state, summary):
    """The shards that Snakemake has to know of, and of them those to run whatever it thinks. Of the others the rows are
    later than list and options, and in the summary. To run are those whose rows are missing beside a summary, and
    those with crashes, which may have been for want of memory or disk."""
    options, summed_up = changed_at(state / "run.json"), changed_at(summary)
    known, again = [], []
    for file in sorted((state / "shards").glob("*.list")):
        rows = state / "rows" / f"{file.stem}.csv"
        made = changed_at(rows)
        if (made is None and summed_up is not None) or (made is not None and b",crashed," in rows.read_bytes()):
            again.append(file.stem)
        elif made is not None and summed_up is not None and max(changed_at(file), options) <= made <= summed_up:
            continue
        known.append(file.stem)
    return known, again


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("archive", type=Path)
    parser.add_argument("results", type=Path)
    parser.add_argument("--bin", type=Path, required=True)
    parser.add_argument("--gates", type=Path)
    parser.add_argument("--session-gates", type=Path)
    parser.add_argument("--previous", type=Path)
    parser.add_argument("--keep", type=int, default=1)
    parser.add_argument("--shard-size", type=int, default=50)
    parser.add_argument("--at-a-time", type=int, default=1)
    parser.add_argument("--scan", choices=LOOKS)
    parser.add_argument("--rebuild-catalogue", action="store_true")
    parser.add_argument("--camera-option", action="append", default=[])
    options = parser.parse_args()
    archive, results = options.archive.resolve(), options.results.resolve()
    check(options)
    sessions = list_sessions(archive)
    state = results / ".state"
    (state / "logs").mkdir(parents=True, exist_ok=True)  # a cluster's jobs find it
    shutil.rmtree(state / "ran", ignore_errors=True)
    write_whole(state / "started", f"{time.time():.3f}\n")
    run = {
        "archive": str(archive),
        "bin": str(options.bin.resolve()),
        "camera": " ".join(options.camera_option),
        **toolbox(options.bin),
    }
    looked = write_shards(archive, sessions, state, options)
    limits = read_limits(options.session_gates) if options.session_gates else {}
    write_if_other(state / "session_gates.json", json_text(limits))
    write_if_other(state / "keep.txt", f"{options.keep}\n")
    write_if_other(state / "run.json", json_text(run))
    known, again = to_do(state, results / "summary.csv")
    write_whole(state / "to_do.txt", "".join(f"{shard}\n" for shard in known))
    write_whole(state / "again.txt", "".join(f".state/rows/{shard}.csv\n" for shard in again))
    previous = options.previous.resolve() if options.previous else None
    compare = {
        "previous": str(previous) if previous else "",
        "previous_digest": digest((previous / "summary.csv").read_text()) if previous else "",
        "gates": str(options.gates.resolve()) if options.gates else "",
        "gates_digest": digest(options.gates.read_text()) if options.gates else "",
        "vanished": sorted(results_in(results) - set(sessions)),
    }
    write_if_other(state / "compare.json", json_text(compare))
    print(f"{len(sessions)} sessions in {archive}; {looked}")


if __name__ == "__main__":
    gc.disable()  # of an archive's many names and glances none go in circles
    try:
        main()
    except (OSError, UnicodeDecodeError, ValueError) as failure:
        fail(failure)
    except sqlite3.Error as failure:
        fail(f".state/catalogue.sqlite: {failure}")
