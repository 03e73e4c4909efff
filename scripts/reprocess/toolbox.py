# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What sessions are reprocessed with."""
import subprocess
import sys
from pathlib import Path

from files import digest, file_digest

PROGRAMS = ["vlp-intrinsics", "vlp-train", "vlp-rotation", "vlp-dispersion", "vlp-locate", "vlp-evaluate"]


def toolbox(folder):
    """The version that the programs state, and a digest of them and of the chain."""
    for program in PROGRAMS:
        if not (folder / program).is_file():
            print(f"reprocess.sh: error: {folder / program}: missing; run scripts/test.sh first", file=sys.stderr)
            sys.exit(2)
    stated = subprocess.run([folder / PROGRAMS[0], "--version"], capture_output=True, text=True, check=True).stdout
    here = Path(__file__).parent
    files = [folder / program for program in PROGRAMS] + [here / "session.smk", here / "stage.sh"]
    return {"version": stated.split()[-1], "toolbox": digest("".join(file_digest(file) for file in files))}
