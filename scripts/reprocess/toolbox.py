# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What sessions are reprocessed with."""
import subprocess
from pathlib import Path

from files import digest, file_digest

PROGRAMS = ["vlp-calibrate", "vlp-evaluate"]  # the second compares captures for the overview


def toolbox(folder):
    """The version that vlp-calibrate states, and a digest of it and of what reads its results."""
    program = folder / PROGRAMS[0]
    # At the same time: a start takes a fifth of a second, of which the libraries are most.
    nothing = subprocess.DEVNULL
    with subprocess.Popen([program, "--batch-stdin"], stdin=nothing, stdout=nothing, stderr=nothing) as each:
        stated = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if each.returncode != 0:
        raise ValueError(f"{program}: vlp-calibrate is too old for these scripts")
    files = [program, Path(__file__).parent / "outcome.py"]
    return {"version": stated.split()[-1], "toolbox": digest("".join(file_digest(file) for file in files))}
