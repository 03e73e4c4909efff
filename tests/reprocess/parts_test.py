#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of scripts/reprocess, whose folder is the argument."""
import json
import os
import random
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv.pop(1))
try:
    import yaml  # noqa: F401
except ImportError:
    print("yaml is missing: scripts/setup.sh --batch")
    sys.exit(77)
import changes
import files
import outcome
import plan
import shard


def row(number, verdict, mean, inputs="same"):
    mean = f"{mean:.6g}" if mean is not None else ""
    name = {"camera": f"c{number // 2:04d}", "session": f"s{number % 2}"}
    return {**name, "verdict": verdict, "mean_mm": mean, "inputs": inputs}


class Changes(unittest.TestCase):
    def test_counts_each_kind_once(self):
        before = [row(0, "pass", 1), row(1, "pass", 1), row(2, "gate", 1), row(3, "pass", 1)]
        before += [row(4, "no result", None), row(5, "pass", 1), row(6, "pass", 1), row(9, "pass", 1)]
        now = [row(0, "pass", 0.5), row(1, "pass", 2), row(2, "gate", 1), row(3, "no result", None)]
        now += [row(4, "pass", 1), row(5, "crashed", None), row(6, "pass", 2, "other"), row(8, "pass", 1)]
        found, pairs = changes.changes_of(now, before)
        self.assertEqual([found[key] for key in ("better", "worse", "same", "pairs")], [1, 1, 1, 3])
        self.assertEqual(found["newly_failed"], ["c0001/s1", "c0002/s1"])
        self.assertEqual(found["newly_good"], ["c0002/s0"])
        self.assertEqual([found[key] for key in ("other_inputs", "only_now", "only_before")], [1, 1, 1])
        self.assertEqual([change for _, _, change in pairs], [1, -0.5, 0])
        self.assertIn("cannot tell", found["verdict"])

    def test_says_better_or_worse_only_with_evidence(self):
        def verdict(shift):
            chance = random.Random(1)
            before = [row(i, "pass", 1) for i in range(100)]
            now = [row(i, "pass", 1 + shift + chance.gauss(0, 0.05)) for i in range(100)]
            return changes.changes_of(now, before)[0]["verdict"]

        self.assertEqual([verdict(shift) for shift in (-0.05, 0, 0.05)], ["better", "no evidence", "worse"])

    def test_interval_holds_the_truth_19_times_in_20(self):
        # Sessions of a camera alike: were they counted alone, only 83 % of the intervals would.
        chance = random.Random(2)
        held = 0
        for _ in range(1000):
            differences = []
            for camera in range(40):
                shift = chance.gauss(0.3, 1)
                differences += [(camera, shift)] * 2
            _, (low, high) = changes.interval_of(differences)
            held += low <= 0.3 <= high
        self.assertGreater(held, 920)  # 950 expected, less 4 sigma of 7
        self.assertLess(held, 975)

    def test_gates_hold_what_they_say(self):
        counts = changes.counts_of([row(0, "pass", 1), row(1, "gate", 3), row(2, "no result", None), row(3, "crashed", None)])
        gates = {"no_result": 2, "no_result_share": 0.4, "gate_share": 0.25, "mean_mm": 2, "p90_mm": 2, "newly_failed": 0}
        passed = [gate["passed"] for gate in changes.check_gates(gates, counts, None)]
        self.assertEqual(passed, [True, False, True, True, False, False])

    def test_gates_without_a_pair_are_not_met(self):
        now, before = [row(0, "pass", 1, "new")], [row(0, "pass", 1, "old")]
        found, _ = changes.changes_of(now, before)
        gates = {"newly_failed": 0, "worse_share": 1, "mean_difference_mm": 1}
        passed = [gate["passed"] for gate in changes.check_gates(gates, changes.counts_of(now), found)]
        self.assertEqual(passed, [False, False, False])

    def test_less_than_a_micrometre_is_the_same(self):
        now = [row(0, "pass", 1.0005), row(1, "pass", 0.9995), row(2, "pass", 1.002)]
        found, _ = changes.changes_of(now, [row(i, "pass", 1) for i in range(3)])
        self.assertEqual([found[key] for key in ("better", "worse", "same")], [0, 1, 2])

    def test_students_quantile_is_that_of_tables(self):
        for freedoms, quantile in ((19, 2.093), (50, 2.0086), (100, 1.984)):
            self.assertAlmostEqual(changes.student_975(freedoms), quantile, delta=0.001)

    def test_refuses_gates_that_it_does_not_know(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "gates.yaml"
            for text, problem in (
                ("gates: {no_result: 0}", "should begin with format"),
                ("format: vlp-archive-gates/1\n", "should hold"),
                ("format: vlp-archive-gates/1\ngates: {}\n", "should hold"),
                ("format: vlp-archive-gates/1\ngates: {odd: 1}\n", "gate 'odd' is unknown"),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: .inf}\n", "should be a number"),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: true}\n", "should be a number"),
                ("format: vlp-archive-gates/1\ngates: {worse_share: 7}\n", "a share from 0 to 1, not 7"),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: -1}\n", "should be 0 or more, not -1"),
                ("format: [", "is not YAML"),
            ):
                file.write_text(text)
                with self.assertRaisesRegex(ValueError, problem):
                    changes.read_gates(file)


