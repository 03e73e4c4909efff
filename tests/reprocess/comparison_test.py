#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Comparison of two runs, gates of the archive, and differences between two results of a session."""
import random
import re
import tempfile
import unittest
from pathlib import Path

import yaml

import parts  # noqa: F401
import changes
import diff


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
        found, pairs = changes.compare_results(now, before)
        self.assertEqual([found[key] for key in ("better", "worse", "same", "pairs")], [1, 1, 1, 3])
        self.assertEqual(found["newly_failed"], ["c0001/s1", "c0002/s1"])
        self.assertEqual(found["lost_with_changed_inputs"], [])
        self.assertEqual(found["newly_succeeded"], ["c0002/s0"])
        self.assertEqual([found[key] for key in ("changed_inputs", "only_now", "only_before")], [1, 1, 1])
        self.assertEqual(found["sessions_with_changed_inputs"], ["c0003/s0"])
        self.assertEqual([change for _, _, change in pairs], [1, -0.5, 0])
        self.assertIn("no comparison with fewer than", found["verdict"])

    def test_verdict_is_inconclusive_without_evidence(self):
        def verdict(shift):
            chance = random.Random(1)
            before = [row(i, "pass", 1) for i in range(100)]
            now = [row(i, "pass", 1 + shift + chance.gauss(0, 0.05)) for i in range(100)]
            return changes.compare_results(now, before)[0]["verdict"]

        self.assertEqual([verdict(shift) for shift in (-0.05, 0, 0.05)], ["better", "inconclusive", "worse"])

    def test_verdict_is_the_same_without_changes(self):
        for cameras in (4, 42):
            rows = [row(2 * i, "pass", 1) for i in range(cameras)]
            self.assertEqual(changes.compare_results(rows, rows)[0]["verdict"], "the same")

    def test_names_suspects_and_inputs_lost_since_earlier_results(self):
        rows = [row(0, "review", 1, "0") | {"suspect": "is a copy of c/1"}, row(1, "pass", 1) | {"files": "boards 20, check 6"}]
        before = [row(1, "pass", 1) | {"expected": "boards 20, check 12"}]
        expected = ["c0000/s0: is a copy of c/1", "c0000/s1: check has 6 of 12 files"]
        self.assertEqual(changes.list_suspects(rows, before), expected)
        rows[1]["suspect"] = "mean_mm is 9; check has 6 of 12 files"
        self.assertEqual(changes.list_suspects(rows, before)[1], "c0000/s1: mean_mm is 9; check has 6 of 12 files")

    def test_names_sessions_exchanged_with_earlier_results_and_those_of_another_archive(self):
        rows, before = ([row(i, "pass", 1, str(i ^ exchanged)) for i in range(3)] for exchanged in (1, 0))
        rows[2]["inputs"] = "2"
        words = ["c0000/s0: has the inputs that c0000/s1 had: renamed or exchanged?", "c0000/s1: has the inputs that c0000/s0 had: renamed or exchanged?"]
        self.assertEqual(changes.list_suspects(rows, before), words)
        foreign = changes.list_suspects(rows, [row(i, "pass", 1, f"foreign {i}") for i in range(3)])
        self.assertEqual(foreign, ["--previous: all of 3 sessions have other inputs there: is it of this archive?"])

    def test_interval_covers_truth_in_95_percent(self):
        # Sessions of a camera are correlated: intervals over sessions would cover only 83 %.
        chance = random.Random(2)
        held = 0
        for _ in range(1000):
            differences = []
            for camera in range(40):
                shift = chance.gauss(0.3, 1)
                differences += [(camera, shift)] * 2
            _, (low, high) = changes.compute_interval(differences)
            held += low <= 0.3 <= high
        self.assertGreater(held, 920)  # 950 are expected, minus 4 sigma of 7
        self.assertLess(held, 975)

    def test_gates_compare_their_values(self):
        counts = changes.count_verdicts([row(0, "pass", 1), row(1, "gate", 3), row(2, "no result", None), row(3, "crashed", None)])
        gates = {"no_result": 2, "no_result_fraction": 0.4, "gate_fraction": 0.25, "mean_mm": 2, "p90_mm": 2, "newly_failed": 0}
        passed = [gate["passed"] for gate in changes.check_gates(gates, counts, None, {})]
        self.assertEqual(passed, [True, False, True, True, False, False])

    def test_gates_of_counts_limit_the_items_of_their_lists(self):
        end = {"camera": "c", "session": "s", "date": "2026-03-14"}
        change = {"column": "focal_x_px", "kind": "step", "change": 1.7, "sd": 0.1, "before": end, "since": end | {"date": "2026-04-01"}}
        lamp = {"room": "hall", "map": "0123", "lamp": 2, "displacement_mm": [3, -4], "before": end, "since": end}
        found = {"between_sessions": {"focal": 0.1, "lamps": 0.1}, "cameras": [{"camera": "c", "changes": [change]}], "lamps": [lamp]}
        items = changes.collect_gate_items(["c/1", "c/2"], ["d/1"], found)
        self.assertEqual(items["cameras_changed"], ["c: focal_x_px +1.7, step between 2026-03-14 and 2026-04-01"])
        self.assertEqual(items["lamps_moved"], ["hall lamp 2 (map 0123): 5.00 mm, step between 2026-03-14 and 2026-03-14"])
        counts = changes.count_verdicts([row(0, "pass", 1)])
        limits = {"vanished": 1, "lost_results": 1, "cameras_changed": 0, "lamps_moved": 1}
        checked = changes.check_gates(limits, counts, None, items)
        self.assertEqual([(gate["value"], gate["passed"]) for gate in checked], [(2, False), (1, True), (1, False), (1, True)])
        untested = changes.collect_gate_items([], [], {"between_sessions": {"focal": None, "lamps": None}, "cameras": [], "lamps": []})
        checked = changes.check_gates(limits, counts, None, untested)
        self.assertEqual([gate["passed"] for gate in checked], [True, True, False, False])
        self.assertEqual(changes.DEFAULT_GATES, {"vanished": 0, "suspect": 0})

    def test_finds_vanished_sessions_and_lost_results(self):
        rows = [row(0, "pass", 1), row(1, "no result", None), row(2, "crashed", None), row(3, "no result", None)]
        before = [row(1, "pass", 1), row(3, "no result", None), row(4, "pass", 1)]
        self.assertEqual(changes.find_vanished_sessions(rows, ["c0000/s0", "x/y"], before), ["c0002/s0", "x/y"])
        self.assertEqual(changes.find_lost_results(rows, before, lambda name: name == "c0001/s0"), ["c0000/s1", "c0001/s0"])

    def test_is_incomplete_without_results_or_if_a_gate_on_them_fails(self):
        for verdicts, limits, expected in (
            (["no result", "crashed"], {}, True),
            (["no result", "pass"], {}, False),
            (["no result", "gate"], {"no_result_fraction": 0.4}, True),
            (["no result", "review"], {"no_result": 1, "mean_mm": 0}, False),
        ):
            counts = changes.count_verdicts([row(i, verdict, None) for i, verdict in enumerate(verdicts)])
            checked = changes.check_gates(limits, counts, None, {})
            self.assertEqual(changes.is_incomplete(counts, checked), expected, (verdicts, limits))

    def test_gates_without_pairs_fail(self):
        gates = {"newly_failed": 0, "worse_fraction": 1, "mean_difference_mm": 1}

        def passed(now, before):
            found, _ = changes.compare_results(now, before)
            return [gate["passed"] for gate in changes.check_gates(gates, changes.count_verdicts(now), found, {})]

        self.assertEqual(passed([row(0, "pass", 1, "new")], [row(0, "pass", 1, "old")]), [True, False, False])
        self.assertEqual(passed([row(0, "pass", 1)], [row(1, "pass", 1)]), [False, False, False])

    def test_counts_lost_results_with_changed_inputs(self):
        before = [row(i, "pass", 1, "old") for i in range(3)]
        now = [row(0, "no result", None, "new"), row(1, "review", 1, "new"), row(2, "no result", None, "old")]
        found, pairs = changes.compare_results(now, before)
        self.assertEqual((found["changed_inputs"], found["sessions_with_changed_inputs"]), (2, ["c0000/s0", "c0000/s1"]))
        self.assertEqual(found["newly_failed"], ["c0000/s0", "c0001/s0"])
        self.assertEqual(found["lost_with_changed_inputs"], ["c0000/s0"])
        self.assertEqual(pairs, [])
        gates = changes.check_gates({"newly_failed": 1}, changes.count_verdicts(now), found, {})
        self.assertEqual([(gate["value"], gate["passed"]) for gate in gates], [(2, False)])

    def test_failed_sessions_count_without_gate_fraction(self):
        counts = changes.count_verdicts([row(0, "pass", 1), row(1, "gate", 1), row(2, "review", 1)])
        self.assertEqual((counts["pass"], counts["review"], counts["gate"]), (1, 1, 1))
        self.assertEqual(changes.count_failed_sessions(counts, []), 1)
        gates = changes.check_gates({"gate_fraction": 0.5}, counts, None, {})
        self.assertEqual(changes.count_failed_sessions(counts, gates), 0)

    def test_changes_below_one_micrometer_are_equal(self):
        now = [row(0, "pass", 1.0005), row(1, "pass", 0.9995), row(2, "pass", 1.002)]
        found, _ = changes.compare_results(now, [row(i, "pass", 1) for i in range(3)])
        self.assertEqual([found[key] for key in ("better", "worse", "same")], [0, 1, 2])

    def test_student_quantile_matches_tables(self):
        for freedoms, quantile in ((19, 2.093), (50, 2.0086), (100, 1.984)):
            self.assertAlmostEqual(changes.student_quantile_975(freedoms), quantile, delta=0.001)

    def test_rejects_invalid_gates(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "gates.yaml"
            for text, problem in (
                ("gates: {no_result: 0}", "should begin with format"),
                ("format: vlp-archive-gates/1\n", "should hold"),
                ("format: vlp-archive-gates/1\ngates: {}\n", "should hold"),
                ("format: vlp-archive-gates/1\ngates: {odd: 1}\n", "gate 'odd' is unknown; there are: no_result, .*cameras_changed, "),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: .inf}\n", "should be a number"),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: true}\n", "should be a number"),
                ("format: vlp-archive-gates/1\ngates: {worse_fraction: 7}\n", "a fraction from 0 to 1, not 7"),
                ("format: vlp-archive-gates/1\ngates: {mean_mm: -1}\n", "should be 0 or more, not -1"),
                ("format: [", "is not YAML"),
            ):
                file.write_text(text)
                with self.assertRaisesRegex(ValueError, problem):
                    changes.read_gates(file)


