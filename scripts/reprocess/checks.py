# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Checks the options of scripts/reprocess.sh; version and digest of the programs that it runs."""
import subprocess
import sys
from pathlib import Path

from changes import read_gates
from files import digest, file_digest, read_table

PROGRAM = "vlp-calibrate"
BAD_INPUT, INCOMPLETE = 2, 3  # exit codes of reprocess.sh


def fail(message, code=BAD_INPUT):
    print(f"reprocess.sh: error: {message}", file=sys.stderr)
    sys.exit(code)


def check_previous(previous, results):
    table = previous / "summary.csv"
    if not table.is_file():
        fail(f"{previous}: contains no summary.csv of an earlier run")
    if previous.resolve() == results.resolve():
        fail(f"{previous}: this run writes there; --previous is another folder, e.g. a copy")
    rows = read_table(table)
    if missing := {"camera", "session", "verdict", "mean_mm", "inputs"} - set(rows[0] if rows else ()):
        words = "is not the summary of an earlier run: a column is missing, or all rows"
        fail(f"{table}: {words}: {', '.join(sorted(missing))}")


def check_session_gates(options):
    """Checks the file of --session-gates with vlp-calibrate, which reports an invalid file before a missing session."""
    if options.session_gates:
        command = [options.bin / PROGRAM, "/dev/null", "-o", "/dev/null", "--gates", options.session_gates]
        errors = subprocess.run(command, capture_output=True, text=True, check=False).stderr.strip()
        if "error: /dev/null" not in errors:
            fail(errors.split("error: ", 1)[-1])


def check(options):
    """Reports invalid options before anything is run."""
    if not (options.bin / PROGRAM).is_file():
        fail(f"{options.bin / PROGRAM}: missing; run scripts/test.sh first")
    for file in (options.gates, options.session_gates):
        if file and not file.is_file():
            fail(f"{file}: is not a file")
    if options.gates:
        try:
            read_gates(options.gates)
        except ValueError as failure:
            fail(failure)
    if options.previous:
        check_previous(options.previous, options.results)
    check_session_gates(options)


def toolbox(folder):
    """Returns the version of vlp-calibrate, and a digest of it and of the script that reads its results."""
    stated = subprocess.run([folder / PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout
    files = [folder / PROGRAM, Path(__file__).parent / "outcome.py"]
    return {"version": stated.split()[-1], "toolbox": digest("".join(file_digest(file) for file in files))}
