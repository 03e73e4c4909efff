#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Job of a shard: keys, atomic results, former results."""
import errno
import json
import os
import tempfile
import time
import unittest
import unittest.mock
from pathlib import Path

import parts  # noqa: F401
import catalogue
import files
import outcome
import shard


def there_soon(file):
    until = time.monotonic() + 10
    while not file.exists() and time.monotonic() < until:
        time.sleep(0.01)
    return file.exists()


class Shard(unittest.TestCase):
    def test_key_depends_on_inputs_programs_and_options(self):
        run = {"toolbox": "t", "camera": "", "bin": "/bin"}
        keys = [shard.compute_key("i", run), shard.compute_key("j", run), shard.compute_key("i", run | {"bin": "/other"})]
        keys += [shard.compute_key("i", run | {name: "x"}) for name in ("toolbox", "camera")]
        self.assertEqual(keys[0], keys[2])
        self.assertEqual(len(set(keys)), 4)

    def test_interrupted_publishing_is_completed_by_next_run(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            session = {"camera": "c", "session": "s", "verdict": "pass"}
            work = Path("work")
            (work / "c/s").mkdir(parents=True)
            for file in outcome.KEPT_FILES:
                (work / "c/s" / file).write_text(file)
            former = Path("sessions/c/s")
            former.mkdir(parents=True)
            for step in ("write_atomically", "result_folder"):  # fails there, then succeeds
                with unittest.mock.patch.object(shard, step, side_effect=KeyboardInterrupt):
                    self.assertRaises(KeyboardInterrupt, shard.publish, session, work)
            shard.publish(session, work)
            found = sorted(str(file.relative_to(former)) for file in former.rglob("*") if file.is_file())
            self.assertEqual(found, sorted([*outcome.KEPT_FILES.values(), "row.json"]))

    def test_unchanged_fingerprint_avoids_digests(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            run = {"toolbox": "t", "camera": "", "archive": folder, "version": "1"}
            run["bin"] = folder
            for name, text in (("c/1", "one"), ("c/2", "two")):
                (Path(name) / "boards").mkdir(parents=True)
                (Path(name) / "boards/0.png").write_text(text)
            made = []

            def start_session(run, each, name, work):
                (work / name).mkdir(parents=True)
                made.append(name)

            def read_outcome(folder, name, exit_code, output):
                return {"camera": "c", "session": name[-1], "verdict": "pass"}

            def reprocess(**fingerprints):
                digested, made[:] = [], []
                digests = lambda session: digested.append(session.name) or catalogue.input_digests(session)
                fingerprints = {f"c/{name[1:]}": fingerprint for name, fingerprint in fingerprints.items()}
                with unittest.mock.patch.multiple(
                    shard, start_session=start_session, read_outcome=read_outcome, input_digests=digests, BatchProcess=unittest.mock.DEFAULT
                ) as mocks:
                    mocks["BatchProcess"]().answer.return_value = 0, 0.5, ""
                    rows = shard.reprocess(run, "7", fingerprints, None, 0)
                files.write_atomically(".state/rows/7.csv", files.table(outcome.SHARD_COLUMNS, rows))
                self.assertEqual([row["fingerprint"] for row in rows], list(fingerprints.values()))
                return digested, [name[-1] for name in made]

            self.assertEqual(reprocess(s1="a", s2="b"), (["1", "2"], ["1", "2"]))
            self.assertEqual(reprocess(s1="a", s2="b"), ([], []))
            self.assertEqual(reprocess(s1="a", s2="c"), (["2"], []))  # changed times only
            Path("c/2/boards/0.png").write_text("three")
            self.assertEqual(reprocess(s1="a", s2="d"), (["2"], ["2"]))
            (Path("sessions/c/1/row.json")).unlink()
            self.assertEqual(reprocess(s1="a", s2="d"), (["1"], ["1"]))
            row = Path("sessions/c/1/row.json")
            row.write_text(row.read_text().replace('"pass"', '"gate"'))
            self.assertEqual(reprocess(s1="a", s2="d"), (["1"], ["1"]), "changed by hand")
            self.assertEqual(json.loads(row.read_text())["verdict"], "pass")
            self.assertFalse(Path("former").exists(), "a changed result is no former one")
            run["toolbox"] = "u"
            self.assertEqual(reprocess(s1="a", s2="d"), (["1", "2"], ["1", "2"]))

    def test_reads_no_row_if_a_file_of_the_result_was_changed(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            (Path("work") / "c/s").mkdir(parents=True)
            (Path("work") / "c/s/calibration.yaml").write_text("whole\n")
            shard.publish({"camera": "c", "session": "s", "verdict": "pass", "key": "k"}, Path("work"))
            place = Path("sessions/c/s")
            self.assertEqual(shard.read_row(place)["key"], "k")
            (place / "calibration.yaml").unlink()
            self.assertIsNone(shard.read_row(place))
            (place / "calibration.yaml").write_text("who")
            self.assertIsNone(shard.read_row(place))
            (place / "calibration.yaml").write_text("whole\n")
            self.assertEqual(shard.read_row(place)["key"], "k")

    def test_keeps_last_other_inputs(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            place = Path("sessions/c/s")
            place.mkdir(parents=True)
            for inputs, former in (("a", ""), ("a", ""), ("b", "a"), ("b", "a"), ("a", "b")):
                found = shard.expect_inputs("c/s", inputs, {"check": 2})
                self.assertEqual(found, {"files": "check 2", "expected": "check 2", "former_inputs": former})
                (place / "row.json").write_text(json.dumps(found | {"inputs": inputs}))

    def test_restarts_program_that_died(self):
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "vlp-calibrate"
            program.write_text("""#!/bin/bash
[ "$*" = --batch-stdin ] || exit 7
read -r line
[[ $line != *dies* ]] || kill -9 $$
while echo '{"exit_code": 3, "cpu_s": 0.25, "output": "'$BASHPID'"}' && read -r line; do true; done
exit 5
""")
            program.chmod(0o755)
            with open(Path(folder) / "lock", "w") as lock:
                each = shard.BatchProcess(program, lock)

                def answer(arguments):
                    each.ask(arguments)
                    return each.answer()

                self.assertEqual(answer(["dies"]), (-9, 0, ""))
                one, two = answer(["lives"]), answer([Path("lives")])
                self.assertEqual(one[:2], (3, 0.25))
                self.assertEqual(one, two)  # the same process
                self.assertEqual(each.end(), 5)  # it had no further input

    def run_of_two_sessions(self, program):
        """Returns the arguments of reprocess() for c/1 and c/2, in a separate folder."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)
        for name in ("c/1", "c/2"):
            (Path("archive") / name / "boards").mkdir(parents=True)
        Path("vlp-calibrate").write_text(program)
        Path("vlp-calibrate").chmod(0o755)
        lock = self.enterContext(open("lock", "w"))
        run = {"toolbox": "t", "camera": "", "version": "1"}
        run |= {"archive": str(Path("archive").absolute()), "bin": folder.name}
        return run, "7", {"c/1": "a", "c/2": "b"}, lock, 0

    def test_publishes_result_while_next_session_runs(self):
        run = self.run_of_two_sessions("""#!/bin/bash
while read -r line; do
  if [[ $line == *c/2* ]]; then
    touch begun
    for i in {1..200}; do [ -e failed/c/1/row.json ] && touch seen && break; sleep 0.05; done
  fi
  echo '{"exit_code": 1, "cpu_s": 0.5, "output": "words"}'
done
""")
        publish, next_at_work = shard.publish, {}

        def publish_after_start_of_next(row, *others):
            next_at_work[row["session"]] = there_soon(Path("begun")) and not Path("seen").exists()
            return publish(row, *others)

        with unittest.mock.patch.object(shard, "publish", publish_after_start_of_next):
            rows = shard.reprocess(*run)
        self.assertEqual(next_at_work, {"1": True, "2": False})
        self.assertTrue(Path("seen").exists())  # publishing did not wait for the answer of c/2
        self.assertEqual([row["verdict"] for row in rows], ["crashed", "crashed"])
        self.assertEqual([row["session"] for row in rows], ["1", "2"])

    def test_failed_publishing_ends_running_session(self):
        run = self.run_of_two_sessions("""#!/bin/bash
read -r line
echo '{"exit_code": 1, "cpu_s": 0.5, "output": "words"}'
read -r line
echo $$ >.process && mv .process process
exec sleep 60
""")

        def publish(*arguments):
            self.assertTrue(there_soon(Path("process")))
            raise OSError(errno.ENOSPC, "No space left on device")

        with unittest.mock.patch.object(shard, "publish", publish):
            self.assertRaisesRegex(OSError, "No space left", shard.reprocess, *run)
        self.assertRaises(ProcessLookupError, os.kill, int(Path("process").read_text()), 0)

    def test_keeps_requested_number_of_former_results(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            work = Path("work")
            (work / "c/s").mkdir(parents=True)

            def publish(key, keep, verdict="pass"):
                (work / "c/s/session.json").unlink(missing_ok=True)  # a new file, as programs write it
                (work / "c/s/session.json").write_text(key)
                shard.publish({"camera": "c", "session": "s", "verdict": verdict, "key": key * 4}, work, keep)
                for age, file in enumerate(sorted(Path(".").rglob("row.json"), key=lambda file: file.stat().st_mtime_ns)):
                    os.utime(file, ns=(age, age))  # times within one tick of the clock differ
                return sorted(path.name for path in Path("former").rglob("*") if path.is_dir() and path.name.endswith("key"))

            self.assertEqual(publish("1key", 2), [])
            self.assertEqual(publish("2key", 2, "no result"), ["1key1key1key"])
            self.assertEqual(publish("3key", 2), ["1key1key1key", "2key2key2key"])
            self.assertFalse(Path("failed/c/s").exists())
            self.assertEqual(publish("4key", 2), ["2key2key2key", "3key3key3key"])
            self.assertEqual(Path("former/c/s/3key3key3key/session.json").read_text(), "3key")
            self.assertEqual(Path("sessions/c/s/session.json").read_text(), "4key")
            self.assertEqual(publish("5key", 0), [])
            self.assertEqual(publish("6key", 1, "crashed"), ["5key5key5key"])
            self.assertEqual(publish("7key", 1), ["5key5key5key"])  # a crash does not replace it
            self.assertEqual(publish("8key", 1), ["7key7key7key"])
            self.assertEqual(publish("8key", 1), ["8key8key8key"])  # unchanged

    def test_keeps_former_result_if_session_fails_twice(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            work = Path("work")
            (work / "c/s").mkdir(parents=True)
            for key, verdict in (("good", "pass"), ("bad1", "no result"), ("bad2", "no result")):
                (work / "c/s/session.json").unlink(missing_ok=True)
                (work / "c/s/session.json").write_text(key)
                shard.publish({"camera": "c", "session": "s", "verdict": verdict, "key": key}, work, 1)
            self.assertEqual([file.read_text() for file in Path("former").rglob("session.json")], ["good"])

    def test_former_result_survives_kill_at_any_time(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            work = Path("work")
            (work / "c/s").mkdir(parents=True)

            def publish(key):
                (work / "c/s/session.json").unlink(missing_ok=True)
                (work / "c/s/session.json").write_text(key)
                shard.publish({"camera": "c", "session": "s", "verdict": "pass", "key": key}, work, 1)

            def killed_after(moves):
                """Ends the process after `moves` renamings."""
                rename, left = Path.rename, [moves]

                def once_more(path, target):
                    if left[0] == 0:
                        raise KeyboardInterrupt
                    left[0] -= 1
                    return rename(path, target)

                return unittest.mock.patch.object(Path, "rename", once_more)

            publish("first")
            for moves in range(5):
                key = f"key {moves}"
                there = {file.read_text() for file in Path("sessions").rglob("session.json")}
                try:
                    with killed_after(moves):
                        publish(key)
                except KeyboardInterrupt:
                    kept = {file.read_text() for top in ("sessions", "former") for file in Path(top).rglob("session.json")}
                    self.assertLessEqual(there, kept, moves)
                    for former in Path("former/c/s").glob("*"):
                        self.assertTrue((former / "row.json").exists(), moves)
                    if shard.find_current_row("c/s", key) is None:
                        publish(key)
                kept = {file.read_text() for file in Path("former").rglob("session.json")}
                self.assertLessEqual(there, kept, moves)
                self.assertEqual(Path("sessions/c/s/session.json").read_text(), key)
            publish("last")
            self.assertEqual([file.read_text() for file in Path("former").rglob("session.json")], [key])

    def test_replaces_former_result_with_unreadable_row(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            work, place = Path("work"), Path("sessions/c/s")
            for unreadable in ("", "{"):
                (work / "c/s").mkdir(parents=True, exist_ok=True)
                place.mkdir(parents=True, exist_ok=True)
                (place / "row.json").write_text(unreadable)
                shard.publish({"camera": "c", "session": "s", "verdict": "pass", "key": "k"}, work, 1)
                self.assertEqual(json.loads((place / "row.json").read_text())["key"], "k")
                self.assertFalse(Path("former/c/s").exists())


if __name__ == "__main__":
    unittest.main()
