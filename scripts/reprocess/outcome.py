# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What came of a session: its verdict and figures, from session.json of vlp-calibrate and how that ended.

A session that passes with something to look at, warnings, images skipped or lamps left out, has the verdict
"look", and `remarks` says at what.
"""
import json
import signal

FIGURES = ["captures", "fixes", "missing_fraction", "mean_mm", "median_mm", "p90_mm", "max_mm", "rms_px"]
TOLD = ["warnings", "images_skipped", "rejected_lamps", "remarks"]
COLUMNS = ["camera", "session", "verdict", *FIGURES, *TOLD, "date", "reason", "version", "inputs", "key", "cpu_s"]
# Calibration values tracked over time: along x and y, with standard deviations, by their names in session.json.
TWO = {"focal": "px", "center": "px", "zenith": "deg", "rotation_center": "px"}
TWO |= {"lever_arm": "mm", "dispersion_offset": "px"}
TRACKED = [f"{name}_{axis}_{unit}" for name, unit in TWO.items() for axis in "xy"]


def sd_of(figure):
    """Returns the column of a figure's standard deviation: focal_x_sd_px of focal_x_px."""
    name, unit = figure.rsplit("_", 1)
    return f"{name}_sd_{unit}"


RESIDUALS = ["rms_px", "rotation_px", "residual_ratio", "normalized_error_rms"]
FLEET = ["camera", "session", "date", "room", "map", "tilt_deg"]
FLEET += [column for name in TRACKED for column in (name, sd_of(name))] + [*RESIDUALS, "mean_mm"]
LAMPS = ["room", "map", "lamp", "camera", "session", "date", "captures", "map_x_m", "map_y_m"]
LAMPS += ["offset_x_mm", "offset_y_mm", "offset_x_sd_mm", "offset_y_sd_mm"]
ALL = list(dict.fromkeys([*COLUMNS, *FLEET, "lamps", "gate_metrics", "glance"]))  # of a shard's rows
TOOK_TOO_LONG = -signal.SIGALRM
# Files of vlp-calibrate that are kept, and their names there.
KEPT = {
    "calibration.yaml": "calibration.yaml",
    "lens.cameramodel": "camera.cameramodel",
    "check-fixes.csv": "fixes.csv",
    "evaluation.json": "evaluation.json",
    "session.json": "session.json",
}


def digits(value):
    return f"{value:.6g}" if value is not None else ""


def figures_of(folder, session):
    figures = {}
    if (folder / "evaluation.json").exists():
        evaluation = json.loads((folder / "evaluation.json").read_text())
        figures = {name: evaluation[name] for name in ("captures", "fixes", "missing_fraction")}
        for name in ("mean_mm", "median_mm", "p90_mm", "max_mm"):
            figures[name] = digits(evaluation["horizontal"][name])
    for metric in session["metrics"]:
        if metric["name"] in RESIDUALS:
            figures[metric["name"]] = digits(metric["value"])
    return figures


def told_by(session):
    """What there is to look at: numbers, ids, and words, of which `remarks` is a list."""
    words, skipped, left_out, warnings = [], 0, {}, 0
    for step in session["steps"]:
        of_step = step.get("warnings", [])
        warnings += len(of_step)
        words += [f"{step['name']}: {warning}" for warning in of_step]
        if images := step.get("skipped"):
            skipped += len(images)
            first = f"{images[0]['image']}: {images[0]['reason']}"
            words.append(f"{step['name']}: {len(images)} image{'s' * (len(images) > 1)} skipped; the first, {first}")
        for lamp in step.get("rejected_lamps", []):
            left_out[lamp["lamp"]] = left_out.get(lamp["lamp"], 0) + lamp["captures"]
    lamps = ", ".join(f"{lamp} ({captures})" for lamp, captures in sorted(left_out.items()))
    return {"warnings": warnings, "images_skipped": skipped, "rejected_lamps": lamps, "remarks": words}


def calibration_of(session):
    """What is tracked over time, and where each lamp is seen."""
    figures, calibration = {}, session.get("calibration", {})
    for name, unit in TWO.items():
        values, sds = calibration.get(f"{name}_{unit}"), calibration.get(f"{name}_sd_{unit}")
        for i, axis in enumerate("xy"):
            figures[f"{name}_{axis}_{unit}"] = digits(values[i]) if values else ""
            figures[f"{name}_{axis}_sd_{unit}"] = digits(sds[i]) if sds else ""
    figures["tilt_deg"] = digits(calibration.get("tilt_deg"))
    for part in session.get("history", []):
        for entry in part["inputs"]:
            if part["part"] == "rotation_center" and entry["file"] == "lamps.yaml":
                figures["map"] = entry["sha256"][:12]
    lamps = [lamp for step in session["steps"] for lamp in step.get("lamp_offsets", [])]
    figures["lamps"] = json.dumps(lamps) if lamps else ""
    return figures


def gate_metrics(session):
    """Returns the metrics and gates of session.json, for --session-gates: {name: value} and {name: limit}, as JSON."""
    metrics = {metric["name"]: metric["value"] for metric in session["metrics"]}
    gates = {gate["name"]: gate["limit"] for gate in session.get("gates", [])}
    return json.dumps({"metrics": metrics, "gates": gates}, separators=(",", ":"))


def outcome_of(folder, name, ended, said):
    """The verdict: "pass", "look", "gate" or "no result", as session.json says; "crashed", when vlp-calibrate
    ended without one. ended: its exit code, of a signal the negative number; said: what it said at the end."""
    camera, name_of_session = name.split("/")
    outcome = {"camera": camera, "session": name_of_session}
    try:
        session = json.loads((folder / "session.json").read_text())
    except FileNotFoundError:
        words = "ran for more than an hour" if ended == TOOK_TOO_LONG else f"ended with exit code {ended}"
        last = said.strip().splitlines()[-1:]
        return outcome | {"verdict": "crashed", "reason": ": ".join([f"vlp-calibrate {words}", *last])}
    told = told_by(session)
    verdict = session["verdict"]
    if verdict == "pass" and (told["remarks"] or told["rejected_lamps"]):
        verdict = "look"
    outcome |= {"verdict": verdict, "reason": session["reason"], **told, "remarks": "; ".join(told["remarks"])}
    if verdict == "no result":
        return outcome
    outcome["gate_metrics"] = gate_metrics(session)
    return outcome | figures_of(folder, session) | calibration_of(session)
