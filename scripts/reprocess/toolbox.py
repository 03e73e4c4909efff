# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Version and digest of the programs with which sessions are reprocessed."""
import subprocess
from pathlib import Path

from files import digest, file_digest

PROGRAMS = ["vlp-calibrate", "vlp-evaluate"]  # the second compares captures for the overview


def toolbox(folder):
    """Returns the version of vlp-calibrate, and a digest of it and of the script that reads its results."""
    program = folder / PROGRAMS[0]
    # Both run in parallel, because a start takes 0.2 s, mostly to load libraries.
    nothing = subprocess.DEVNULL
    with subprocess.Popen([program, "--batch-stdin"], stdin=nothing, stdout=nothing, stderr=nothing) as each:
        stated = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if each.returncode != 0:
        raise ValueError(f"{program}: vlp-calibrate is too old for these scripts")
    files = [program, Path(__file__).parent / "outcome.py"]
    return {"version": stated.split()[-1], "toolbox": digest("".join(file_digest(file) for file in files))}
