# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the folders of an archive with its layout, ARCHIVE/CAMERA/SESSION/ with the inputs of vlp-calibrate."""
import os
import re
from collections import Counter

LAYOUT = "the layout is ARCHIVE/CAMERA/SESSION/ with lamps.yaml, rotation/ and board.yaml and boards/, or camera.yaml"
INPUTS = ("lamps.yaml", "rotation", "boards", "board.yaml", "camera.yaml")
MIN_INPUTS = 2  # names that make a folder a session; one can be the name of a camera
NAME = re.compile(r"\w[\w .-]*", re.ASCII)


def describe_fault(entry, archive):
    """Returns why an entry of the archive is no camera or session; "" for a folder that is one, and for a file."""
    # [ARCHIVE-5] `is no folder`, `names are of`, `in the archive or above` | no camera or session; the others are
    #   processed | rename or remove it
    link = os.path.realpath(entry.path) if entry.is_symlink() else ""
    if entry.is_file(follow_symlinks=False) or (link and os.path.isfile(link)):
        return ""
    if not os.path.isdir(link or entry.path):
        return "leads to a folder that is missing, or to itself" if link else "is no folder"
    if not NAME.fullmatch(entry.name):
        return "names are of letters, digits, '.', '_', '-' and blanks, and do not begin with '.', '-' or a blank"
    is_inside = link and os.path.commonpath([link, archive]) in (link, str(archive))
    return f"leads to {link!r}, in the archive or above" if is_inside else ""


def list_folders(folder, archive, faults):
    """Lists the folders that can be cameras or sessions. Appends the other entries to `faults`, as "NAME: reason"."""
    names = []
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda entry: entry.name):
            if reason := describe_fault(entry, archive):
                faults.append(f"{os.path.relpath(entry.path, archive)!r}: {reason}")
            elif entry.is_dir():
                names.append(entry.name)
    return names


def list_sessions_in(archive, faults):
    sessions = []
    for camera in list_folders(archive, archive, faults):
        names = list_folders(archive / camera, archive, faults)
        sessions += [f"{camera}/{name}" for name in names]
        # [ARCHIVE-5] `has no session`
        faults += [] if names else [f"{camera!r}: has no session"]
    return sessions


def is_session(folder):
    return sum(os.path.exists(folder / name) for name in INPUTS) >= MIN_INPUTS


def find_missing_inputs(session):
    """Returns the required inputs that the folder lacks."""
    names = ["lamps.yaml", "rotation"]
    if not os.path.exists(session / "camera.yaml"):
        names += ["board.yaml", "boards"]
    return [name for name in names if not os.path.exists(session / name)]


def describe_wrong_level(archive):
    """Returns a line if ARCHIVE is another folder than the one that contains the cameras; "" otherwise."""
    if is_session(archive):
        # [ARCHIVE-1] `too deep`, `too high`
        return f"{archive} is a session, two levels too deep: give {archive.parent.parent}"
    if any(is_session(archive / camera) for camera in list_folders(archive, archive, [])):
        return f"{archive} holds sessions in place of cameras, one level too deep: give {archive.parent}"
    for name in list_sessions_in(archive, []):
        if any(is_session(archive / name / below) for below in list_folders(archive / name, archive, [])):
            return f"{archive} is one level too high: give {archive / name.split('/')[0]}"
    return ""


def check_layout(archive, names):
    """Returns a line if no session has any input; "" otherwise."""
    if any(os.path.exists(archive / name / file) for name in names for file in INPUTS):
        return ""
    # [ARCHIVE-1] `has any input`
    return describe_wrong_level(archive) or f"{archive}: none of its {len(names)} sessions has any input; {LAYOUT}"


def describe_missing_inputs(archive, names):
    """Returns for example "rotation is missing in 3 sessions"; "" if no session lacks an input."""
    missing = Counter(input_name for name in names for input_name in find_missing_inputs(archive / name))
    # [ARCHIVE-2] `missing in`
    words = [f"{name} is missing in {count} session{'s' * (count > 1)}" for name, count in missing.most_common()]
    return ", ".join(words) + f"; {LAYOUT}" if words else ""
