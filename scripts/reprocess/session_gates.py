# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Applies --session-gates (vlp-gates/1) to the rows of sessions that have no gates.yaml of their own.

A change of the gates requires no new calibration: a row has the metrics and gates of session.json (`gate_metrics`). A
gate of the file replaces the gate of the lens with the same name.
"""
import json

import yaml

# Metrics with a lower limit; all others have an upper limit.
AT_LEAST = ("mtf50", "mtf50_worst_ratio", "coverage", "views", "board_tilt_deg")
UNITS = {"px": "px", "mm": "mm", "deg": "deg", "percent": "%"}  # by suffixes of the names of metrics


def read_limits(file):
    """Returns {metric: limit}. vlp-calibrate has checked the file (checks.py)."""
    return {name: float(limit) for name, limit in yaml.safe_load(file.read_text())["gates"].items()}


def describe_missed(name, value, limit):
    """Returns the text of vlp-calibrate, for example "mean_mm is 1.25 mm, at most 1 mm is required"."""
    unit = next((f" {unit}" for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")
    measured = "not known" if value is None else f"{value:.4g}{unit}"
    return f"{name} is {measured}, {'at least' if name in AT_LEAST else 'at most'} {limit:.4g}{unit} is required"


def apply_session_gates(row, limits):
    """Sets verdict and reason of a row that has a result and no gates of its own."""
    if not limits or not row["gate_metrics"]:
        return
    known = json.loads(row["gate_metrics"])
    gates = known["gates"] | limits
    checked = [(name, known["metrics"].get(name), limit) for name, limit in gates.items()]
    signs = {name: -1 if name in AT_LEAST else 1 for name in gates}
    is_met = [value is not None and signs[name] * value <= signs[name] * limit for name, value, limit in checked]
    missed = [describe_missed(*gate) for gate, met in zip(checked, is_met) if not met]
    passed = "review" if row["remarks"] or row["rejected_lamps"] else "pass"
    row["verdict"], row["reason"] = ("gate", "; ".join(missed)) if missed else (passed, "")
