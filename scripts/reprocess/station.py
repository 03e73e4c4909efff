# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What a session of an archive holds, as scripts/calibrate.sh has it."""
import re

# What the stages read of it.
INPUTS = ["board.yaml", "boards", "camera.yaml", "check", "dispersion", "gates.yaml", "lamps.yaml", "rotation"]


def row_time_known(station, camera_options):
    """Whether the lens, as it comes of its stage, has a row time."""
    try:
        text = (station / "camera.yaml").read_text(errors="replace")
    except OSError:
        return "--row-time-s" in camera_options
    return re.search(r"^  row_time_s:", text, re.MULTILINE) is not None


def truth_of(station):
    """The table with the true places of the captures to locate, or None."""
    check = station / "check"
    if (check / "truth.csv").exists():
        return check / "truth.csv"
    try:
        with open(check / "captures.csv", encoding="utf-8", errors="replace") as captures:
            return check / "captures.csv" if "x_m" in captures.readline() else None
    except OSError:
        return None


def last_file(station):
    """What the last stage of the chain makes."""
    if truth_of(station):
        return "evaluation.json"
    return "fixes.csv" if (station / "check").exists() else "calibration.yaml"
