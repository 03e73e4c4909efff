# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Assigns the sessions of an archive to shards and writes the plan of a run to RESULTS/.state.

  run.json            toolbox and options
  catalogue.sqlite    see catalogue.py
  shards/N.list       one line per session, with the fingerprint of its files
  shards.txt          number of shards
  to_do.txt           shards that Snakemake has to consider
  again.txt           rows to make again
  dates.csv           dates, rooms and expected files of sessions
  compare.json        earlier results, gates, vanished sessions, faults of the layout
  keep.txt            number of former results to keep
  session_gates.json  limits of --session-gates

A change of the last two does not cause a shard to run again. Files without changes are not written, so that Snakemake
runs only what depends on changed ones.
"""
import argparse
import gc
import shutil
import sqlite3
import stat
import time
from pathlib import Path

import run_page
from catalogue import SCANS, Catalogue
from checks import INCOMPLETE, check, fail, toolbox
from dates import read_dates
from files import digest, json_text, print_lines, table, write_if_changed, write_atomically
from layout import LAYOUT, check_layout, describe_wrong_level, list_sessions_in
from session_gates import read_limits


def list_results(results):
    """Returns the sessions that have a folder in RESULTS."""
    places = [results / place for place in ("sessions", "failed")]
    return {name for place in places if place.is_dir() for name in list_sessions_in(place, [])}


def compute_shard_ends(sessions, size, at_a_time):
    """Returns the end of each shard. A small number of shards have equal lengths and are a multiple of `at_a_time`, so
    that all cores finish together. Of many, all but the last stay unchanged when sessions are added."""
    count = -(-sessions // size)
    if count >= 8 * at_a_time:
        return [min(end, sessions) for end in range(size, sessions + size, size)]
    count = min(sessions, -(-count // at_a_time) * at_a_time)
    return [sessions * (i + 1) // count for i in range(count)]


def assign_shards(sessions, catalogue, size, at_a_time):
    """Returns {number: sessions}. In a large archive a session stays in its shard; new sessions fill the last shard and
    then further ones."""
    if len(sessions) < 8 * at_a_time * size or catalogue.settings.get("shard_size") != str(size):
        ends = compute_shard_ends(len(sessions), size, at_a_time)
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
    """Lists the sessions, and the faults of the layout. Exits if there are no sessions or if none has inputs, so that
    earlier results are kept."""
    faults = []
    sessions = list_sessions_in(archive, faults)
    if not sessions:
        # [ARCHIVE-1] `no sessions in` | ARCHIVE is a camera, a session or the folder above | stated folder
        fail(f"{archive}: no sessions in it; " + "; ".join([*faults, describe_wrong_level(archive) or LAYOUT]))
    if problem := check_layout(archive, sessions):
        fail(problem, INCOMPLETE)
    return sessions, faults


def write_shards(archive, sessions, state, options):
    """Returns a description of the scan, missing sessions, and shards with changed results."""
    dates, missing = read_dates(archive, sessions)
    write_if_changed(state / "dates.csv", table(["camera", "session", "date", "room", "files"], dates))
    catalogue = Catalogue(state / "catalogue.sqlite", archive, options.rebuild_catalogue)
    look = options.scan or catalogue.choose_scan(len(sessions))
    seen = dict(zip(sessions, catalogue.fingerprints(sessions, look)))
    shards = assign_shards(sessions, catalogue, options.shard_size, options.at_a_time)
    wanted = set()
    for number, names in shards.items():
        file = state / "shards" / f"{number:06d}.list"
        wanted.add(file.name)
        write_if_changed(file, "".join(f"{name}\t{seen[name]}\n" for name in names))
    for file in (state / "shards").glob("*.list"):
        if file.name not in wanted:
            file.unlink()
    write_if_changed(state / "shards.txt", f"{len(wanted)}\n")
    catalogue.save(shards, options.shard_size)
    changed = find_changed_results(state.parent, shards) if look == "files" else {}
    names = [name for names in changed.values() for name in names]
    more = f" and {len(names) - 5} more" * (len(names) > 5)
    words = f"; missing or changed results: {'; '.join(names[:5])}{more}" * bool(names)
    return describe_scan(catalogue, look) + words, missing, changed


def describe_scan(catalogue, look):
    at_s = catalogue.all_files_at_ns() / 1e9
    last = f"all files last on {time.strftime('%Y-%m-%d', time.localtime(at_s))}" if at_s else "never all files"
    return "checked all files" if look == "files" else f"checked folders and tables, {last}"


def modification_time_ns(file):
    """Returns the modification time in ns; None if the file does not exist."""
    return file.stat().st_mtime_ns if file.exists() else None


def find_changed_results(results, shards):
    """Returns {number of a shard: sessions} whose results are missing, or were changed since its rows were written."""
    changed = {}
    for number, names in shards.items():
        made_ns = modification_time_ns(results / f".state/rows/{number:06d}.csv")
        for name in names if made_ns else ():
            places = [place for place in (results / "sessions" / name, results / "failed" / name) if place.is_dir()]
            found = [file.stat() for place in places for file in (place, *place.iterdir())]
            is_empty = any(one.st_size == 0 and stat.S_ISREG(one.st_mode) for one in found)
            if not found or is_empty or any(one.st_mtime_ns > made_ns for one in found):
                changed.setdefault(number, []).append(name)
    return changed


def list_pending_shards(state, summary, changed=()):
    """Returns the shards that Snakemake has to consider, and those of them that have to run in any case. The rows of
    all other shards are newer than list and options, and older than the summary. Shards run in any case if their rows
    are missing although there is a summary, if a result was changed, or if sessions crashed, which may have lacked
    memory or disk space."""
    options, summed_up = modification_time_ns(state / "run.json"), modification_time_ns(summary)
    known, again = [], []
    for file in sorted((state / "shards").glob("*.list")):
        rows = state / "rows" / f"{file.stem}.csv"
        made = modification_time_ns(rows)
        crashed = made is not None and b",crashed," in rows.read_bytes()
        if (made is None and summed_up is not None) or crashed or int(file.stem) in changed:
            again.append(file.stem)
        elif None not in (made, summed_up) and max(modification_time_ns(file), options) <= made <= summed_up:
            continue
        known.append(file.stem)
    return known, again


def main():
    parser = argparse.ArgumentParser()
    for name in ("archive", "results", "--bin", "--gates", "--session-gates", "--previous"):
        parser.add_argument(name, type=Path)
    for name, default in (("--keep", 1), ("--shard-size", 50), ("--at-a-time", 1)):
        parser.add_argument(name, type=int, default=default)
    parser.add_argument("--scan", choices=SCANS)
    parser.add_argument("--rebuild-catalogue", action="store_true")
    parser.add_argument("--camera-option", action="append", default=[])
    options = parser.parse_args()
    archive, results = options.archive.resolve(), options.results.resolve()
    check(options)
    sessions, faults = list_sessions(archive)
    state = results / ".state"
    (state / "logs").mkdir(parents=True, exist_ok=True)  # jobs of a cluster need it
    shutil.rmtree(state / "ran", ignore_errors=True)
    write_atomically(state / "started", f"{time.time():.3f}\n")
    run = {
        "archive": str(archive),
        "bin": str(options.bin.resolve()),
        "camera": " ".join(options.camera_option),
        **toolbox(options.bin),
    }
    looked, missing, changed = write_shards(archive, sessions, state, options)
    limits = read_limits(options.session_gates) if options.session_gates else {}
    write_if_changed(state / "session_gates.json", json_text(limits))
    write_if_changed(state / "keep.txt", f"{options.keep}\n")
    write_if_changed(state / "run.json", json_text(run))
    known, again = list_pending_shards(state, results / "summary.csv", changed)
    write_atomically(state / "to_do.txt", "".join(f"{shard}\n" for shard in known))
    write_atomically(state / "again.txt", "".join(f".state/rows/{shard}.csv\n" for shard in again))
    previous = options.previous.resolve() if options.previous else None
    compare = {
        "previous": str(previous) if previous else "",
        "previous_digest": digest((previous / "summary.csv").read_text()) if previous else "",
        "gates": str(options.gates.resolve()) if options.gates else "",
        "gates_digest": digest(options.gates.read_text()) if options.gates else "",
        "vanished": sorted((list_results(results) | set(missing)) - set(sessions)),
        "faults": faults,
    }
    write_if_changed(state / "compare.json", json_text(compare))
    run_page.write(results)
    print_lines([f"{len(sessions)} sessions in {archive}; {looked}"])


if __name__ == "__main__":
    gc.disable()  # saves time: names and fingerprints have no reference cycles
    try:
        main()
    except (OSError, UnicodeDecodeError, ValueError) as failure:
        fail(failure)
    except sqlite3.Error as failure:
        fail(f".state/catalogue.sqlite: {failure}")
