# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What was seen of each session's files when they were looked at last, and its shard: .state/catalogue.sqlite.

A glance is a digest of the names of a session's input files, and of the size, the times of content and of inode
(st_mtime_ns, st_ctime_ns) and the number of the inode of each. While it is the same, so are the files: no program sets
the time of an inode. Two ways to look:

  files    at each file: sees all changes that the file system shows.
  folders  at the folders and at the files that people edit (*.yaml, captures.csv, truth.csv): sees files that come,
           go, are renamed or replaced by others of their name. An image that is written over in place, or to which a
           symbolic link leads, is not seen to change. Where something did, all files of the session are looked at.

Unless one is asked for, an archive of FEW_SESSIONS, where it takes few seconds, is looked at by its files, and a
larger one by its folders, once in ALL_FILES_AGAIN_NS by its files.

A change within RACY_NS of a look may leave times as they were, since file systems count them in steps and clocks of
machines differ: a glance at files that are so new is salted with the time, and is another one the next time.
A catalogue that is new, is another archive's, or cannot be read has a salt of its own: all glances are others than
before, and so all digests are taken again.
"""
import os
import resource
import sqlite3
import time
from array import array
from concurrent.futures import ThreadPoolExecutor
from hashlib import blake2b
from urllib.parse import quote

from files import INPUTS, MOST_FOLDERS, folder_id

LOOKS = ("files", "folders")
FEW_SESSIONS = 10_000
# A run once a week does it each time, and one a little early, too.
ALL_FILES_AGAIN_NS = 13 * 43200 * 1_000_000_000
RACY_NS = 2_000_000_000  # FAT counts in 2 s
CHUNK = 100  # sessions
AT_A_TIME = 16  # looks, where the file system lets us wait
FORMAT = 1
INPUT_NAMES = frozenset(INPUTS)
POSITIVE = (1 << 63) - 1
NOTHING = (0, 0, 0, 0)


def edited(name):
    return name.endswith(".yaml") or name in ("captures.csv", "truth.csv")


def numbers_of(status):
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino & POSITIVE


def digest_of(salt, numbers, words=()):
    return blake2b("\n".join((salt, *words)).encode() + array("q", numbers).tobytes(), digest_size=16).hexdigest()


def waits_of_this_thread():
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw


class Seen:
    """Of a session: its input files and their numbers; the places to look at when only folders are, and theirs."""

    def __init__(self, session, archive):
        self.files, self.numbers, self.places, self.of_places = [], [], [], []
        self.folders = 0
        self._below(session, archive, "", set())

    def _below(self, folder, archive, prefix, above):
        """above: device and inode of the folders on the way to this one."""
        self.places.append(prefix)
        self.folders += 1
        try:
            opened = os.open(folder, os.O_RDONLY, dir_fd=archive)
        except OSError:  # it is for the programs to say so
            self.of_places += NOTHING
            return
        try:
            status = os.fstat(opened)
            self.of_places += numbers_of(status)  # before what is in it
            above = above | {(status.st_dev, status.st_ino)}
            with os.scandir(opened) as entries:
                entries = sorted(entries, key=lambda entry: entry.name)
            for entry in entries:
                if prefix or entry.name in INPUT_NAMES:
                    self._add(entry, opened, prefix + entry.name, above)
        except OSError:  # in the middle of it
            pass
        finally:
            os.close(opened)

    def _add(self, entry, folder, name, above):
        if folder_id(entry, above) and self.folders < MOST_FOLDERS:
            return self._below(entry.name, folder, name + "/", above)
        try:
            numbers = numbers_of(entry.stat())
        except OSError:  # a link to nowhere
            numbers = NOTHING
        self.files.append(name)
        self.numbers += numbers
        if edited(entry.name):
            self.places.append(name)
            self.of_places += numbers

    def latest(self):
        return max(max(self.numbers[2::4], default=0), max(self.of_places[2::4]))


def look_at(session, places, archive):
    """The numbers of the places; archive: its descriptor, from which the way to the session is short."""
    numbers, stat, prefix = [], os.stat, session + "/"
    for place in places:
        try:
            seen = stat(prefix + place, dir_fd=archive)
            numbers += (seen.st_size, seen.st_mtime_ns, seen.st_ctime_ns, seen.st_ino & POSITIVE)
        except OSError:
            numbers += NOTHING
    return numbers


class Catalogue:
    def __init__(self, file, archive, rebuild=False):
        self.file, self.archive = file, str(archive)
        try:
            if rebuild or not file.exists() or not self._load():
                self._begin()
        except sqlite3.DatabaseError:  # not one, or damaged
            self._begin()

    def _begin(self):
        self.stated = {"archive": self.archive, "salt": str(time.time_ns())}
        self.saved, self.sessions, self.places, self.new = {}, {}, [], True

    def _open(self, file):
        # The run's lock keeps others away; locks of SQLite are not for every network's file system.
        return sqlite3.connect(f"file:{quote(str(file))}?nolock=1", uri=True)

    def _load(self):
        database = self._open(self.file)
        try:
            if database.execute("PRAGMA user_version").fetchone()[0] != FORMAT:
                return False
            self.stated = dict(database.execute("SELECT name, value FROM stated"))
            self.saved = dict(self.stated)
            self.places = [paths.split("\n") for (paths,) in database.execute("SELECT paths FROM places ORDER BY id")]
            rows = database.execute("SELECT session, shard, glance, at_folders, places FROM sessions")
            self.sessions = {row[0]: row[1:] for row in rows}
        finally:
            database.close()
        self.new = False
        return self.stated.get("archive") == self.archive

    def look_for(self, sessions):
        """How to look at so many."""
        age_ns = time.time_ns() - self.all_files_at_ns()
        return "folders" if sessions > FEW_SESSIONS and 0 <= age_ns < ALL_FILES_AGAIN_NS else "files"

    def all_files_at_ns(self):
        """When all files were looked at last."""
        return int(self.stated.get("all_files_at_ns", 0))

    def glances(self, names, how):
        """Of each session, in this order."""
        began_ns = time.time_ns()
        archive = os.open(self.archive, os.O_RDONLY)
        try:
            found = self._glances(names, how, archive, began_ns)
        finally:
            os.close(archive)
        if how == "files" or self.new:
            self.stated["all_files_at_ns"] = str(began_ns)
        return found

    def _glances(self, names, how, archive, began_ns):
        salt = self.stated["salt"]
        numbers_of_places = {"\n".join(paths): number for number, paths in enumerate(self.places)}

        def look(name):
            known = self.sessions.get(name)
            if known and known[2] and how == "folders":
                if digest_of(salt, look_at(name, self.places[known[3]], archive)) == known[2]:
                    return known[1:]
            seen = Seen(name, archive)
            if seen.latest() >= began_ns - RACY_NS:
                glance, at_folders = digest_of(f"{salt} {began_ns}", seen.numbers, seen.files), ""
            else:
                glance, at_folders = digest_of(salt, seen.numbers, seen.files), digest_of(salt, seen.of_places)
            places = "\n".join(seen.places)
            number = numbers_of_places.get(places)
            return glance, at_folders, places if number is None else number

        chunks = [names[first : first + CHUNK] for first in range(0, len(names), CHUNK)]
        waits = waits_of_this_thread()
        found = [look(name) for name in chunks[0]]
        if waits_of_this_thread() - waits >= len(found):  # for the file system
            with ThreadPoolExecutor(AT_A_TIME) as threads:
                for of_chunk in threads.map(lambda chunk: [look(name) for name in chunk], chunks[1:]):
                    found += of_chunk
        else:
            found += [look(name) for chunk in chunks[1:] for name in chunk]
        self.found = {}
        for name, (glance, at_folders, places) in zip(names, found):
            if isinstance(places, str):
                number = numbers_of_places.setdefault(places, len(self.places))
                if number == len(self.places):
                    self.places.append(places.split("\n"))
                places = number
            self.found[name] = (glance, at_folders, places)
        return [glance for glance, _, _ in found]

    def shard_of(self, name):
        """That of the last time; None of a new session."""
        return self.sessions[name][0] if name in self.sessions else None

    def save(self, shards, size):
        """shards: {number: sessions}. What is no longer there is forgotten."""
        now = {name: (number, *self.found[name]) for number, names in shards.items() for name in names}
        changed = [(name, *row) for name, row in now.items() if self.new or self.sessions.get(name) != row]
        gone = [] if self.new else [(name,) for name in self.sessions.keys() - now.keys()]
        self.stated["shard_size"] = str(size)
        if not (self.new or changed or gone or self.stated != self.saved):
            return
        file = self.file.with_suffix(".new") if self.new else self.file
        if self.new:
            file.unlink(missing_ok=True)
        database = self._open(file)
        try:
            with database:
                if self.new:
                    database.execute(f"PRAGMA user_version = {FORMAT}")
                    database.execute("CREATE TABLE stated (name TEXT PRIMARY KEY, value TEXT)")
                    database.execute("CREATE TABLE places (id INTEGER PRIMARY KEY, paths TEXT)")
                    columns = "session TEXT PRIMARY KEY, shard INTEGER, glance TEXT, at_folders TEXT, places INTEGER"
                    database.execute(f"CREATE TABLE sessions ({columns}) WITHOUT ROWID")
                database.executemany("REPLACE INTO stated VALUES (?, ?)", self.stated.items())
                texts = [(number, "\n".join(paths)) for number, paths in enumerate(self.places)]
                database.executemany("INSERT OR IGNORE INTO places VALUES (?, ?)", texts)
                database.executemany("REPLACE INTO sessions VALUES (?, ?, ?, ?, ?)", changed)
                database.executemany("DELETE FROM sessions WHERE session = ?", gone)
        finally:
            database.close()
        if self.new:
            self.file.with_name(self.file.name + "-journal").unlink(missing_ok=True)  # of the one that was there
            os.replace(file, self.file)
        self.sessions, self.saved, self.new = now, dict(self.stated), False
