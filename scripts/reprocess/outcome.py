# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What came of a session: its verdict and figures, from session.json of vlp-calibrate and how that ended."""
import json

FIGURES = ["captures", "fixes", "missing_share", "mean_mm", "median_mm", "p90_mm", "max_mm", "rms_px"]
COLUMNS = ["camera", "session", "verdict", *FIGURES, "reason", "version", "inputs", "key", "cpu_s"]
TOOK_TOO_LONG = (124, 137)  # exit codes of timeout
# Files of vlp-calibrate that are kept, and their names there.
KEPT = {
    "calibration.yaml": "calibration.yaml",
    "lens.cameramodel": "camera.cameramodel",
    "check-fixes.csv": "fixes.csv",
    "evaluation.json": "evaluation.json",
    "session.json": "session.json",
}


def figures_of(folder, session):
    figures = {}
    if (folder / "evaluation.json").exists():
        evaluation = json.loads((folder / "evaluation.json").read_text())
        figures = {name: evaluation[name] for name in ("captures", "fixes", "missing_share")}
        for name in ("mean_mm", "median_mm", "p90_mm", "max_mm"):
            figures[name] = f"{evaluation['horizontal'][name]:.6g}"
    for metric in session["metrics"]:
        if metric["name"] == "rms_px" and metric["step"] == "lens":
            figures["rms_px"] = f"{metric['value']:.6g}"
    return figures


def outcome_of(folder, name, ended, said):
    """The verdict: "pass", "gate" or "no result", as session.json says; "crashed", when vlp-calibrate ended
    without one. ended: its exit code, of timeout when it took too long; said: what it said at the end."""
    camera, name_of_session = name.split("/")
    outcome = {"camera": camera, "session": name_of_session}
    try:
        session = json.loads((folder / "session.json").read_text())
    except FileNotFoundError:
        words = "ran for more than an hour" if ended in TOOK_TOO_LONG else f"ended with exit code {ended}"
        last = said.strip().splitlines()[-1:]
        return outcome | {"verdict": "crashed", "reason": ": ".join([f"vlp-calibrate {words}", *last])}
    outcome |= {"verdict": session["verdict"], "reason": session["reason"]}
    return outcome if outcome["verdict"] == "no result" else outcome | figures_of(folder, session)
