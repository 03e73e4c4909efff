# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Detects changes of the input files of sessions: .state/catalogue.sqlite, which also has the shard of each session.

A fingerprint is a digest of the names of the input files of a session and, for each, of size, times of content and of
inode (st_mtime_ns, st_ctime_ns), and inode number. Unchanged fingerprints imply unchanged files, because programs
cannot set the time of an inode. README.md describes the two kinds of scans, files and folders: which changes each
detects, and which one is the default.

A change within RACY_NS before a scan may leave the times unchanged, as their resolution is finite and clocks differ:
the fingerprint of such new files is salted with the time of the scan. A catalogue that is new, belongs to another
archive or cannot be read gets a new salt: all digests are computed again.
"""
import os
import sqlite3
import time
from array import array
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from hashlib import blake2b
from resource import RUSAGE_THREAD, getrusage
from urllib.parse import quote

from files import INPUTS, MAX_FOLDERS, digest, file_digest, folder_id

SCANS = ("files", "folders")
FEW_SESSIONS = 10_000
# 6.5 days: each of weekly runs checks all files, even if it starts early.
ALL_FILES_AGAIN_NS = 13 * 43200 * 1_000_000_000
RACY_NS = 2_000_000_000  # resolution of time stamps of FAT
CHUNK = 100  # sessions per task of a thread
NUM_THREADS = 16  # for file systems with latency, such as a network's
FORMAT = 2  # of the database
INPUT_NAMES = frozenset(INPUTS)
INT64_MAX = (1 << 63) - 1
NO_ATTRIBUTES = (0, 0, 0, 0)


def is_edited_by_hand(name):
    return name.endswith(".yaml") or name in ("captures.csv", "truth.csv")


def file_attributes(status):
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino & INT64_MAX


def compute_digest(salt, numbers, words=()):
    return blake2b("\n".join((salt, *words)).encode() + array("q", numbers).tobytes(), digest_size=16).hexdigest()


class SessionFiles:
    """Input files of a session with their attributes, and the paths that a scan of folders checks with theirs."""

    def __init__(self, session, archive):
        self.files, self.numbers, self.paths, self.path_attributes = [], [], [], []
        self.folders = 0
        self._below(session, archive, "", set())

    def _below(self, folder, archive, prefix, above):
        """Adds the files of a folder. above: device and inode of its parent folders."""
        self.paths.append(prefix)
        self.folders += 1
        try:
            opened = os.open(folder, os.O_RDONLY, dir_fd=archive)
        except OSError:  # the programs report it
            self.path_attributes += NO_ATTRIBUTES
            return
        try:
            status = os.fstat(opened)
            self.path_attributes += file_attributes(status)  # read before its entries
            above = above | {(status.st_dev, status.st_ino)}
            with os.scandir(opened) as entries:
                entries = sorted(entries, key=lambda entry: entry.name)
            for entry in entries:
                if prefix or entry.name in INPUT_NAMES:
                    self._add(entry, opened, prefix + entry.name, above)
        except OSError:  # the folder changed during the scan
            pass
        finally:
            os.close(opened)

    def _add(self, entry, folder, name, above):
        if folder_id(entry, above) and self.folders < MAX_FOLDERS:
            return self._below(entry.name, folder, name + "/", above)
        try:
            numbers = file_attributes(entry.stat())
        except OSError:  # a broken link
            numbers = NO_ATTRIBUTES
        self.files.append(name)
        self.numbers += numbers
        if is_edited_by_hand(entry.name):
            self.paths.append(name)
            self.path_attributes += numbers

    def latest(self):
        return max(max(self.numbers[2::4], default=0), max(self.path_attributes[2::4]))


def input_digests(session):
    """Returns the digest of all inputs of a session, {name: digest} and {name: number of files} of its input files and
    folders, and the names of entries that are no readable files, such as broken links."""
    lines, counts, unreadable = {}, Counter(), []
    for name in SessionFiles(session, None).files:
        part, found = name.split("/")[0], "not a file"
        try:
            found = file_digest(session / name) if (session / name).is_file() else found
        except OSError:
            found = "cannot be read"
        lines.setdefault(part, []).append(f"{found}  {name}\n")
        counts[part] += " " not in found
        unreadable += [f"{name}: {found}"] if " " in found else []
    texts = {name: "".join(listed) for name, listed in lines.items()}
    return digest("".join(texts.values())), {name: digest(text) for name, text in texts.items()}, counts, unreadable


def read_attributes(session, places, archive):
    """Returns the attributes of the paths of a session. archive: file descriptor of the archive, which shortens
    lookups."""
    numbers, stat, prefix = [], os.stat, session + "/"
    for place in places:
        try:
            seen = stat(prefix + place, dir_fd=archive)
            numbers += (seen.st_size, seen.st_mtime_ns, seen.st_ctime_ns, seen.st_ino & INT64_MAX)
        except OSError:
            numbers += NO_ATTRIBUTES
    return numbers


class Catalogue:
    def __init__(self, file, archive, rebuild=False):
        self.file, self.archive = file, str(archive)
        try:
            if rebuild or not file.exists() or not self._load():
                self._begin()
        except sqlite3.DatabaseError:  # another file, or a damaged one
            self._begin()

    def _begin(self):
        self.settings = {"archive": self.archive, "salt": str(time.time_ns())}
        self.saved, self.sessions, self.paths, self.new = {}, {}, [], True

    def _open(self, file):
        # The lock of the run excludes other runs; not all network file systems support the locks of SQLite.
        return sqlite3.connect(f"file:{quote(str(file))}?nolock=1", uri=True)

    def _load(self):
        database = self._open(self.file)
        try:
            if database.execute("PRAGMA user_version").fetchone()[0] != FORMAT:
                return False
            self.settings = dict(database.execute("SELECT name, value FROM settings"))
            self.saved = dict(self.settings)
            lists = database.execute("SELECT paths FROM path_lists ORDER BY id")
            self.paths = [paths.split("\n") for (paths,) in lists]
            rows = database.execute("SELECT session, shard, fingerprint, folders_fingerprint, path_list FROM sessions")
            self.sessions = {row[0]: row[1:] for row in rows}
        finally:
            database.close()
        self.new = False
        return self.settings.get("archive") == self.archive

    def choose_scan(self, sessions):
        """Returns the default scan for this number of sessions."""
        age_ns = time.time_ns() - self.all_files_at_ns()
        return "folders" if sessions > FEW_SESSIONS and 0 <= age_ns < ALL_FILES_AGAIN_NS else "files"

    def all_files_at_ns(self):
        """Returns the time of the last scan of all files; 0 if there was none."""
        return int(self.settings.get("all_files_at_ns", 0))

    def fingerprints(self, names, how):
        """Returns the fingerprint of each session."""
        began_ns = time.time_ns()
        archive = os.open(self.archive, os.O_RDONLY)
        try:
            found = self._compute_fingerprints(names, how, archive, began_ns)
        finally:
            os.close(archive)
        if how == "files" or self.new:
            self.settings["all_files_at_ns"] = str(began_ns)
        return found

    def _compute_fingerprints(self, names, how, archive, began_ns):
        salt = self.settings["salt"]
        ids_of_paths = {"\n".join(paths): number for number, paths in enumerate(self.paths)}

        def scan(name):
            known = self.sessions.get(name)
            if known and known[2] and how == "folders":
                if compute_digest(salt, read_attributes(name, self.paths[known[3]], archive)) == known[2]:
                    return known[1:]
            seen = SessionFiles(name, archive)
            if seen.latest() >= began_ns - RACY_NS:
                fingerprint, folders_fingerprint = compute_digest(f"{salt} {began_ns}", seen.numbers, seen.files), ""
            else:
                fingerprint = compute_digest(salt, seen.numbers, seen.files)
                folders_fingerprint = compute_digest(salt, seen.path_attributes)
            places = "\n".join(seen.paths)
            number = ids_of_paths.get(places)
            return fingerprint, folders_fingerprint, places if number is None else number

        chunks = [names[first : first + CHUNK] for first in range(0, len(names), CHUNK)]
        waits = getrusage(RUSAGE_THREAD).ru_nvcsw
        found = [scan(name) for name in chunks[0]]
        if getrusage(RUSAGE_THREAD).ru_nvcsw - waits >= len(found):  # most scans waited for the file system
            with ThreadPoolExecutor(NUM_THREADS) as threads:
                for of_chunk in threads.map(lambda chunk: [scan(name) for name in chunk], chunks[1:]):
                    found += of_chunk
        else:
            found += [scan(name) for chunk in chunks[1:] for name in chunk]
        self.found = {}
        for name, (fingerprint, folders_fingerprint, places) in zip(names, found):
            if isinstance(places, str):
                number = ids_of_paths.setdefault(places, len(self.paths))
                if number == len(self.paths):
                    self.paths.append(places.split("\n"))
                places = number
            self.found[name] = (fingerprint, folders_fingerprint, places)
        return [fingerprint for fingerprint, _, _ in found]

    def shard_of(self, name):
        """Returns the previous shard of a session; None for a new session."""
        return self.sessions[name][0] if name in self.sessions else None

    def save(self, shards, size):
        """Stores the fingerprints. shards: {number: sessions}. Sessions without a shard are removed."""
        now = {name: (number, *self.found[name]) for number, names in shards.items() for name in names}
        changed = [(name, *row) for name, row in now.items() if self.new or self.sessions.get(name) != row]
        gone = [] if self.new else [(name,) for name in self.sessions.keys() - now.keys()]
        self.settings["shard_size"] = str(size)
        if not (self.new or changed or gone or self.settings != self.saved):
            return
        file = self.file.with_suffix(".new") if self.new else self.file
        if self.new:
            file.unlink(missing_ok=True)
        database = self._open(file)
        try:
            with database:
                if self.new:
                    database.execute(f"PRAGMA user_version = {FORMAT}")
                    database.execute("CREATE TABLE settings (name TEXT PRIMARY KEY, value TEXT)")
                    database.execute("CREATE TABLE path_lists (id INTEGER PRIMARY KEY, paths TEXT)")
                    columns = "session TEXT PRIMARY KEY, shard INTEGER, fingerprint TEXT, folders_fingerprint TEXT"
                    columns += ", path_list INTEGER"
                    database.execute(f"CREATE TABLE sessions ({columns}) WITHOUT ROWID")
                database.executemany("REPLACE INTO settings VALUES (?, ?)", self.settings.items())
                texts = [(number, "\n".join(paths)) for number, paths in enumerate(self.paths)]
                database.executemany("INSERT OR IGNORE INTO path_lists VALUES (?, ?)", texts)
                database.executemany("REPLACE INTO sessions VALUES (?, ?, ?, ?, ?)", changed)
                database.executemany("DELETE FROM sessions WHERE session = ?", gone)
        finally:
            database.close()
        if self.new:
            self.file.with_name(self.file.name + "-journal").unlink(missing_ok=True)  # of the replaced database
            os.replace(file, self.file)
        self.sessions, self.saved, self.new = now, dict(self.settings), False
