#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What the plan notices of what happens to files, and their digests."""
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
    """Tables that people open with a spreadsheet."""

    def test_formulas_are_text_and_come_back(self):
        rows = [{"name": name, "mm": "-0.5"} for name in ("=1+1", "+A1", "-A1", "@a", "\tx", "'=1", "plain", "-", "'a'")]
        text = files.table(["name", "mm"], rows)
        self.assertIn("\n'=1+1,-0.5\n", text)
        self.assertIn("\n-,-0.5\n'a',-0.5\n", text)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "a.csv"
            file.write_text(text)
            self.assertEqual(files.read_table(file), rows)


class Look(unittest.TestCase):
    """What the plan notices of what happens to a session's files."""

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
        self.at_ns = 0  # that of the clock is later by so much than what is looked at

    def glance(self, how="files", rebuild=False, archive=None):
        """Of the session, as the plan finds it; it is kept for the next time."""
        self.at_ns += 10_000_000_000
        now = time.time_ns() + self.at_ns
        with unittest.mock.patch.object(catalogue.time, "time_ns", return_value=now):
            known = catalogue.Catalogue(self.file, archive or self.archive, rebuild)
            glances = known.glances(["c/other", "c/s"], how)
            known.save({0: ["c/other", "c/s"]}, 50)
        return glances[1]

    def written_over(self, name, text):
        """In place, by another content of the same length, and its time is set back."""
        before = os.stat(self.session / name)
        time.sleep(0.02)  # file systems count in ticks
        with open(self.session / name, "r+") as stream:
            stream.write(text)
        os.utime(self.session / name, ns=(before.st_atime_ns, before.st_mtime_ns))
        after = os.stat(self.session / name)
        self.assertEqual((before.st_size, before.st_ino, before.st_mtime_ns), (after.st_size, after.st_ino, after.st_mtime_ns))

    def replaced(self, name):
        before = os.stat(self.session / name)
        (self.session / "new").write_text("two")
        os.utime(self.session / "new", ns=(before.st_atime_ns, before.st_mtime_ns))
        (self.session / "new").replace(self.session / name)

    def test_the_same_is_the_same_both_ways(self):
        first = self.glance()
        for how in ("files", "folders", "folders", "files"):
            self.assertEqual(self.glance(how), first)
        (self.session / "notes.txt").write_text("three")  # not read
        (self.session / "results").mkdir()
        for how in ("folders", "files"):
            self.assertEqual(self.glance(how), first)

    def test_sees_each_change_of_each_file(self):
        said = [self.glance()]
        for change in (
            lambda: self.written_over("boards/0.png", "two"),
            lambda: self.written_over("check/more/2.png", "two"),
            lambda: self.replaced("boards/1.png"),
            lambda: (self.session / "boards/1.png").rename(self.session / "boards/3.png"),
            lambda: (self.session / "boards/3.png").unlink(),
            lambda: (self.session / "rotation").mkdir() or (self.session / "rotation/0.png").write_text("one"),
            lambda: self.written_over("lamps.yaml", "two"),
            lambda: os.utime(self.session / "lamps.yaml"),
        ):
            change()
            said.append(self.glance())
            self.assertEqual(self.glance(), said[-1])
        self.assertEqual(len(set(said)), len(said))

    def test_folders_show_all_but_images_that_are_written_over(self):
        said = [self.glance("folders")]
        for change in (
            lambda: self.replaced("boards/1.png"),
            lambda: self.replaced("check/more/2.png"),
            lambda: (self.session / "boards/2.png").write_text("one"),
            lambda: self.written_over("lamps.yaml", "two"),
            lambda: self.written_over("check/truth.csv", "two"),
            lambda: (self.session / "gates.yaml").write_text("one"),
        ):
            change()
            said.append(self.glance("folders"))
            self.assertEqual(self.glance("folders"), said[-1])
        self.assertEqual(len(set(said)), len(said))
        self.written_over("boards/0.png", "two")
        self.assertEqual(self.glance("folders"), said[-1])  # as the page says
        self.assertNotEqual(self.glance("files"), said[-1])

    def test_links_that_lead_back_end_and_hide_nothing(self):
        first, digest = self.glance(), files.input_digests(self.session)
        os.symlink("..", self.session / "boards/up")
        os.symlink(".", self.session / "check/here")
        os.symlink("itself", self.session / "check/itself")
        for folder in "boards", "check":
            os.symlink(self.session, self.session / folder / "session")
        said = [first, self.glance()]
        self.assertNotEqual(files.input_digests(self.session), digest)
        self.written_over("check/more/2.png", "two")
        said += [self.glance(), self.glance("folders")]
        self.assertEqual(len(set(said)), 3)
        names = [name for name, _ in files.input_files(self.session)]
        self.assertIn("check/more/2.png", names)
        self.assertIn("check/itself", names)
        self.assertLess(len(names), 20)

    def test_links_to_each_other_have_an_end(self):
        for folder in range(9):
            (self.session / f"rotation/{folder}").mkdir(parents=True)
            for other in range(9):
                os.symlink(f"../{other}", self.session / f"rotation/{folder}/to{other}")
        begun = time.monotonic()
        self.glance()
        self.assertLessEqual(len(list(files.input_files(self.session))), 20 * files.MOST_FOLDERS)
        self.assertLess(time.monotonic() - begun, 5)

    def looked(self, days=0):
        """How, where nothing is asked for and sessions are many, so many days later."""
        now = time.time_ns() + self.at_ns + days * 86400 * 10**9
        with unittest.mock.patch.multiple(catalogue, FEW_SESSIONS=1):
            with unittest.mock.patch.object(catalogue.time, "time_ns", return_value=now):
                known = catalogue.Catalogue(self.file, self.archive)
                how = known.look_for(2)
                known.glances(["c/other", "c/s"], how)
                known.save({0: ["c/other", "c/s"]}, 50)
        return how

    def test_many_sessions_are_looked_at_by_folders_and_once_a_week_by_files(self):
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual(known.look_for(catalogue.FEW_SESSIONS), "files")
        said = [self.glance("folders")]  # the first look, which is at all
        self.assertEqual([self.looked(days) for days in (0, 1, 6)], ["folders"] * 3)
        self.written_over("boards/0.png", "two")
        self.assertEqual(self.glance("folders"), said[0])
        self.assertEqual([self.looked(days) for days in (8, 9, 14)], ["files", "folders", "folders"])
        self.assertNotEqual(self.glance("folders"), said[0])  # noticed within the week
        self.assertEqual([self.looked(days) for days in (21, 28, 35)], ["files"] * 3)  # a run once a week
        self.assertEqual(self.looked(-1), "files")  # the clock was set back
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual(known.look_for(catalogue.FEW_SESSIONS), "files")

    def test_what_is_as_new_as_the_look_is_looked_at_again(self):
        for how in ("files", "folders"):
            self.at_ns = -10_000_000_000
            new = self.glance(how, rebuild=True)
            self.at_ns = 0
            settled = self.glance(how)
            self.assertNotEqual(settled, new)
            self.assertEqual(self.glance(how), settled)

    def test_a_catalogue_that_is_rebuilt_damaged_or_anothers_knows_nothing(self):
        said = [self.glance(), self.glance(rebuild=True)]
        self.file.write_bytes(b"not a database, and longer than the head of one" * 50)
        said.append(self.glance())
        self.file.unlink()
        said.append(self.glance())
        whole = self.file.read_bytes()
        self.file.write_bytes(whole[:5000] + bytes(len(whole) - 5000))
        said.append(self.glance())
        moved = self.archive.rename(self.archive.with_name("moved"))
        said.append(self.glance(archive=moved))
        self.assertEqual(len(set(said)), len(said))
        self.assertEqual(self.glance(archive=moved), said[-1])

    def test_looks_at_the_files_of_which_the_digest_is(self):
        (self.session / "boards/nowhere.png").symlink_to("/nowhere")
        (self.session / "rotation").symlink_to(self.session / "boards")
        (self.session / "dispersion").write_text("a file")
        opened = os.open(self.archive, os.O_RDONLY)
        self.addCleanup(os.close, opened)
        seen = catalogue.Seen("c/s", opened)
        self.assertEqual(seen.files, [name for name, _ in files.input_files(self.session)])
        self.assertEqual(seen.of_places, catalogue.look_at("c/s", seen.places, opened))

    def test_only_sessions_that_changed_or_went_are_written(self):
        self.glance()
        later = unittest.mock.patch.object(catalogue.time, "time_ns", return_value=time.time_ns() + 10_000_000_000)
        later.start()
        self.addCleanup(later.stop)
        known = catalogue.Catalogue(self.file, self.archive)
        known.glances(["c/s"], "files")
        known.save({3: ["c/s"]}, 50)
        known = catalogue.Catalogue(self.file, self.archive)
        self.assertEqual((known.shard_of("c/s"), known.shard_of("c/other")), (3, None))
        before = self.file.stat().st_mtime_ns
        known.glances(["c/s"], "folders")
        known.save({3: ["c/s"]}, 50)
        self.assertEqual(self.file.stat().st_mtime_ns, before)


