#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Measures the time and memory of scripts/reprocess.sh without the calibrations, for an archive of 100,000 sessions:
plan, summary, overview.

    reprocess_scale.py [--sessions N] [--changed N] [--keep FOLDER] [--limits]

Sessions have the folders and files of datasets/archive, 63 of them inputs, all empty. Their results are simulated
(tests/reprocess/made_up_fleet.py): fleets of 20 cameras with 10 sessions each in two rooms. Works in a temporary
folder, in which 100,000 sessions need 4 GB and 7 million inodes; --keep FOLDER uses and keeps that folder. Prints
processor time, user and system, and elapsed time, which are not representative for network file systems. --limits: exit
code 1 if a limit is exceeded.
"""
import argparse
import json
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(__file__).resolve().parents[2]
SCRIPTS = SOURCE / "scripts/reprocess"
sys.path[:0] = [str(SCRIPTS), str(SOURCE / "tests/reprocess")]
try:
    import snakemake  # noqa: F401
    import yaml  # noqa: F401
except ImportError:
    print("snakemake is missing: scripts/setup.sh --batch")
    sys.exit(77)
import files
import outcome
from made_up_fleet import Fleet

FILES = ["board.yaml", "lamps.yaml"] + [f"boards/{i:04d}.png" for i in range(20)]
FILES += ["boards/true_boards.csv", "boards/true_corners.csv"]
for folder, images in (("rotation", 12), ("dispersion", 6), ("check", 12)):
    FILES += [f"{folder}/{i:04d}.png" for i in range(images)]
    FILES += [f"{folder}/{name}.csv" for name in ("captures", "true_detections", "truth")]
FOLDERS = ["boards", "rotation", "dispersion", "check"]
IN_A_FLEET = 200
# Limits for 100,000 sessions: seconds of processor time, and MB.
SETTLED_S = 2.5  # changes within two seconds of a scan are scanned again the next time
LIMITS = {"plan, unchanged": (5, 500), "plan, changed": (6, 500), "summary and overview": (20, None), "other session gates": (30, None)}


def make_archive(archive, names):
    for name in names:
        for folder in FOLDERS:
            os.makedirs(archive / name / folder)
        inside = os.open(archive / name, os.O_RDONLY)
        for file in FILES:
            os.close(os.open(file, os.O_CREAT | os.O_WRONLY, 0o644, dir_fd=inside))
        os.close(inside)


def made_up_metrics(chance, mean_mm):
    """As many metrics and gates as those of a session of datasets/archive."""
    names = ["rms_px", "expected_max_error_px", "coverage", "views", "board_tilt_deg", "split_half_px"]
    gates = dict(zip(names, (1.0, 2.0, 0.4, 6.0, 20.0, 1.0)))
    names += [f"metric_{number:02d}_mm" for number in range(20)]
    metrics = {name: chance.random() for name in names} | {"coverage": 1.0, "views": 20.0, "board_tilt_deg": 90.0}
    document = {"metrics": [{"name": name, "value": value} for name, value in (metrics | {"mean_mm": mean_mm}).items()]}
    return outcome.gate_metrics(document | {"gates": [{"name": name, "limit": gates[name]} for name in gates]})


def made_up(sessions):
    """CAMERA/SESSION and its row."""
    for number in range(-(-sessions // IN_A_FLEET)):
        fleet = Fleet(number, drifts={3: {"focal": (0.26, 0.26)}} if number % 10 == 0 else {})
        chance = random.Random(number)
        for camera, session, result in list(fleet.all())[: sessions - number * IN_A_FLEET]:
            row = outcome.read_calibration(result) | {"camera": f"{number:04d}-{camera}", "session": session}
            row |= {"verdict": "pass", "captures": 12, "fixes": 12, "missing_fraction": 0, "warnings": 0, "images_skipped": 0}
            row |= {name: f"{chance.lognormvariate(-1.4, 0.5):.6g}" for name in ("mean_mm", "median_mm", "p90_mm", "max_mm")}
            row["gate_metrics"] = made_up_metrics(chance, float(row["mean_mm"]))
            row |= {"rms_px": "0.02", "version": "1", "inputs": f"{chance.getrandbits(256):064x}", "cpu_s": "0.600"}
            row |= {"key": f"{chance.getrandbits(256):064x}", "map": f"{number:04d}" + row["map"][:8]}
            yield f"{row['camera']}/{session}", row


def measured(what, *command):
    """Runs it: seconds of processor time, and MB."""
    began = time.monotonic()
    with open(os.devnull, "wb") as nowhere:
        child = subprocess.Popen([str(word) for word in command], stdout=nowhere)
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"reprocess_scale.py: {what}: failed")
    cpu_s, mb = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
    print(f"{what:41} {cpu_s:7.2f} s of processor time, {time.monotonic() - began:7.2f} s, {mb:5.0f} MB", flush=True)
    return cpu_s, mb


def write_rows(state, rows):
    """As the shards' jobs leave them: a result and a row for each session of a list."""
    for file in sorted((state / "shards").glob("*.list")):
        listed = [line.split("\t") for line in file.read_text().splitlines()]
        for line in listed:
            place = state.parent / "sessions" / line[0]
            place.mkdir(parents=True, exist_ok=True)
            (place / "row.json").write_text("{}\n")  # older than its row: not changed since
        shard_rows = [rows[line[0]] | {"fingerprint": line[1]} for line in listed]
        files.write_atomically(state / "rows" / f"{file.stem}.csv", files.table(outcome.SHARD_COLUMNS, shard_rows))
        files.write_atomically(state / "costs" / file.stem, "".join(f"{line[0]}\t0.600\t1.000\n" for line in listed))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=100_000)
    parser.add_argument("--changed", type=int, default=100)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--limits", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="vlp-scale-") as temporary:
        sys.exit(run(options, Path(options.keep or temporary).resolve()))


