#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of scripts/reprocess, whose folder is the argument."""
import hashlib
import json
import os
import random
import sys
import tempfile
import time
import unittest
import unittest.mock
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv.pop(1))
sys.path.append(str(Path(__file__).parents[1] / "support"))
try:
    import yaml  # noqa: F401
except ImportError:
    print("yaml is missing: scripts/setup.sh --batch")
    sys.exit(77)
import catalogue
import changes
import dates
import diff
import files
import fleet
import outcome
import plan
import schema_check
import shard
import summary
import made_up_fleet
from made_up_fleet import Fleet


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
        self.assertEqual(found["lost_with_other_inputs"], [])
        self.assertEqual(found["newly_good"], ["c0002/s0"])
        self.assertEqual([found[key] for key in ("other_inputs", "only_now", "only_before")], [1, 1, 1])
        self.assertEqual(found["with_other_inputs"], ["c0003/s0"])
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
        gates = {"newly_failed": 0, "worse_share": 1, "mean_difference_mm": 1}

        def passed(now, before):
            found, _ = changes.changes_of(now, before)
            return [gate["passed"] for gate in changes.check_gates(gates, changes.counts_of(now), found)]

        self.assertEqual(passed([row(0, "pass", 1, "new")], [row(0, "pass", 1, "old")]), [True, False, False])
        self.assertEqual(passed([row(0, "pass", 1)], [row(1, "pass", 1)]), [False, False, False])

    def test_sessions_that_lost_their_result_with_other_inputs_are_counted(self):
        before = [row(i, "pass", 1, "old") for i in range(3)]
        now = [row(0, "no result", None, "new"), row(1, "look", 1, "new"), row(2, "no result", None, "old")]
        found, pairs = changes.changes_of(now, before)
        self.assertEqual((found["other_inputs"], found["with_other_inputs"]), (2, ["c0000/s0", "c0000/s1"]))
        self.assertEqual(found["newly_failed"], ["c0000/s0", "c0001/s0"])
        self.assertEqual(found["lost_with_other_inputs"], ["c0000/s0"])
        self.assertEqual(pairs, [])
        gates = changes.check_gates({"newly_failed": 1}, changes.counts_of(now), found)
        self.assertEqual([(gate["value"], gate["passed"]) for gate in gates], [(2, False)])

    def test_sessions_that_miss_their_gates_count_where_no_gate_says_how_many_may(self):
        counts = changes.counts_of([row(0, "pass", 1), row(1, "gate", 1), row(2, "look", 1)])
        self.assertEqual((counts["pass"], counts["look"], counts["gate"]), (1, 1, 1))
        self.assertEqual(changes.sessions_beyond_gates(counts, []), 1)
        gates = changes.check_gates({"gate_share": 0.5}, counts, None)
        self.assertEqual(changes.sessions_beyond_gates(counts, gates), 0)

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

    def session(self, verdict, reason="", metrics=(), steps=(), **others):
        stated = {"verdict": verdict, "reason": reason, "metrics": list(metrics), "steps": list(steps)}
        (self.work / "session.json").write_text(json.dumps(stated | others))

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

    def test_what_passed_with_something_to_look_at_says_so(self):
        cut = [{"image": f"000{i}.png", "reason": "is cut short"} for i in range(6)]
        warning = "a lever arm cannot be told from a tilt; it is taken as zero"
        steps = [{"name": "lens"}, {"name": "rotation", "warnings": [warning], "skipped": cut}]
        self.session("pass", steps=steps)
        found = self.outcome()
        self.assertEqual((found["verdict"], found["reason"]), ("look", ""))
        self.assertEqual((found["warnings"], found["images_skipped"], found["lamps_left_out"]), (1, 6, ""))
        skipped = "rotation: 6 images skipped; the first, 0000.png: is cut short"
        self.assertEqual(found["look"], f"rotation: {warning}; {skipped}")
        left_out = [{"lamp": 4, "captures": 1}, {"lamp": 2, "captures": 12}]
        self.session("pass", steps=[{"name": "check", "lamps_left_out": left_out, "warnings": ["lamp 2 is left out"]}])
        found = self.outcome()
        self.assertEqual((found["verdict"], found["lamps_left_out"]), ("look", "2 (12), 4 (1)"))
        self.session("gate", "rms_px is 2 px", steps=steps)
        self.assertEqual((self.outcome()["verdict"], self.outcome()["images_skipped"]), ("gate", 6))
        self.session("pass", steps=[{"name": "check", "notes": ["of so few as 12 captures"]}])
        self.assertEqual((self.outcome()["verdict"], self.outcome()["look"]), ("pass", ""))

    def test_keeps_what_is_tracked_over_time(self):
        calibration = {"tilt_deg": 0.5, "focal_px": [260.5, 261], "focal_sd_px": [0.02, 0.03], "lever_arm_mm": [1, 2]}
        calibration |= {"lever_arm_sd_mm": None}
        history = [{"part": "camera", "inputs": []}]
        history += [{"part": "rotation_center", "inputs": [{"file": "lamps.yaml", "sha256": "0123456789abcdef"}]}]
        lamps = [{"lamp": 2, "captures": 12, "map_m": [0, 1], "offset_mm": [0.5, -1], "offset_sd_mm": [0.1, 0.2]}]
        self.session("pass", steps=[{"name": "check", "lamp_offsets": lamps}], calibration=calibration, history=history)
        found = self.outcome()
        self.assertEqual(found["verdict"], "pass")
        self.assertEqual((found["focal_y_px"], found["sd_focal_y_px"], found["map"]), ("261", "0.03", "0123456789ab"))
        self.assertEqual((found["lever_arm_x_mm"], found["sd_lever_arm_x_mm"], found["center_x_px"]), ("1", "", ""))
        lamp = next(summary.lamps_of(found))
        self.assertEqual((lamp["lamp"], lamp["offset_y_mm"], lamp["sd_offset_y_mm"], lamp["map_y_m"]), (2, "-1", "0.2", "1"))

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


    def test_digests_of_what_looks_the_same_are_not_taken_again(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            run = {"toolbox": "t", "camera": "", "session_gates_digest": "", "archive": folder, "version": "1"}
            for name, text in (("c/1", "one"), ("c/2", "two")):
                (Path(name) / "boards").mkdir(parents=True)
                (Path(name) / "boards/0.png").write_text(text)
            made = []

            def calibrate(run, name, work, lock):
                (work / name).mkdir(parents=True)
                made.append(name)
                return {"camera": "c", "session": name[-1], "verdict": "pass"}, "0.5"

            def reprocess(**glances):
                digested, made[:] = [], []
                digests = lambda session: digested.append(session.name) or files.input_digests(session)
                glances = {f"c/{name[1:]}": glance for name, glance in glances.items()}
                with unittest.mock.patch.multiple(shard, calibrate=calibrate, input_digests=digests):
                    rows = shard.reprocess(run, "7", glances, None, 0)
                files.write_whole(".state/rows/7.csv", files.table(outcome.ALL, rows))
                self.assertEqual([row["glance"] for row in rows], list(glances.values()))
                return digested, [name[-1] for name in made]

            self.assertEqual(reprocess(s1="a", s2="b"), (["1", "2"], ["1", "2"]))
            self.assertEqual(reprocess(s1="a", s2="b"), ([], []))
            self.assertEqual(reprocess(s1="a", s2="c"), (["2"], []))  # touched
            Path("c/2/boards/0.png").write_text("three")
            self.assertEqual(reprocess(s1="a", s2="d"), (["2"], ["2"]))
            (Path("sessions/c/1/row.json")).unlink()
            self.assertEqual(reprocess(s1="a", s2="d"), (["1"], ["1"]))
            run["toolbox"] = "u"
            self.assertEqual(reprocess(s1="a", s2="d"), (["1", "2"], ["1", "2"]))

    def test_former_results_stay_by_their_keys_so_many(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            work = Path("work")
            (work / "c/s").mkdir(parents=True)

            def publish(key, keep, verdict="pass"):
                (work / "c/s/session.json").unlink(missing_ok=True)  # another file, as programs write
                (work / "c/s/session.json").write_text(key)
                shard.publish({"camera": "c", "session": "s", "verdict": verdict, "key": key * 4}, work, keep)
                for age, file in enumerate(sorted(Path(".").rglob("row.json"), key=lambda file: file.stat().st_mtime_ns)):
                    os.utime(file, ns=(age, age))  # that of one tick are told apart
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
            self.assertEqual(publish("7key", 1), ["5key5key5key"])  # a crash does not push it out
            self.assertEqual(publish("8key", 1), ["7key7key7key"])
            self.assertEqual(publish("8key", 1), ["8key8key8key"])  # the same again

    def test_a_former_result_outlasts_a_kill_at_any_moment(self):
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
                """The process ends after so many renamings."""
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
                    if shard.current("c/s", key) is None:
                        publish(key)
                kept = {file.read_text() for file in Path("former").rglob("session.json")}
                self.assertLessEqual(there, kept, moves)
                self.assertEqual(Path("sessions/c/s/session.json").read_text(), key)
            publish("last")
            self.assertEqual([file.read_text() for file in Path("former").rglob("session.json")], [key])

    def test_a_former_result_whose_row_cannot_be_read_is_replaced(self):
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


class Summary(unittest.TestCase):
    def test_cost_is_that_of_the_last_result_in_whatever_shard(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            (folder / "000000").write_text("c/1\t0.5\t100.000\nc/2\t0.25\t101.000\nc/1\t0.75\t300.000\n")
            (folder / "000001").write_text("c/2\t0.125\t200.000\nc/3\t0.5\t100.000\nc/1\t0.1\t200.000\nc/3\t9\t\nc/3\t9\t40")
            self.assertEqual(summary.costs_in(folder), {"c/1": "0.75", "c/2": "0.125", "c/3": "0.5"})
            self.assertEqual(summary.costs_in(folder / "nowhere"), {})


class Diff(unittest.TestCase):
    def test_names_what_differs_and_nothing_else(self):
        def result(verdict, focal, mean, warnings, parts):
            step = {"name": "check", "warnings": warnings}
            metrics = [{"name": "mean_mm", "step": "evaluate", "value": mean}]
            metrics += [{"name": "rms_px", "step": "lens", "value": 1}]
            session = {"metrics": metrics, "steps": [step], "version": "1"}
            session["calibration"] = {"focal_px": focal, "lens_model": "x"}
            return {"verdict": verdict, "reason": "", "parts": parts}, session

        before = result("pass", [260, 261], 0.2, [], {"lamps.yaml": "a", "check": "b"})
        now = result("look", [260, 261.5], 0.3, ["the residuals; they show"], {"lamps.yaml": "c", "check": "b"})
        said = "\n".join(diff.lines_of(before, now))
        for words in ("verdict     pass -> look", "inputs      lamps.yaml\n", "1 -> 1 (the same)", "2 of 4 differ"):
            self.assertIn(words, said)
        self.assertIn("  evaluate mean_mm: 0.2 -> 0.3 (+0.1)", said)
        self.assertIn("  calibration focal_px y: 261 -> 261.5 (+0.5)", said)
        self.assertIn("  + check: the residuals; they show", said)
        self.assertEqual(len(said.splitlines()), 7)

    def test_of_a_row_without_parts_says_only_whether_inputs_are_the_same(self):
        now = {"inputs": "a", "parts": {"lamps.yaml": "c", "check": "b"}}
        self.assertEqual(diff.changed_inputs({"inputs": "a"}, now), "the same")
        self.assertEqual(diff.changed_inputs({"inputs": "b"}, now), "others, not known which")
        self.assertEqual(diff.changed_inputs({"inputs": "b", "parts": {"check": "b"}}, now), "lamps.yaml")


class Dates(unittest.TestCase):
    def test_are_those_of_the_table_or_of_the_name(self):
        for name, date in (("2026-03-14", "2026-03-14"), ("20260314-b", "2026-03-14"), ("x 2026-03-14T0930", "2026-03-14")):
            self.assertEqual(dates.date_in(name), date)
        for name in ("session-01", "2026-13-14", "120260314", "20260314555"):
            self.assertEqual(dates.date_in(name), "")
        self.assertEqual(dates.days_of("1970-01-02T12:00"), 1.5)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "archive.csv"
            file.write_text("camera,session,fault,date,room\na,1,,2026-03-14T09:30,hall\na,20260101,,,attic\n")
            lines = dates.dates_of(Path(folder), ["a/1", "a/20260101", "b/1"])
            expected = [("a", "1", "2026-03-14T09:30:00", "hall"), ("a", "20260101", "2026-01-01", "attic")]
            self.assertEqual([tuple(line.values()) for line in lines], expected)
            file.write_text("camera,session,date\na,1,2026-03-14T09:30+02:00\na,2,2026-03-14T23:30-05:00\n")
            lines = dates.dates_of(Path(folder), ["a/1", "a/2"])
            self.assertEqual([line["date"] for line in lines], ["2026-03-14T07:30:00", "2026-03-15T04:30:00"])
            file.write_text("camera,session,date\na,1,14.3.2026\n")
            self.assertRaisesRegex(ValueError, "archive.csv:2: date: should be as", dates.table_of, Path(folder))


def fleet_rows(made_up):
    rows, lamps = [], []
    for camera, session, result in made_up.all():
        named = {"camera": camera, "session": session, "date": dates.date_in(session), "room": ""}
        rows.append(dict.fromkeys(outcome.ALL, "") | named | outcome.calibration_of(result))
        lamps += summary.lamps_of(rows[-1])
    return rows, lamps


class OverTime(unittest.TestCase):
    # Of 20 cameras with 10 sessions each in a year: 0.1 % of the focal length, 0.02 degrees of tilt, 0.3 px.
    DRIFTS = {
        3: {"focal": (0.26, 0.26)},
        8: {"zenith": (0.02, 0), "rotation_center": (0.0908, 0)},
        15: {"center": (0.3, 0), "rotation_center": (0.3, 0)},
    }
    MOVED = [(0, 2, 150, complex(0.8, 0.6)), (1, 5, 240, complex(-3, 4))]

    def test_finds_what_drifts_and_which_lamps_were_moved_and_when(self):
        fleets, found_cameras, false = 20, 0, 0
        for seed in range(fleets):
            made_up = Fleet(seed, drifts=self.DRIFTS, moved=self.MOVED)
            found = fleet.fleet_of(*fleet_rows(made_up))
            cameras = {alarm["camera"] for alarm in found["cameras"]}
            found_cameras += len(cameras & {"camera-03", "camera-08", "camera-15"})
            lamps = [(lamp["map"][0], lamp["lamp"]) for lamp in found["lamps"]]
            false += bool(cameras - {"camera-03", "camera-08", "camera-15"}) or sorted(lamps) != [("0", 2), ("1", 5)]
            for room, lamp, day, moved in self.MOVED:
                one = next(one for one in found["lamps"] if (one["map"][0], one["lamp"]) == (str(room), lamp))
                self.assertLess(one["before"]["date"], made_up.date(day), (seed, lamp))
                self.assertGreaterEqual(one["since"]["date"], made_up.date(day), (seed, lamp))
                self.assertLess(abs(complex(*one["moved_mm"]) - moved), 5 * sum(one["sd_mm"]), (seed, lamp))
        self.assertGreaterEqual(found_cameras, 3 * fleets - 7)  # of 600 cameras 39 are missed, nearly all tilts
        self.assertLessEqual(false, 4)  # 1 is expected at most

    def test_says_of_a_camera_that_broke_between_which_sessions(self):
        for seed in range(5):
            made_up = Fleet(seed, broken={7: (6, {"center": (0.4, -0.3)})})
            alarm = fleet.fleet_of(*fleet_rows(made_up))["cameras"][0]
            first = alarm["changes"][0]
            self.assertEqual((alarm["camera"], first["kind"]), ("camera-07", "step"))
            self.assertEqual(fleet.kind_of(first["figure"]), "center")
            dates_of_both = [made_up.date(made_up.day(7, session)) for session in (5, 6)]
            self.assertEqual([first["before"]["date"], first["since"]["date"]], dates_of_both)

    def test_is_as_the_schema_says(self):
        made_up = Fleet(0, drifts=self.DRIFTS, moved=self.MOVED, broken={7: (6, {"center": (0.4, -0.3)})})
        document = {"format": "vlp-archive-changes/1", "changes": None, "gates": [], "passed": True}
        document |= {"counts": changes.counts_of([]), "fleet": fleet.fleet_of(*fleet_rows(made_up))}
        alarms = [one["kind"] for alarm in document["fleet"]["cameras"] for one in alarm["changes"]]
        self.assertEqual((set(alarms), len(document["fleet"]["lamps"])), ({"step", "drift"}, 2))
        self.assertEqual(schema_check.problems_of(schema_check.validator_of("changes"), document), [])

    def test_tells_a_drift_from_a_step(self):
        for seed in range(5):
            found = fleet.fleet_of(*fleet_rows(Fleet(seed, drifts={3: {"focal": (0.5, 0.5)}})))["cameras"][0]
            self.assertEqual((found["camera"], found["changes"][0]["kind"]), ("camera-03", "drift"))
            self.assertAlmostEqual(found["changes"][0]["change"], 0.5 * 0.95, delta=5 * found["changes"][0]["sd"])

    def test_gives_false_alarms_no_oftener_than_stated(self):
        fleets = 40
        for honest in (True, False):
            alarms = 0
            for seed in range(1000, 1000 + fleets):
                found = fleet.fleet_of(*fleet_rows(Fleet(seed, honest=honest)))
                alarms += bool(found["cameras"] or found["lamps"])
            self.assertLessEqual(alarms, 6, honest)  # 2 are expected at most; more than 6 in 1 of 200 such tests

    def test_states_by_how_much_sessions_differ_more_than_they_say(self):
        factors = fleet.fleet_of(*fleet_rows(Fleet(1, cameras=60)))["factors"]
        for name, (_, _, factor) in made_up_fleet.SDS.items():
            self.assertAlmostEqual(factors[name] / factor, 1.05, delta=0.12)

    def test_a_session_without_a_lever_arm_is_not_held_against_the_others(self):
        rows, lamps = fleet_rows(Fleet(1))
        for without in ({}, {"lever_arm_x_mm": "", "lever_arm_y_mm": ""}):
            one = rows[14]
            rows[14] = one | without | {"zenith_x_deg": "9", "sd_zenith_x_deg": "0.0001", "rotation_center_y_px": "9"}
            cameras = [alarm["camera"] for alarm in fleet.fleet_of(rows, lamps)["cameras"]]
            self.assertEqual(cameras, [] if without else ["camera-01"])
            rows[14] = one

    def test_of_too_few_sessions_says_nothing(self):
        found = fleet.fleet_of(*fleet_rows(Fleet(1, cameras=2, sessions=3, broken={0: (1, {"center": (9, 9)})})))
        self.assertEqual((found["cameras"], found["lamps"], set(found["factors"].values())), ([], [], {None}))
        self.assertEqual(fleet.fleet_of([], [])["cameras"], [])

    def test_a_room_whose_sessions_see_too_few_lamps_takes_nothing_off(self):
        rows, lamps = fleet_rows(Fleet(1))
        expected = fleet.fleet_of(rows, lamps)["factors"]["lamps"]
        self.assertIsNotNone(expected)
        few = [lamps[0] | {"room": f"room {i}"} for i in range(1000)]
        self.assertEqual(fleet.fleet_of(rows, lamps + few)["factors"]["lamps"], expected)

    def test_sessions_without_a_date_put_all_in_the_order_of_names(self):
        rows = [{"camera": "c", "session": f"s{i}", "date": f"2026-01-{20 - i}"} for i in (2, 0, 1)]
        self.assertEqual([row["session"] for row in fleet.in_order(rows)], ["s2", "s1", "s0"])
        rows[0]["date"] = ""
        self.assertEqual([row["session"] for row in fleet.in_order(rows)], ["s0", "s1", "s2"])
        self.assertEqual(fleet.times_of(fleet.in_order(rows)), [0, 1, 2])

    def test_a_change_is_of_the_kind_that_its_p_is_of(self):
        series = [(value, 1.0) for value in (0, 0, 0, 6, 6, 6)]
        rows = [{"camera": "c", "session": f"s{i}", "date": ""} for i in range(6)]
        for tests, kind in (({"step": 5, "drift": 1}, "step"), ({"step": 50000, "drift": 1}, "drift")):
            found = fleet.change_of(rows, series, tests)
            self.assertEqual(found["kind"], kind)
            self.assertAlmostEqual(found["p"], 2 * tests[kind] * fleet.p_of(found["change"] / found["sd"]))

    def test_steps_and_drifts_are_those_of_least_squares(self):
        series = [(1.0, 0.5), (2.0, 1.0), (4.0, 0.25)]
        (first, first_sd), (last, last_sd) = fleet.steps(series)
        self.assertAlmostEqual(first, (2 * 1 + 4 * 16) / 17 - 1)
        self.assertAlmostEqual(first_sd, (1 / 4 + 1 / 17) ** 0.5)
        self.assertAlmostEqual(last, 4 - (1 * 4 + 2 * 1) / 5)
        self.assertAlmostEqual(last_sd, (1 / 5 + 1 / 16) ** 0.5)
        change, sd = fleet.drift([0, 5, 20], [(1 + 0.3 * time, 0.1) for time in (0, 5, 20)])
        self.assertAlmostEqual(change, 6)
        middle = 25 / 3
        self.assertAlmostEqual(sd, 0.1 * 20 / sum((time - middle) ** 2 for time in (0, 5, 20)) ** 0.5)
        self.assertIsNone(fleet.drift([3, 3], [(1, 1), (2, 1)]))

    def test_a_lamp_that_moved_explains_what_the_others_show(self):
        made_up = Fleet(1, moved=[(0, 2, 150, complex(3, -4))])
        made_up.chance = unittest.mock.Mock(gauss=lambda mean, sd: mean, uniform=lambda low, high: 1)
        room = fleet.rooms_of(fleet_rows(made_up)[1])[0]
        _, lamp, k, change, _ = room.largest(1)
        self.assertEqual(lamp, 2)
        self.assertAlmostEqual(abs(change - complex(3, -4)), 0, places=4)
        room.take_off(lamp, room.series[lamp][k][0], change)
        self.assertLess(room.largest(1)[0], 1e-3)


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


    def test_a_session_stays_in_its_shard_where_there_are_many(self):
        sessions = [f"c/{i:03d}" for i in range(85)]
        known = unittest.mock.Mock(stated={"shard_size": "10"}, shard_of=lambda name: numbers.get(name))
        numbers = {}
        first = plan.shards_of(sessions, known, 10, 1)
        self.assertEqual([len(names) for names in first.values()], [10] * 8 + [5])
        numbers = {name: number for number, names in first.items() for name in names}
        del sessions[20:30]  # a whole shard
        sessions += [f"b/{i:03d}" for i in range(17)]
        then = plan.shards_of(sorted(sessions), known, 10, 1)
        self.assertEqual([(number, len(names)) for number, names in then.items() if number not in (0, 1, 3, 4, 5, 6, 7)], [(8, 10), (9, 10), (10, 2)])
        for number in (0, 1, 3, 4, 5, 6, 7):
            self.assertEqual(then[number], first[number])
        self.assertEqual(sorted(name for names in then.values() for name in names), sorted(sessions))
        self.assertEqual(plan.shards_of(sorted(sessions), known, 5, 1)[0], sorted(sessions)[:5])  # another size

    def test_only_shards_that_are_not_done_and_summed_up_are_to_do(self):
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
            self.assertEqual(plan.to_do(state, summary_file), (list("012345"), ["4"]))
            write("summary.csv", 30)
            self.assertEqual(plan.to_do(state, summary_file), (list("12345"), ["4", "5"]))


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
        known.glances(["c/s"], "files")
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
