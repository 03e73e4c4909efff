# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What sessions are reprocessed with."""
import subprocess
from pathlib import Path

from files import digest, file_digest

PROGRAMS = ["vlp-intrinsics", "vlp-train", "vlp-rotation", "vlp-dispersion", "vlp-locate", "vlp-evaluate"]


def toolbox(folder):
    """The version that the programs state, and a digest of them and of the chain."""
    stated = subprocess.run([folder / PROGRAMS[0], "--version"], capture_output=True, text=True, check=True).stdout
    here = Path(__file__).parent
    chain = [here / name for name in ("session.smk", "stage.sh", "station.py", "outcome.py")]
    files = [folder / program for program in PROGRAMS] + chain
    return {"version": stated.split()[-1], "toolbox": digest("".join(file_digest(file) for file in files))}
