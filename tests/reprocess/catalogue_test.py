#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of changed files by the plan, and digests of files."""
import hashlib
import os
import tempfile
import time
import unittest
import unittest.mock
from pathlib import Path

import parts  # noqa: F401
import catalogue
import files


class Tables(unittest.TestCase):
    """Tables that are opened with a spreadsheet."""

    def test_formulas_are_escaped_and_restored(self):
        rows = [{"name": name, "mm": "-0.5"} for name in ("=1+1", "+A1", "-A1", "@a", "\tx", "'=1", "plain", "-", "'a'")]
        text = files.table(["name", "mm"], rows)
        self.assertIn("\n'=1+1,-0.5\n", text)
        self.assertIn("\n-,-0.5\n'a',-0.5\n", text)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "a.csv"
            file.write_text(text)
            self.assertEqual(files.read_table(file), rows)


class Scan(unittest.TestCase):
    """Detection of changes of the files of a session."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.archive = Path(folder.name) / "archive"
        self.file = Path(folder.name) / "catalogue.sqlite"
        self.session = self.archive / "c/s"
        for name in ("boards/0.png", "boards/1.png", "check/truth.csv", "lamps.yaml", "notes.txt", "check/more/2.png"):
            (self.session / name).parent.mkdir(parents=True, exist_ok=True)
            (self.session / name).write_text("one")
        (self.archive / "c/other").mkdir()
        self.at_ns = 0  # offset of the clock, so that files are older than the scan

    def fingerprint(self, how="files", rebuild=False, archive=None):
        """Returns the fingerprint of the session, as the plan does, and stores it for the next scan."""
        self.at_ns += 10_000_000_000
        now = time.time_ns() + self.at_ns
        with unittest.mock.patch.object(catalogue.time, "time_ns", return_value=now):
            known = catalogue.Catalogue(self.file, archive or self.archive, rebuild)
            fingerprints = known.fingerprints(["c/other", "c/s"], how)
            known.save({0: ["c/other", "c/s"]}, 50)
        return fingerprints[1]

    def overwrite(self, name, text):
        """Overwrites a file in place with content of the same length and restores its time."""
        before = os.stat(self.session / name)
        time.sleep(0.02)  # time stamps have a finite resolution
        with open(self.session / name, "r+") as stream:
            stream.write(text)
        os.utime(self.session / name, ns=(before.st_atime_ns, before.st_mtime_ns))
        after = os.stat(self.session / name)
        self.assertEqual((before.st_size, before.st_ino, before.st_mtime_ns), (after.st_size, after.st_ino, after.st_mtime_ns))

    def replace_file_atomically(self, name):
        before = os.stat(self.session / name)
        (self.session / "new").write_text("two")
        os.utime(self.session / "new", ns=(before.st_atime_ns, before.st_mtime_ns))
        (self.session / "new").replace(self.session / name)

    def test_unchanged_files_have_equal_fingerprints(self):
        first = self.fingerprint()
        for how in ("files", "folders", "folders", "files"):
            self.assertEqual(self.fingerprint(how), first)
        (self.session / "notes.txt").write_text("three")  # no input
        (self.session / "results").mkdir()
        for how in ("folders", "files"):
            self.assertEqual(self.fingerprint(how), first)

    def test_scan_of_files_detects_each_change(self):
        said = [self.fingerprint()]
        for change in (
            lambda: self.overwrite("boards/0.png", "two"),
            lambda: self.overwrite("check/more/2.png", "two"),
            lambda: self.replace_file_atomically("boards/1.png"),
            lambda: (self.session / "boards/1.png").rename(self.session / "boards/3.png"),
            lambda: (self.session / "boards/3.png").unlink(),
            lambda: (self.session / "rotation").mkdir() or (self.session / "rotation/0.png").write_text("one"),
            lambda: self.overwrite("lamps.yaml", "two"),
            lambda: os.utime(self.session / "lamps.yaml"),
        ):
            change()
            said.append(self.fingerprint())
            self.assertEqual(self.fingerprint(), said[-1])
        self.assertEqual(len(set(said)), len(said))

    def test_scan_of_folders_misses_only_overwritten_images(self):
        said = [self.fingerprint("folders")]
        for change in (
            lambda: self.replace_file_atomically("boards/1.png"),
            lambda: self.replace_file_atomically("check/more/2.png"),
            lambda: (self.session / "boards/2.png").write_text("one"),
            lambda: self.overwrite("lamps.yaml", "two"),
            lambda: self.overwrite("check/truth.csv", "two"),
            lambda: (self.session / "gates.yaml").write_text("one"),
        ):
            change()
            said.append(self.fingerprint("folders"))
            self.assertEqual(self.fingerprint("folders"), said[-1])
        self.assertEqual(len(set(said)), len(said))
        self.overwrite("boards/0.png", "two")
        self.assertEqual(self.fingerprint("folders"), said[-1])  # as documented
        self.assertNotEqual(self.fingerprint("files"), said[-1])

    def test_links_to_parent_folders_end(self):
        first, digest = self.fingerprint(), catalogue.input_digests(self.session)
        os.symlink("..", self.session / "boards/up")
        os.symlink(".", self.session / "check/here")
        os.symlink("itself", self.session / "check/itself")
        for folder in "boards", "check":
            os.symlink(self.session, self.session / folder / "session")
        said = [first, self.fingerprint()]
        self.assertNotEqual(catalogue.input_digests(self.session), digest)
        self.overwrite("check/more/2.png", "two")
        said += [self.fingerprint(), self.fingerprint("folders")]
        self.assertEqual(len(set(said)), 3)
        names = catalogue.SessionFiles(self.session, None).files
        self.assertIn("check/more/2.png", names)
        self.assertIn("check/itself", names)
        self.assertLess(len(names), 20)

    def test_mutual_links_end(self):
        for folder in range(9):
            (self.session / f"rotation/{folder}").mkdir(parents=True)
            for other in range(9):
                os.symlink(f"../{other}", self.session / f"rotation/{folder}/to{other}")
        begun = time.monotonic()
        self.fingerprint()
        self.assertLessEqual(len(catalogue.SessionFiles(self.session, None).files), 20 * files.MAX_FOLDERS)
        self.assertLess(time.monotonic() - begun, 5)

    def default_scan(self, days=0):
        """Returns the default scan of a large archive after `days` days."""
        now = time.time_ns() + self.at_ns + days * 86400 * 10**9
        with unittest.mock.patch.multiple(catalogue, FEW_SESSIONS=1):
            with unittest.mock.patch.object(catalogue.time, "time_ns", return_value=now):
                known = catalogue.Catalogue(self.file, self.archive)
                how = known.choose_scan(2)
                known.fingerprints(["c/other", "c/s"], how)
                known.save({0: ["c/other", "c/s"]}, 50)
        return how

    def test_scans_large_archive_by_folders_and_weekly_by_files(self):
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual(known.choose_scan(catalogue.FEW_SESSIONS), "files")
        said = [self.fingerprint("folders")]  # the first scan, of all files
        self.assertEqual([self.default_scan(days) for days in (0, 1, 6)], ["folders"] * 3)
        self.overwrite("boards/0.png", "two")
        self.assertEqual(self.fingerprint("folders"), said[0])
        self.assertEqual([self.default_scan(days) for days in (8, 9, 14)], ["files", "folders", "folders"])
        self.assertNotEqual(self.fingerprint("folders"), said[0])  # detected within the week
        self.assertEqual([self.default_scan(days) for days in (21, 28, 35)], ["files"] * 3)  # a run once a week
        self.assertEqual(self.default_scan(-1), "files")  # the clock was set back
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual(known.choose_scan(catalogue.FEW_SESSIONS), "files")

    def test_checks_new_files_again(self):
        for how in ("files", "folders"):
            self.at_ns = -10_000_000_000
            new = self.fingerprint(how, rebuild=True)
            self.at_ns = 0
            settled = self.fingerprint(how)
            self.assertNotEqual(settled, new)
            self.assertEqual(self.fingerprint(how), settled)

    def test_rebuilt_damaged_or_foreign_catalogue_has_new_fingerprints(self):
        said = [self.fingerprint(), self.fingerprint(rebuild=True)]
        self.file.write_bytes(b"not a database, and longer than the head of one" * 50)
        said.append(self.fingerprint())
        self.file.unlink()
        said.append(self.fingerprint())
        whole = self.file.read_bytes()
        self.file.write_bytes(whole[:5000] + bytes(len(whole) - 5000))
        said.append(self.fingerprint())
        moved = self.archive.rename(self.archive.with_name("moved"))
        said.append(self.fingerprint(archive=moved))
        self.assertEqual(len(set(said)), len(said))
        self.assertEqual(self.fingerprint(archive=moved), said[-1])

    def test_checks_files_of_the_digest(self):
        (self.session / "boards/nowhere.png").symlink_to("/nowhere")
        (self.session / "rotation").symlink_to(self.session / "boards")
        (self.session / "dispersion").write_text("a file")
        opened = os.open(self.archive, os.O_RDONLY)
        self.addCleanup(os.close, opened)
        seen = catalogue.SessionFiles("c/s", opened)
        self.assertEqual(seen.path_attributes, catalogue.read_attributes("c/s", seen.paths, opened))

    def test_writes_only_changed_sessions(self):
        self.fingerprint()
        later = unittest.mock.patch.object(catalogue.time, "time_ns", return_value=time.time_ns() + 10_000_000_000)
        later.start()
        self.addCleanup(later.stop)
        known = catalogue.Catalogue(self.file, self.archive)
        known.fingerprints(["c/s"], "files")
        known.save({3: ["c/s"]}, 50)
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual((known.shard_of("c/s"), known.shard_of("c/other")), (3, None))
        before = self.file.stat().st_mtime_ns
        known.fingerprints(["c/s"], "folders")
        known.save({3: ["c/s"]}, 50)
        self.assertEqual(self.file.stat().st_mtime_ns, before)


class Files(unittest.TestCase):
    def test_digest_covers_names_and_contents_of_inputs(self):
        with tempfile.TemporaryDirectory() as folder:
            session = Path(folder)
            (session / "boards").mkdir()
            (session / "boards/0.png").write_text("one")
            first = catalogue.input_digests(session)[0]
            (session / "notes.txt").write_text("not read")
            (session / "results").mkdir()
            (session / "results/boards").write_text("not read")
            os.utime(session / "boards/0.png", (1, 1))
            self.assertEqual(catalogue.input_digests(session)[0], first)
            (session / "boards/0.png").rename(session / "boards/1.png")
            second = catalogue.input_digests(session)[0]
            (session / "boards/1.png").write_text("two")
            self.assertEqual(len({first, second, catalogue.input_digests(session)[0]}), 3)
            self.assertEqual(list(catalogue.input_digests(session)[1]), ["boards"])

    def test_digest_of_inputs_is_stable(self):
        with tempfile.TemporaryDirectory() as folder:
            session, lines = Path(folder), ""
            for name in ("board.yaml", "boards/0.png", "boards/1.png", "lamps.yaml"):
                (session / name).parent.mkdir(exist_ok=True)
                (session / name).write_text(name)
                lines += f"{hashlib.sha256(name.encode()).hexdigest()}  {name}\n"
            inputs, parts, counts, _ = catalogue.input_digests(session)
            self.assertEqual(inputs, hashlib.sha256(lines.encode()).hexdigest())
            self.assertEqual(list(parts), ["board.yaml", "boards", "lamps.yaml"])


if __name__ == "__main__":
    unittest.main()