class Diff(unittest.TestCase):
    def test_lists_only_differences(self):
        def result(verdict, focal, mean, warnings, parts):
            step = {"name": "check", "warnings": warnings}
            metrics = [{"name": "mean_mm", "step": "evaluate", "value": mean}]
            metrics += [{"name": "rms_px", "step": "lens", "value": 1}]
            session = {"metrics": metrics, "steps": [step], "version": "1"}
            session["calibration"] = {"focal_px": focal, "lens_model": "x"}
            return {"verdict": verdict, "reason": "", "parts": parts}, session

        before = result("pass", [260, 261], 0.2, [], {"lamps.yaml": "a", "check": "b"})
        now = result("review", [260, 261.5], 0.3, ["the residuals; they show"], {"lamps.yaml": "c", "check": "b"})
        said = "\n".join(diff.list_differences(before, now))
        for words in ("verdict     pass -> review", "inputs      lamps.yaml\n", "1 -> 1 (the same)", "2 of 4 differ"):
            self.assertIn(words, said)
        self.assertIn("  evaluate mean_mm: 0.2 -> 0.3 (+0.1)", said)
        self.assertIn("  calibration focal_px y: 261 -> 261.5 (+0.5)", said)
        self.assertIn("  + check: the residuals; they show", said)
        self.assertEqual(len(said.splitlines()), 7)

    def test_example_of_page_passes_with_one_damaged_session_of_ten(self):
        page = (Path(__file__).parents[2] / "scripts/reprocess/README.md").read_text()
        limits = yaml.safe_load(re.search(r"'(gates: {.*})' >out/gates.yaml", page)[1])["gates"]
        rows = [row(i, "pass", 1) for i in range(9)] + [row(9, "no result", None)]
        found, _ = changes.compare_results(rows, rows)
        self.assertEqual((found["same"], found["verdict"]), (9, "the same"))
        items = changes.collect_gate_items([], [], {"between_sessions": {}, "cameras": [], "lamps": []})
        results = changes.check_gates(limits, changes.count_verdicts(rows), found, items)
        self.assertEqual([gate for gate in results if not gate["passed"]], [])

    def test_names_changed_lens_model_options_and_program(self):
        def result(model, options, toolbox):
            session = {"metrics": [], "steps": [], "version": "1", "calibration": {"lens_model": model}}
            return {"verdict": "pass", "reason": "", "inputs": "a", "options": options, "toolbox": toolbox, "parts": {}}, session

        said = list(diff.list_differences(result("x", "--lens x", "a"), result("y", "--lens y", "b")))
        self.assertEqual(said[3:6], ["lens model  x -> y", "options     --lens x -> --lens y", "toolbox     a -> b"])
        self.assertEqual(len(list(diff.list_differences(result("x", "", "a"), result("x", "", "a")))), 4)

    def test_names_changed_inputs(self):
        now = {"parts": {"lamps.yaml": "c", "check": "b"}}
        self.assertEqual(diff.changed_inputs(now, now), "the same")
        self.assertEqual(diff.changed_inputs({"parts": {"check": "b"}}, now), "lamps.yaml")


if __name__ == "__main__":
    unittest.main()
