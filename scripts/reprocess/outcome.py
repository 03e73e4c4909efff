# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Outcome of a session: verdict, metrics and calibrated parameters from session.json and evaluation.json.

The verdict is that of session.json, except "review" for a session that passed with warnings, skipped images or
rejected lamps, which `remarks` and `rejected_lamps` list, and "crashed" if vlp-calibrate ended without session.json.
"""
import json
import signal

METRICS = ["captures", "fixes", "missing_fraction", "mean_mm", "median_mm", "p90_mm", "max_mm", "rms_px"]
REMARKS = ["warnings", "images_skipped", "rejected_lamps", "remarks"]
SUMMARY_COLUMNS = ["camera", "session", "verdict", *METRICS, *REMARKS, "date", "reason", "suspect", "files", "expected"]
SUMMARY_COLUMNS += ["version", "inputs", "key", "cpu_s"]
# Units of the calibrated parameters that are tracked over time, by their names in session.json. Each has components
# along x and y with standard deviations.
TRACKED_UNITS = {"focal": "px", "principal_point": "px", "zenith": "deg", "rotation_center": "px"}
TRACKED_UNITS |= {"lever_arm": "mm", "dispersion_offset": "px"}
TRACKED_COLUMNS = [f"{name}_{axis}_{unit}" for name, unit in TRACKED_UNITS.items() for axis in "xy"]


def sd_column(column):
    """Returns the column of the standard deviation of a parameter: focal_x_sd_px for focal_x_px."""
    name, unit = column.rsplit("_", 1)
    return f"{name}_sd_{unit}"


RESIDUALS = ["rms_px", "rotation_px", "residual_ratio", "normalized_error_rms"]
RESIDUALS += ["mtf50", "dispersion_mm", "height_rms_mm", "yaw_rms_deg"]
FLEET_COLUMNS = ["camera", "session", "date", "room", "map", "tilt_deg"]
FLEET_COLUMNS += [column for name in TRACKED_COLUMNS for column in (name, sd_column(name))] + [*RESIDUALS, "mean_mm"]
LAMP_COLUMNS = ["room", "map", "lamp", "camera", "session", "date", "captures", "map_x_m", "map_y_m"]
LAMP_COLUMNS += ["offset_x_mm", "offset_y_mm", "offset_x_sd_mm", "offset_y_sd_mm"]
# Columns of the rows of a shard.
SHARD_COLUMNS = list(dict.fromkeys([*SUMMARY_COLUMNS, *FLEET_COLUMNS, "lamps", "gate_metrics", "fingerprint"]))
SHARD_COLUMNS += ["copyable", "former_inputs"]
TIMED_OUT = -signal.SIGALRM
# Output files of vlp-calibrate that are kept, and their names in the results.
KEPT_FILES = {name: name for name in ("calibration.yaml", "evaluation.json", "session.json")}
KEPT_FILES |= {"lens.cameramodel": "camera.cameramodel", "check-fixes.csv": "fixes.csv"}


def format_value(value):
    return f"{value:.6g}" if value is not None else ""


def read_metrics(folder, session):
    figures = {}
    if (folder / "evaluation.json").exists():
        evaluation = json.loads((folder / "evaluation.json").read_text())
        figures = {name: evaluation[name] for name in ("captures", "fixes", "missing_fraction")}
        for name in ("mean_mm", "median_mm", "p90_mm", "max_mm"):
            figures[name] = format_value(evaluation["horizontal"][name])
    for metric in session["metrics"]:
        if metric["name"] in RESIDUALS:
            figures[metric["name"]] = format_value(metric["value"])
    return figures


def collect_remarks(session):
    """Returns the numbers of warnings and skipped images, the rejected lamps, and the list of remarks."""
    remarks, skipped, rejected, warnings = [], 0, {}, 0
    for step in session["steps"]:
        step_warnings = step.get("warnings", [])
        warnings += len(step_warnings)
        remarks += [f"{step['name']}: {warning}" for warning in step_warnings]
        if images := step.get("skipped"):
            skipped += len(images)
            first = f"{images[0]['image']}: {images[0]['reason']}"
            remarks.append(f"{step['name']}: {len(images)} image{'s' * (len(images) > 1)} skipped; the first, {first}")
        for lamp in step.get("rejected_lamps", []):
            rejected[lamp["lamp"]] = rejected.get(lamp["lamp"], 0) + lamp["captures"]
    lamps = ", ".join(f"{lamp} ({captures})" for lamp, captures in sorted(rejected.items()))
    return {"warnings": warnings, "images_skipped": skipped, "rejected_lamps": lamps, "remarks": remarks}


def read_calibration(session):
    """Returns the columns of the parameters that are tracked over time, and `lamps`: the lamp offsets as JSON."""
    columns, calibration = {}, session.get("calibration", {})
    for name, unit in TRACKED_UNITS.items():
        values, sds = calibration.get(f"{name}_{unit}"), calibration.get(f"{name}_sd_{unit}")
        for i, axis in enumerate("xy"):
            columns[f"{name}_{axis}_{unit}"] = format_value(values[i]) if values else ""
            columns[f"{name}_{axis}_sd_{unit}"] = format_value(sds[i]) if sds else ""
    columns["tilt_deg"] = format_value(calibration.get("tilt_deg"))
    for part in session.get("history", []):
        for entry in part["inputs"]:
            if part["part"] == "rotation_center" and entry["file"] == "lamps.yaml":
                columns["map"] = entry["sha256"][:12]
    lamps = [lamp for step in session["steps"] for lamp in step.get("lamp_offsets", [])]
    columns["lamps"] = json.dumps(lamps) if lamps else ""
    return columns


def gate_metrics(session):
    """Returns the metrics and gates of session.json, for --session-gates: {name: value} and {name: limit}, as JSON. The
    gate of a metric with an interval limits its lower end."""
    metrics = {metric["name"]: metric.get("interval_low", metric["value"]) for metric in session["metrics"]}
    gates = {gate["name"]: gate["limit"] for gate in session.get("gates", [])}
    return json.dumps({"metrics": metrics, "gates": gates}, separators=(",", ":"))


def read_outcome(folder, name, exit_code, output):
    """Returns the columns of a session from the output folder of vlp-calibrate. exit_code: exit code, or the negative
    number of the signal that ended it; output: end of its stdout and stderr."""
    camera, session_id = name.split("/")
    outcome = {"camera": camera, "session": session_id}
    try:
        session = json.loads((folder / "session.json").read_text())
    except FileNotFoundError:
        end = "ran for more than an hour" if exit_code == TIMED_OUT else f"ended with exit code {exit_code}"
        last = output.strip().splitlines()[-1:]
        return outcome | {"verdict": "crashed", "reason": ": ".join([f"vlp-calibrate {end}", *last])}
    remarks = collect_remarks(session)
    verdict = session["verdict"]
    if verdict == "pass" and (remarks["remarks"] or remarks["rejected_lamps"]):
        verdict = "review"
    outcome |= {"verdict": verdict, "reason": session["reason"], **remarks, "remarks": "; ".join(remarks["remarks"])}
    if verdict == "no result":
        return outcome
    outcome["gate_metrics"] = gate_metrics(session)
    return outcome | read_metrics(folder, session) | read_calibration(session)
