#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Assignment of sessions to shards, and pending shards."""
import os
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import parts  # noqa: F401
import plan
import summary


class Plan(unittest.TestCase):
    def test_shards_have_equal_lengths(self):
        def lengths(*arguments):
            ends = plan.compute_shard_ends(*arguments)
            return [end - start for start, end in zip([0, *ends], ends)]

        self.assertEqual(lengths(100, 50, 2), [50, 50])
        self.assertEqual(lengths(110, 50, 2), [27, 28, 27, 28])
        self.assertEqual(lengths(3, 50, 8), [1, 1, 1])
        self.assertEqual(lengths(10, 3, 1), [2, 3, 2, 3])
        self.assertEqual(lengths(810, 50, 2), [50] * 16 + [10])

    def test_session_stays_in_its_shard_of_large_archive(self):
        sessions = [f"c/{i:03d}" for i in range(85)]
        known = unittest.mock.Mock(settings={"shard_size": "10"}, shard_of=lambda name: numbers.get(name))
        numbers = {}
        first = plan.assign_shards(sessions, known, 10, 1)
        self.assertEqual([len(names) for names in first.values()], [10] * 8 + [5])
        numbers = {name: number for number, names in first.items() for name in names}
        del sessions[20:30]  # a whole shard
        sessions += [f"b/{i:03d}" for i in range(17)]
        then = plan.assign_shards(sorted(sessions), known, 10, 1)
        self.assertEqual([(number, len(names)) for number, names in then.items() if number not in (0, 1, 3, 4, 5, 6, 7)], [(8, 10), (9, 10), (10, 2)])
        for number in (0, 1, 3, 4, 5, 6, 7):
            self.assertEqual(then[number], first[number])
        self.assertEqual(sorted(name for names in then.values() for name in names), sorted(sessions))
        self.assertEqual(plan.assign_shards(sorted(sessions), known, 5, 1)[0], sorted(sessions)[:5])  # another size

    def test_describes_scan(self):
        known = unittest.mock.Mock(all_files_at_ns=lambda: 1_773_489_600 * 10**9)  # at noon in UTC
        self.assertEqual(plan.describe_scan(known, "files"), "checked all files")
        self.assertEqual(plan.describe_scan(known, "folders"), "checked folders and tables, all files last on 2026-03-14")
        known.all_files_at_ns = lambda: 0
        self.assertEqual(plan.describe_scan(known, "folders"), "checked folders and tables, never all files")

    def test_lists_shards_that_are_not_finished(self):
        with tempfile.TemporaryDirectory() as folder:
            state, summary_file = Path(folder) / ".state", Path(folder) / "summary.csv"

            def write(name, at, text=""):
                file = Path(folder) / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text)
                os.utime(file, (at, at))

            write(".state/run.json", 10)
            for number, (listed, made) in enumerate([(5, 20), (25, 20), (5, 31), (5, 8), (5, 20), (5, None)]):
                write(f".state/shards/{number}.list", listed)
                if made:
                    write(f".state/rows/{number}.csv", made, "c,s,crashed,\n" if number == 4 else "")
            self.assertEqual(plan.list_pending_shards(state, summary_file), (list("012345"), ["4"]))
            write("summary.csv", 30)
            self.assertEqual(plan.list_pending_shards(state, summary_file), (list("12345"), ["4", "5"]))
            self.assertEqual(plan.list_pending_shards(state, summary_file, {0: ["c/s"]})[1], ["0", "4", "5"])

    def test_finds_results_that_were_changed_or_lost(self):
        with tempfile.TemporaryDirectory() as folder:
            names, results = [f"c/{i}" for i in range(5)], Path(folder)
            for i, name in enumerate(names[1:], 1):
                file = results / ("failed" if i == 1 else "sessions") / name / "row.json"
                file.parent.mkdir(parents=True)
                file.write_text("row" if i != 3 else "")
                os.utime(file, (10, 30 if i == 4 else 10))
                os.utime(file.parent, (10, 10))
            self.assertEqual(plan.find_changed_results(results, {7: names}), {}, "rows of no run")
            (results / ".state/rows").mkdir(parents=True)
            (results / ".state/rows/000007.csv").touch()
            os.utime(results / ".state/rows/000007.csv", (20, 20))
            self.assertEqual(plan.find_changed_results(results, {7: names}), {7: ["c/0", "c/3", "c/4"]})


if __name__ == "__main__":
    unittest.main()
