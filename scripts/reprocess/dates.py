# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""When and in which room a session was taken: as ARCHIVE/archive.csv says (columns camera, session, date, room;
others are not read), or else by a date in the session's name, as in 2026-03-14 or 20260314-b."""
import re
from datetime import datetime, timezone
from functools import lru_cache

from files import read_table

IN_A_NAME = re.compile(r"(?<!\d)(\d{4})-?(\d\d)-?(\d\d)(?!\d)")


@lru_cache(maxsize=None)
def date_in(name):
    for found in IN_A_NAME.finditer(name):
        try:
            return datetime(*map(int, found.groups())).date().isoformat()
        except ValueError:
            continue
    return ""


def in_utc(text):
    """What is without an offset is taken for UTC."""
    date = datetime.fromisoformat(text)
    return date.astimezone(timezone.utc).replace(tzinfo=None) if date.tzinfo else date


def table_of(archive):
    """Of (camera, session): (date in UTC, room). Throws ValueError with file and line."""
    file, stated = archive / "archive.csv", {}
    if not file.is_file():
        return stated
    for line, row in enumerate(read_table(file), 2):
        if not row.get("camera") or not row.get("session"):
            raise ValueError(f"{file}:{line}: should name a camera and a session")
        date = (row.get("date") or "").strip()
        try:
            date = date and in_utc(date).isoformat()
        except ValueError:
            raise ValueError(f"{file}:{line}: date: should be as 2026-03-14 or 2026-03-14T09:30, not {date}") from None
        stated[row["camera"], row["session"]] = (date.removesuffix("T00:00:00"), (row.get("room") or "").strip())
    return stated


def dates_of(archive, sessions):
    """sessions: CAMERA/SESSION. A line each of those that have a date or a room."""
    stated, lines = table_of(archive), []
    for name in sessions:
        camera, session = name.split("/")
        date, room = stated.get((camera, session), ("", ""))
        date = date or date_in(session)
        if date or room:
            lines.append({"camera": camera, "session": session, "date": date, "room": room})
    return lines


@lru_cache(maxsize=None)
def days_of(date):
    """Since 1970; None without a date."""
    return (datetime.fromisoformat(date) - datetime(1970, 1, 1)).total_seconds() / 86400 if date else None
