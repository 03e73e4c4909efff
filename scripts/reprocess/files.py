# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all, and digests."""
import csv
import hashlib
import io
import json
import os
import re
from pathlib import Path

# Inputs of vlp-calibrate in a session (lib/session/session_folder.h), except line drives, which only its report uses.
INPUTS = ["board.yaml", "boards", "camera.yaml", "check", "classifier.yaml", "dispersion", "gates.yaml", "lamps.yaml"]
INPUTS += ["rotation"]
# Maximum number of folders examined per session: links between folders can make the number of paths unlimited.
MOST_FOLDERS = 1000


# Characters at the start of a field that a spreadsheet reads as a formula, and as text after an apostrophe: OWASP's
# "CSV injection". lib/captures/csv_writer.cpp writes the same.
FIRST_CHARACTERS = tuple("'=+-@\t\r")
FORMULA = re.compile(r"'*[=+\-@\t\r].", re.DOTALL)


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def as_text(field):
    """Puts an apostrophe before a field that a spreadsheet would calculate; numbers stay."""
    text = str(field)
    if text[:1] not in FIRST_CHARACTERS:
        return field
    return "'" + text if FORMULA.match(text) and not is_number(text) else field


def without_apostrophe(field):
    """The opposite of as_text()."""
    return field[1:] if field.startswith("'") and FORMULA.match(field) else field


def write_whole(file, text):
    file = Path(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_name(f".{file.name}.{os.getpid()}")
    with open(unfinished, "w", newline="") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(unfinished, file)


def write_if_other(file, text):
    """Leaves a file alone that says the same already, so that nothing counts as changed."""
    file = Path(file)
    if not file.exists() or file.read_text() != text:
        write_whole(file, text)


def table(columns, rows):
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([as_text(row.get(column, "")) for column in columns] for row in rows)
    return text.getvalue()


def read_table(file):
    """Of each line that is not empty what its columns hold, by name; a short one lacks the last."""
    with open(file, newline="") as stream:
        lines = csv.reader(stream)
        columns = next(lines, [])
        return [dict(zip(columns, map(without_apostrophe, line))) for line in lines if line]


def json_text(value):
    return json.dumps(value, indent=1, sort_keys=True) + "\n"


def digest(text):
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(file):
    sha = hashlib.sha256()
    with open(file, "rb") as stream:
        while block := stream.read(1 << 20):
            sha.update(block)
    return sha.hexdigest()


def folder_id(entry, above):
    """Device and inode of a folder; None of what is no folder, and of one in `above`, the folders on the way to it: a
    link that leads back to one of these would have no end."""
    try:
        if not entry.is_dir():
            return None
        status = entry.stat()
    except OSError:  # a link that leads to itself
        return None
    found = status.st_dev, status.st_ino
    return None if found in above else found


def input_files(session):
    """The files below a session that the stages read: (name, entry), in order. Folders that cannot be
    read have none; it is for the programs to say so. A link to a folder on the way to it is a file that cannot be
    read."""

    folders = 0

    def below(folder, prefix, above, wanted=None):
        nonlocal folders
        folders += 1
        try:
            entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
        except OSError:
            return
        for entry in entries:
            if wanted and entry.name not in wanted:
                continue
            found = folder_id(entry, above)
            if found and folders < MOST_FOLDERS:
                yield from below(entry.path, prefix + entry.name + "/", above | {found})
            else:
                yield prefix + entry.name, entry

    try:
        status = os.stat(session)
    except OSError:
        return
    yield from below(session, "", {(status.st_dev, status.st_ino)}, set(INPUTS))


def entry_digest(entry):
    try:
        return file_digest(entry.path) if entry.is_file() else "not a file"
    except OSError:
        return "cannot be read"


def input_digests(session):
    """Of all that the stages read, and of each file and folder of it, by name."""
    lines = {}
    for name, entry in input_files(session):
        lines.setdefault(name.split("/")[0], []).append(f"{entry_digest(entry)}  {name}\n")
    texts = {name: "".join(of_it) for name, of_it in lines.items()}
    return digest("".join(texts.values())), {name: digest(text) for name, text in texts.items()}