class Outcome(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.work = Path(self.folder.name)

    def session(self, verdict, reason="", metrics=()):
        text = json.dumps({"verdict": verdict, "reason": reason, "metrics": list(metrics)})
        (self.work / "session.json").write_text(text)

    def outcome(self, ended=0, said=""):
        return outcome.outcome_of(self.work, "c/s", ended, said)

    def test_is_what_session_json_says(self):
        self.session("gate", "rms_px is 2 px", [{"name": "rms_px", "step": "lens", "value": 2.00000049}])
        evaluation = {"captures": 3, "fixes": 2, "missing_share": 1 / 3}
        evaluation["horizontal"] = {name: 0.25 for name in ("mean_mm", "median_mm", "p90_mm", "max_mm")}
        (self.work / "evaluation.json").write_text(json.dumps(evaluation))
        found = self.outcome(1)
        self.assertEqual((found["camera"], found["session"]), ("c", "s"))
        self.assertEqual((found["verdict"], found["reason"]), ("gate", "rms_px is 2 px"))
        self.assertEqual((found["fixes"], found["mean_mm"], found["rms_px"]), (2, "0.25", "2"))

    def test_no_result_has_no_figures(self):
        self.session("no result", "lens: boards: holds no image")
        self.assertEqual(self.outcome(2)["verdict"], "no result")
        self.assertNotIn("rms_px", self.outcome(2))

    def test_without_session_json_it_crashed(self):
        found = self.outcome(-9)
        self.assertEqual((found["verdict"], found["reason"]), ("crashed", "vlp-calibrate ended with exit code -9"))
        said = "vlp-calibrate: error: lens.yaml: cannot be written: No space left on device\n"
        self.assertTrue(self.outcome(2, said)["reason"].endswith("No space left on device"))
        self.assertIn("an hour", self.outcome(124)["reason"])


class Shard(unittest.TestCase):
    def test_key_is_of_inputs_programs_and_options(self):
        run = {"toolbox": "t", "camera": "", "session_gates_digest": "", "bin": "/bin"}
        keys = [shard.key_of("i", run), shard.key_of("j", run), shard.key_of("i", run | {"bin": "/other"})]
        keys += [shard.key_of("i", run | {name: "x"}) for name in ("toolbox", "camera", "session_gates_digest")]
        self.assertEqual(keys[0], keys[2])
        self.assertEqual(len(set(keys)), 5)

    def test_a_session_whose_publishing_was_interrupted_is_whole_the_next_time(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            session = {"camera": "c", "session": "s", "verdict": "pass"}
            work = Path("work")
            (work / "c/s").mkdir(parents=True)
            for file in outcome.KEPT:
                (work / "c/s" / file).write_text(file)
            former = Path("sessions/c/s")
            former.mkdir(parents=True)
            for step in ("write_whole", "place_of"):  # fails there, then goes through
                with unittest.mock.patch.object(shard, step, side_effect=KeyboardInterrupt):
                    self.assertRaises(KeyboardInterrupt, shard.publish, session, work)
            shard.publish(session, work)
            found = sorted(str(file.relative_to(former)) for file in former.rglob("*") if file.is_file())
            self.assertEqual(found, sorted([*outcome.KEPT.values(), "row.json"]))


class Plan(unittest.TestCase):
    def test_shards_end_together(self):
        def lengths(*arguments):
            ends = plan.shard_ends(*arguments)
            return [end - start for start, end in zip([0, *ends], ends)]

        self.assertEqual(lengths(100, 50, 2), [50, 50])
        self.assertEqual(lengths(110, 50, 2), [27, 28, 27, 28])
        self.assertEqual(lengths(3, 50, 8), [1, 1, 1])
        self.assertEqual(lengths(10, 3, 1), [2, 3, 2, 3])
        self.assertEqual(lengths(810, 50, 2), [50] * 16 + [10])


class Files(unittest.TestCase):
    def test_digest_is_of_names_and_contents_of_what_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            session = Path(folder)
            (session / "boards").mkdir()
            (session / "boards/0.png").write_text("one")
            first = files.input_digest(session)
            (session / "notes.txt").write_text("not read")
            (session / "results").mkdir()
            (session / "results/boards").write_text("not read")
            os.utime(session / "boards/0.png", (1, 1))
            self.assertEqual(files.input_digest(session), first)
            (session / "boards/0.png").rename(session / "boards/1.png")
            second = files.input_digest(session)
            (session / "boards/1.png").write_text("two")
            self.assertEqual(len({first, second, files.input_digest(session)}), 3)


if __name__ == "__main__":
    unittest.main()
