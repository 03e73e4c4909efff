# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Date, room and expected files of each session: from ARCHIVE/archive.csv (columns camera, session, date, room, files;
others are ignored), or else the date in the name of the session, as in 2026-03-14 or 20260314-b."""
import re
import sys
from datetime import datetime, timedelta, timezone
from functools import lru_cache

from files import INPUTS, read_table
from plausibility import count_inputs

COLUMNS = {"camera", "session", "date", "room", "files"} | {"fault", "damage", "damaged"}  # the latter of vlp-simulate
DATE_IN_NAME = re.compile(r"(?<!\d)(\d{4})-?(\d\d)-?(\d\d)(?!\d)")


def warn(message):
    print(f"reprocess.sh: warning: {message}", file=sys.stderr)


@lru_cache(maxsize=None)
def find_date(name):
    for found in DATE_IN_NAME.finditer(name):
        try:
            return datetime(*map(int, found.groups())).date().isoformat()
        except ValueError:
            continue
    return ""


def parse_utc(text):
    """Parses a date and time and converts it to UTC. Without an offset it is treated as UTC."""
    date = datetime.fromisoformat(text)
    return date.astimezone(timezone.utc).replace(tzinfo=None) if date.tzinfo else date


def read_archive_table(archive):
    """Returns {CAMERA/SESSION: (date in UTC, room, files)}. Raises ValueError with file and line."""
    file, stated = archive / "archive.csv", {}
    if not file.is_file():
        return stated
    rows = read_table(file)
    if others := ", ".join(sorted({column for row in rows for column in row} - COLUMNS)):
        warn(f"{file}:1: columns that are ignored: {others}; known are camera, session, date, room, files")
    for line, row in enumerate(rows, 2):
        if not row.get("camera") or not row.get("session"):
            raise ValueError(f"{file}:{line}: should name a camera and a session")
        if (name := f"{row['camera']}/{row['session']}") in stated:
            raise ValueError(f"{file}:{line}: {name} occurs twice; remove one row")
        date = (row.get("date") or "").strip()
        try:
            utc = date and parse_utc(date)
        except ValueError:
            raise ValueError(f"{file}:{line}: date: should be as 2026-03-14 or 2026-03-14T09:30, not {date}") from None
        if utc and not datetime(2000, 1, 1) <= utc <= datetime.now() + timedelta(days=1):
            raise ValueError(f"{file}:{line}: date: {date} is before 2000 or in the future: was a clock wrong?")
        date = utc and utc.isoformat()
        try:
            unknown = set(count_inputs(files := (row.get("files") or "").strip())) - set(INPUTS)
        except ValueError:
            raise ValueError(f"{file}:{line}: files: should be as 'boards 20, check 12', not {files}") from None
        if unknown:
            raise ValueError(f"{file}:{line}: files: {min(unknown)!r} is no input; these are: {', '.join(INPUTS)}")
        stated[name] = (date.removesuffix("T00:00:00"), (row.get("room") or "").strip(), files)
    return stated


def read_dates(archive, sessions):
    """Returns a row for each session with a date, a room or files, and the sessions with files that the archive lacks.
    sessions: CAMERA/SESSION."""
    stated, lines = read_archive_table(archive), []
    if unknown := sorted(set(stated) - set(sessions)):
        warn(f"{archive}/archive.csv: names {len(unknown)} sessions that the archive lacks, as {unknown[0]}")
    for name in sessions:
        camera, session = name.split("/")
        date, room, files = stated.get(name, ("", "", ""))
        date = date or find_date(session)
        if date or room or files:
            lines.append({"camera": camera, "session": session, "date": date, "room": room, "files": files})
    return lines, [name for name in unknown if stated[name][2]]


@lru_cache(maxsize=None)
def days_since_1970(date):
    """Returns the days since 1970; None without a date."""
    return (datetime.fromisoformat(date) - datetime(1970, 1, 1)).total_seconds() / 86400 if date else None
