# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Tables, files that are written atomically, and digests."""
import csv
import hashlib
import io
import json
import os
import re
import sys
from pathlib import Path

# Inputs of vlp-calibrate in a session (lib/session/session_folder.h), except line drives, which only its report uses.
INPUTS = ["board.yaml", "boards", "camera.yaml", "check", "classifier.yaml", "dispersion", "gates.yaml", "lamps.yaml"]
INPUTS += ["rotation"]
# Maximum number of folders examined per session: links between folders can make the number of paths unlimited.
MAX_FOLDERS = 1000
# First characters of a field that a spreadsheet evaluates as a formula unless an apostrophe precedes it (OWASP, "CSV
# injection"). lib/captures/csv_writer.cpp escapes in the same way.
FIRST_CHARACTERS = tuple("'=+-@\t\r")
FORMULA = re.compile(r"'*[=+\-@\t\r].", re.DOTALL)


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def escape_formula(field):
    """Returns the field with an apostrophe in front if a spreadsheet would evaluate it. Numbers are unchanged."""
    text = str(field)
    if text[:1] not in FIRST_CHARACTERS:
        return field
    return "'" + text if FORMULA.match(text) and not is_number(text) else field


def unescape_formula(field):
    """Reverses escape_formula()."""
    return field[1:] if field.startswith("'") and FORMULA.match(field) else field


def write_atomically(file, text):
    file = Path(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_name(f".{file.name}.new")  # one run at a time: that of a killed one is replaced
    with open(unfinished, "w", newline="") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(unfinished, file)


def write_if_changed(file, text):
    """Writes a file unless it has this content already, so that its modification time changes only with its content."""
    file = Path(file)
    if not file.exists() or file.read_text() != text:
        write_atomically(file, text)


def table(columns, rows):
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([escape_formula(row.get(column, "")) for column in columns] for row in rows)
    return text.getvalue()


def read_table(file):
    """Returns a dictionary {column: text} for each line that is not empty. A short line lacks the last columns."""
    with open(file, newline="", encoding="utf-8-sig") as stream:
        lines = csv.reader(stream)
        columns = next(lines, [])
        return [dict(zip(columns, map(unescape_formula, line))) for line in lines if line]


def print_lines(lines):
    """Prints lines. A reader that has ended, as `| head`, is no error."""
    try:
        print("\n".join(lines), flush=True)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w")  # its buffer is written at the end of the program


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
    """Returns device and inode of a folder. Returns None for other files, and for a folder in `above`, its parent
    folders, because a link to one of these would be followed without end."""
    try:
        if not entry.is_dir():
            return None
        status = entry.stat()
    except OSError:  # a link that leads to itself
        return None
    found = status.st_dev, status.st_ino
    return None if found in above else found