class Files(unittest.TestCase):
    def test_digest_is_of_names_and_contents_of_what_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            session = Path(folder)
            (session / "boards").mkdir()
            (session / "boards/0.png").write_text("one")
            first = files.input_digests(session)[0]
            (session / "notes.txt").write_text("not read")
            (session / "results").mkdir()
            (session / "results/boards").write_text("not read")
            os.utime(session / "boards/0.png", (1, 1))
            self.assertEqual(files.input_digests(session)[0], first)
            (session / "boards/0.png").rename(session / "boards/1.png")
            second = files.input_digests(session)[0]
            (session / "boards/1.png").write_text("two")
            self.assertEqual(len({first, second, files.input_digests(session)[0]}), 3)
            self.assertEqual(list(files.input_digests(session)[1]), ["boards"])

    def test_digest_of_all_inputs_is_that_of_earlier_versions(self):
        with tempfile.TemporaryDirectory() as folder:
            session, lines = Path(folder), ""
            for name in ("board.yaml", "boards/0.png", "boards/1.png", "lamps.yaml"):
                (session / name).parent.mkdir(exist_ok=True)
                (session / name).write_text(name)
                lines += f"{hashlib.sha256(name.encode()).hexdigest()}  {name}\n"
            inputs, parts = files.input_digests(session)
            self.assertEqual(inputs, hashlib.sha256(lines.encode()).hexdigest())
            self.assertEqual(list(parts), ["board.yaml", "boards", "lamps.yaml"])


if __name__ == "__main__":
    unittest.main()
