#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Outcome of a session, its date, and its processor time."""
import contextlib
import io
import json
import tempfile
import unittest
from pathlib import Path

import parts  # noqa: F401
import dates
import outcome
import summary


class Outcome(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.work = Path(self.folder.name)

    def session(self, verdict, reason="", metrics=(), steps=(), **others):
        stated = {"verdict": verdict, "reason": reason, "metrics": list(metrics), "steps": list(steps)}
        (self.work / "session.json").write_text(json.dumps(stated | others))

    def outcome(self, exit_code=0, output=""):
        return outcome.read_outcome(self.work, "c/s", exit_code, output)

    def test_verdict_is_that_of_session_json(self):
        self.session("gate", "rms_px is 2 px", [{"name": "rms_px", "step": "lens", "value": 2.00000049}])
        evaluation = {"captures": 3, "fixes": 2, "missing_fraction": 1 / 3}
        evaluation["horizontal"] = {name: 0.25 for name in ("mean_mm", "median_mm", "p90_mm", "max_mm")}
        (self.work / "evaluation.json").write_text(json.dumps(evaluation))
        found = self.outcome(1)
        self.assertEqual((found["camera"], found["session"]), ("c", "s"))
        self.assertEqual((found["verdict"], found["reason"]), ("gate", "rms_px is 2 px"))
        self.assertEqual((found["fixes"], found["mean_mm"], found["rms_px"]), (2, "0.25", "2"))

    def test_passed_session_with_remarks_has_verdict_review(self):
        cut = [{"image": f"000{i}.png", "reason": "is cut short"} for i in range(6)]
        warning = "lever arm and tilt cannot be separated; the lever arm is assumed to be zero"
        steps = [{"name": "lens"}, {"name": "rotation", "warnings": [warning], "skipped": cut}]
        self.session("pass", steps=steps)
        found = self.outcome()
        self.assertEqual((found["verdict"], found["reason"]), ("review", ""))
        self.assertEqual((found["warnings"], found["images_skipped"], found["rejected_lamps"]), (1, 6, ""))
        skipped = "rotation: 6 images skipped; the first, 0000.png: is cut short"
        self.assertEqual(found["remarks"], f"rotation: {warning}; {skipped}")
        left_out = [{"lamp": 4, "captures": 1}, {"lamp": 2, "captures": 12}]
        self.session("pass", steps=[{"name": "check", "rejected_lamps": left_out, "warnings": ["lamp 2 is left out"]}])
        found = self.outcome()
        self.assertEqual((found["verdict"], found["rejected_lamps"]), ("review", "2 (12), 4 (1)"))
        self.session("gate", "rms_px is 2 px", steps=steps)
        self.assertEqual((self.outcome()["verdict"], self.outcome()["images_skipped"]), ("gate", 6))
        self.session("pass", steps=[{"name": "check", "notes": ["of so few as 12 captures"]}])
        self.assertEqual((self.outcome()["verdict"], self.outcome()["remarks"]), ("pass", ""))

    def test_has_tracked_parameters(self):
        calibration = {"tilt_deg": 0.5, "focal_px": [260.5, 261], "focal_sd_px": [0.02, 0.03], "lever_arm_mm": [1, 2]}
        calibration |= {"lever_arm_sd_mm": None}
        history = [{"part": "camera", "inputs": []}]
        history += [{"part": "rotation_center", "inputs": [{"file": "lamps.yaml", "sha256": "0123456789abcdef"}]}]
        lamps = [{"lamp": 2, "captures": 12, "map_m": [0, 1], "offset_mm": [0.5, -1], "offset_sd_mm": [0.1, 0.2]}]
        self.session("pass", steps=[{"name": "check", "lamp_offsets": lamps}], calibration=calibration, history=history)
        found = self.outcome()
        self.assertEqual(found["verdict"], "pass")
        self.assertEqual((found["focal_y_px"], found["focal_y_sd_px"], found["map"]), ("261", "0.03", "0123456789ab"))
        self.assertEqual((found["lever_arm_x_mm"], found["lever_arm_x_sd_mm"], found["principal_point_x_px"]), ("1", "", ""))
        lamp = next(summary.make_lamp_rows(found))
        self.assertEqual((lamp["lamp"], lamp["offset_y_mm"], lamp["offset_y_sd_mm"], lamp["map_y_m"]), (2, "-1", "0.2", "1"))

    def test_session_without_result_has_no_metrics(self):
        self.session("no result", "lens: boards: contains no image")
        self.assertEqual(self.outcome(2)["verdict"], "no result")
        self.assertNotIn("rms_px", self.outcome(2))

    def test_missing_session_json_means_crashed(self):
        found = self.outcome(-9)
        self.assertEqual((found["verdict"], found["reason"]), ("crashed", "vlp-calibrate ended with exit code -9"))
        output = "vlp-calibrate: error: lens.yaml: cannot be written: No space left on device\n"
        self.assertTrue(self.outcome(2, output)["reason"].endswith("No space left on device"))
        self.assertIn("an hour", self.outcome(-14)["reason"])
        self.assertNotIn("an hour", self.outcome(-9)["reason"])


class Summary(unittest.TestCase):
    def test_cost_is_that_of_last_result_in_any_shard(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            (folder / "000000").write_text("c/1\t0.5\t100.000\nc/2\t0.25\t101.000\nc/1\t0.75\t300.000\n")
            (folder / "000001").write_text("c/2\t0.125\t200.000\nc/3\t0.5\t100.000\nc/1\t0.1\t200.000\nc/3\t9\t\nc/3\t9\t40")
            self.assertEqual(summary.read_costs(folder), {"c/1": "0.75", "c/2": "0.125", "c/3": "0.5"})
            self.assertEqual(summary.read_costs(folder / "nowhere"), {})


class Dates(unittest.TestCase):
    def test_come_from_table_or_name(self):
        for name, date in (("2026-03-14", "2026-03-14"), ("20260314-b", "2026-03-14"), ("x 2026-03-14T0930", "2026-03-14")):
            self.assertEqual(dates.find_date(name), date)
        for name in ("session-01", "2026-13-14", "120260314", "20260314555"):
            self.assertEqual(dates.find_date(name), "")
        self.assertEqual(dates.days_since_1970("1970-01-02T12:00"), 1.5)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "archive.csv"
            file.write_text("camera,session,fault,date,room\na,1,,2026-03-14T09:30,hall\na,20260101,,,attic\n")
            lines, _ = dates.read_dates(Path(folder), ["a/1", "a/20260101", "b/1"])
            expected = [("a", "1", "2026-03-14T09:30:00", "hall", ""), ("a", "20260101", "2026-01-01", "attic", "")]
            self.assertEqual([tuple(line.values()) for line in lines], expected)
            file.write_text("camera,session,date\na,1,2026-03-14T09:30+02:00\na,2,2026-03-14T23:30-05:00\n")
            lines, _ = dates.read_dates(Path(folder), ["a/1", "a/2"])
            self.assertEqual([line["date"] for line in lines], ["2026-03-14T07:30:00", "2026-03-15T04:30:00"])
            file.write_text("camera,session,date\na,1,14.3.2026\n")
            self.assertRaisesRegex(ValueError, "archive.csv:2: date: should be as", dates.read_archive_table, Path(folder))
            for wrong in ("1970-01-01", "2999-01-01"):
                file.write_text(f"camera,session,date\na,1,{wrong}\n")
                self.assertRaisesRegex(ValueError, f"archive.csv:2: date: {wrong} is before 2000 or in the", dates.read_archive_table, Path(folder))

    def test_names_faults_of_table(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()) as said:
            file = Path(folder) / "archive.csv"
            file.write_text("\ufeffcamera,session,date\na,1,2026-03-14\n", encoding="utf-8")
            self.assertEqual(dates.read_dates(Path(folder), ["a/1"])[0][0]["date"], "2026-03-14")
            file.write_text("camera,session,date\na,1,2026-03-14\na,1,2026-03-15\n")
            self.assertRaisesRegex(ValueError, "archive.csv:3: a/1 occurs twice", dates.read_archive_table, Path(folder))
            self.assertEqual(said.getvalue(), "")
            file.write_text("camera,session,Date\na,1,2026-03-14\na,7,2026-03-14\n")
            dates.read_dates(Path(folder), ["a/1"])
            self.assertIn("archive.csv:1: columns that are ignored: Date; known are camera, ", said.getvalue())
            self.assertIn("archive.csv: names 1 sessions that the archive lacks, as a/7", said.getvalue())

    def test_reads_expected_files_of_table(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
            file = Path(folder) / "archive.csv"
            file.write_text('camera,session,files\na,1,"boards 20, check 12"\na,7,check 12\na,8,\n')
            lines, missing = dates.read_dates(Path(folder), ["a/1"])
            self.assertEqual(([line["files"] for line in lines], missing), (["boards 20, check 12"], ["a/7"]))
            file.write_text("camera,session,files\na,1,many\n")
            self.assertRaisesRegex(ValueError, "archive.csv:2: files: should be as", dates.read_archive_table, Path(folder))
            for typo in ('"boards 20, chekc 12"', "check: 12"):
                file.write_text(f"camera,session,files\na,1,{typo}\n")
                self.assertRaisesRegex(ValueError, "files: 'che.*' is no input; these are: board.yaml, ", dates.read_archive_table, Path(folder))


if __name__ == "__main__":
    unittest.main()