def prepare(options, folder):
    rows = dict(made_up(options.sessions))
    if not (folder / "archive").exists():
        make_archive(folder / "archive", sorted(rows))
    files.write_atomically(folder / "rows.json", json.dumps(rows))


def reprocessed(folder):
    """As if the sessions had been: rows for the lists as they are."""
    write_rows(folder / "results/.state", json.loads((folder / "rows.json").read_text()))


def apart(function, *arguments):
    """In a process of its own: what is large here counts as the memory of each program that is started."""
    process = multiprocessing.Process(target=function, args=arguments)
    process.start()
    process.join()
    if process.exitcode != 0:
        sys.exit("reprocess_scale.py: failed")


def run(options, folder):
    archive, results = folder / "archive", folder / "results"
    apart(prepare, options, folder)
    took = {}
    bin_folder = Path(os.environ.get("VLP_PROGRAMS_DIR", SOURCE / "build/bin"))
    python = ["/usr/bin/python3", "-B"]
    plan = [*python, SCRIPTS / "plan.py", archive, results, "--bin", bin_folder, "--at-a-time", os.cpu_count() + 1]
    print(f"{options.sessions} sessions of {len(FILES)} files and {len(FOLDERS) + 1} folders")
    time.sleep(SETTLED_S)
    measured("plan, the first", *plan)
    apart(reprocessed, folder)
    files.write_atomically(results / "summary.csv", "")  # as if the summary existed
    measured("plan, unchanged, --scan files", *plan, "--scan", "files")
    took["plan, unchanged"] = measured("plan, unchanged", *plan)
    names = [f"{camera.name}/{session.name}" for camera in sorted(archive.iterdir()) for session in camera.iterdir()]
    some = names[:: max(1, len(names) // options.changed)][: options.changed]

    for name in some:
        (archive / name / "check/captures.csv").write_text(f"{time.time()}")
    time.sleep(SETTLED_S)
    took["plan, changed"] = measured(f"plan, {options.changed} changed", *plan)
    shards = len((results / ".state/to_do.txt").read_text().split())
    if not 0 < shards <= options.changed:
        sys.exit(f"reprocess_scale.py: {shards} shards are to do, and {options.changed} sessions have changed")
    apart(reprocessed, folder)
    os.chdir(results)
    one = measured("summary", *python, SCRIPTS / "summary.py")
    two = measured("overview, with the fleet", *python, SCRIPTS / "overview.py")
    took["summary and overview"] = (one[0] + two[0], max(one[1], two[1]))
    whole = [SOURCE / "scripts/reprocess.sh", archive, results]
    os.environ["VLP_PROGRAMS_DIR"] = str(bin_folder)
    measured("reprocess.sh, unchanged", *whole)
    if left := Path(".state/to_do.txt").read_text().split():
        sys.exit(f"reprocess_scale.py: {len(left)} shards are to do, and nothing has changed")
    session_gates = folder / "session_gates.yaml"
    files.write_atomically(session_gates, "format: vlp-gates/1\ngates: {mean_mm: 0.25}\n")
    files.write_atomically(folder / "gates.yaml", "format: vlp-archive-gates/1\ngates: {gate_fraction: 1}\n")
    took["other session gates"] = measured("reprocess.sh, other session gates", *whole, "--session-gates", session_gates,
                                           "--gates", folder / "gates.yaml")
    counts = json.loads(Path("changes.json").read_text())["counts"]
    print(f"{counts['gate']} of {counts['sessions']} sessions miss a gate")
    if not 0 < counts["gate"] < counts["sessions"] or Path(".state/ran").exists():
        sys.exit("reprocess_scale.py: the session gates were not applied, or sessions were calibrated again")
    found = json.loads(Path("changes.json").read_text())["fleet"]
    print(f"{len(found['cameras'])} cameras changed, {len(found['lamps'])} lamps were moved")
    missed = 0
    for what, (most_s, most_mb) in LIMITS.items():
        cpu_s, mb = took[what]
        kept = cpu_s <= most_s and (most_mb is None or mb <= most_mb)
        missed += not kept
        print(f"{what:41} {'kept' if kept else 'NOT KEPT'}: at most {most_s} s" + (f", {most_mb} MB" if most_mb else ""))
    return int(options.limits and missed > 0)


if __name__ == "__main__":
    main()
