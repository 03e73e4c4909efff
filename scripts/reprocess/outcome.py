# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What came of a session: its verdict, figures and cost, from what its stages left."""
import json
import re
from pathlib import Path

from station import last_file

STAGES = ["lens", "row_time", "rotation", "dispersion", "locate", "evaluate"]
FIGURES = ["captures", "fixes", "missing_share", "mean_mm", "median_mm", "p90_mm", "max_mm", "rms_px"]
COLUMNS = ["camera", "session", "verdict", *FIGURES, "reason", "version", "inputs", "key", "cpu_s"]
# Files of a session that are results, and their names there.
KEPT = {
    "calibration.yaml": "calibration.yaml",
    "lens.cameramodel": "camera.cameramodel",
    "fixes.csv": "fixes.csv",
    "evaluation.json": "evaluation.json",
}


def ends_of(folder):
    """Of each stage that came to an end: its exit code and its processor time."""
    ends = {}
    for stage in STAGES:
        try:
            # The shell may have words of its own before them: "Killed".
            times, code = (folder / "logs" / f"{stage}.txt.end").read_text().splitlines()[-2:]
            ends[stage] = int(code), sum(float(time) for time in times.split())
        except (FileNotFoundError, ValueError):
            continue
    return ends


def cost_of(folder):
    return f"{sum(seconds for _, seconds in ends_of(folder).values()):.3f}"


def said(folder, stage, archive):
    """The error, or the gates that were not met, in the words of the program."""
    text = (folder / "logs" / f"{stage}.txt").read_text(errors="replace").replace(archive + "/", "")
    errors = re.findall(r"^vlp-[a-z]+: (?:error|warning): .*$", text, re.MULTILINE)
    lines = errors or text.strip().splitlines() or [f"{stage} said nothing"]
    return lines[-1]


def figures_of(folder):
    figures = {}
    if (folder / "evaluation.json").exists():
        evaluation = json.loads((folder / "evaluation.json").read_text())
        figures = {name: evaluation[name] for name in ("captures", "fixes", "missing_share")}
        for name in ("mean_mm", "median_mm", "p90_mm", "max_mm"):
            figures[name] = f"{evaluation['horizontal'][name]:.6g}"
    if (folder / "calibration.yaml").exists():
        rms = re.search(r"^  rms_px: *(\S+)", (folder / "calibration.yaml").read_text(), re.MULTILINE)
        figures |= {"rms_px": rms.group(1)} if rms else {}
    return figures


def outcome_of(folder, name, run):
    """The verdict: "pass"; "gate", when there is a result that misses a gate; "no result", when a stage
    refused its input; "crashed", when one ended in another way, or not at all, or could not write."""
    camera, session = name.split("/")
    ends = ends_of(folder)
    outcome = {"camera": camera, "session": session, "verdict": "pass", "reason": ""}
    missed = [stage for stage, (code, _) in ends.items() if code == 1]
    if missed:  # vlp-evaluate tells of those before it, too
        telling = ["evaluate"] if "evaluate" in missed else missed
        reasons = [said(folder, stage, run["archive"]) for stage in telling]
        outcome |= {"verdict": "gate", "reason": "; ".join(reasons)}
    for stage, (code, _) in ends.items():
        if code in (2, 3):
            reason = said(folder, stage, run["archive"])
            verdict = "crashed" if ": cannot be written" in reason else "no result"
            return outcome | {"verdict": verdict, "reason": reason}
        if code > 3:
            return outcome | {"verdict": "crashed", "reason": f"{stage} ended with exit code {code}"}
    asked = last_file(Path(run["archive"]) / name)
    if not (folder / asked).exists():
        return outcome | {"verdict": "crashed", "reason": f"there is no {asked}, and no stage says why"}
    return outcome | figures_of(folder)
