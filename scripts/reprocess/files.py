# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all, and digests."""
import csv
import hashlib
import io
import json
import os
from pathlib import Path

# What vlp-calibrate reads of a session (lib/session/session_folder.h), but for drives, which are for its report.
INPUTS = ["board.yaml", "boards", "camera.yaml", "check", "classifier.yaml", "dispersion", "gates.yaml", "lamps.yaml"]
INPUTS += ["rotation"]


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
    writer.writerows([row.get(column, "") for column in columns] for row in rows)
    return text.getvalue()


def read_table(file):
    """Of each line that is not empty what its columns hold, by name; a short one lacks the last."""
    with open(file, newline="") as stream:
        lines = csv.reader(stream)
        columns = next(lines, [])
        return [dict(zip(columns, line)) for line in lines if line]


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


def input_files(session):
    """The files below a session that the stages read: (name, entry), in order. Folders that cannot be
    read have none; it is for the programs to say so."""

    def below(folder, prefix, wanted=None):
        try:
            entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
        except OSError:
            return
        for entry in entries:
            if wanted and entry.name not in wanted:
                continue
            if entry.is_dir():
                yield from below(entry.path, prefix + entry.name + "/")
            else:
                yield prefix + entry.name, entry

    yield from below(session, "", set(INPUTS))


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
