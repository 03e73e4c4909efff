#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""--session-gates, applied to the rows of sessions."""
import tempfile
import unittest
from pathlib import Path

import parts  # noqa: F401
import outcome
import session_gates

METRICS = [{"name": "rms_px", "value": 2.00004}, {"name": "coverage", "value": 0.5}, {"name": "mean_mm", "value": 0.25}]
GATES = [{"name": "rms_px", "limit": 1.0}, {"name": "coverage", "limit": 0.4}]


def apply(limits, verdict="gate", remarks="", own=False):
    document = {"metrics": METRICS, "gates": GATES}
    row = {"verdict": verdict, "reason": "of before", "remarks": remarks, "rejected_lamps": ""}
    row["gate_metrics"] = "" if own else outcome.gate_metrics(document)
    session_gates.apply_session_gates(row, limits)
    return row["verdict"], row["reason"]


class SessionGates(unittest.TestCase):
    def test_replace_lens_gates_and_add_others(self):
        missed = "rms_px is 2 px, at most 1 px is required"
        self.assertEqual(apply({"mean_mm": 1}), ("gate", missed))
        self.assertEqual(apply({"mean_mm": 0.2}), ("gate", f"{missed}; mean_mm is 0.25 mm, at most 0.2 mm is required"))
        self.assertEqual(apply({"rms_px": 3}), ("pass", ""))
        self.assertEqual(apply({"rms_px": 3, "coverage": 0.6}), ("gate", "coverage is 0.5, at least 0.6 is required"))
        self.assertEqual(apply({"rms_px": 3, "p90_mm": 1}), ("gate", "p90_mm is not known, at most 1 mm is required"))
        self.assertEqual(apply({"rms_px": 3}, remarks="lens: a warning"), ("review", ""))

    def test_ignore_sessions_with_own_gates_or_without_result(self):
        self.assertEqual(apply({"rms_px": 3}, own=True), ("gate", "of before"))
        self.assertEqual(apply({}, "pass"), ("pass", "of before"))

    def test_are_read_as_numbers(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "gates.yaml"
            file.write_text("format: vlp-gates/1\ngates: {mean_mm: 1e-3, views: 7}\n")  # the first one is text in YAML 1.1
            self.assertEqual(session_gates.read_limits(file), {"mean_mm": 0.001, "views": 7.0})


if __name__ == "__main__":
    unittest.main()
