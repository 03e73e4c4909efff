#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the errors of fixes with their reported standard deviations, from rendered images and complete calibrations.

  rendered_consistency.py FOLDER [SCENE...] [--programs BIN] [--units N] [--first SEED] [--survey-sd-mm SD]
                          [--exact-positions]

Each unit of a scene has its own survey errors of the lamp map and its own images, with its own seed: of the board, of a
rotation at two heights, of a known position, and of five known positions of the axis with twelve captures each. Fixes
of other positions are computed with three calibrations:

  steps      lens, rotation center and offset sequentially, with the surveyed map (vlp-calibrate). It does not propagate
             map errors to rotation center and offset; its ratios are not checked
  adjusted   rotation and known position adjusted together with the map (vlp-adjust --refine-map)
  positions  the same with the five known positions

The scene downlights has no boards: lens and tilt are the true ones, the map is the surveyed one. Prints RMS of error
divided by the reported standard deviation, horizontally, in height and in yaw; the fraction of errors within 1.96
standard deviations; mean errors of the fixes and of the refined map. Exit code 1 if a ratio is not within 0.8 to 1.25.
"""

import argparse
import csv
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[2]
# Standard deviation per axis of the survey, and of a known position.
SURVEY_SD_M = {"paper-rig": 1e-4, "paper-rig-faulty": 2e-3, "wide": 1e-3, "downlights": 1e-3}
POSITION_SD_M = 1e-4
MIN_RATIO, MAX_RATIO = 0.8, 1.25
AXES = ("x_m", "y_m", "z_m", "yaw_rad")
SD_COLUMNS = ("x_sd_m", "y_sd_m", "z_sd_m", "yaw_sd_rad")
FIVE_POSITIONS_M = [(0, 0), (0.4, 0.2), (-0.4, 0.2), (-0.4, -0.2), (0.4, -0.2)]
FIVE_CAPTURE_SETS = f"""  - folder: positions
    exposure_s: 5.0e-5
    pivots_m: {[list(position) for position in FIVE_POSITIONS_M]}
    heights_m: [0]
    turn: {{count: 12, jitter_deg: 8}}
    interval_s: 0.5
"""


def read_rows(table):
    with open(table, newline="") as file:
        return list(csv.DictReader(file))


def write_scene(name, survey_sd_m, rng, folder):
    """Writes a copy of the scene with other map errors, five known positions, and fewer captures of the check."""
    text = (SOURCE / "datasets" / name / "scene.yaml").read_text()
    text = re.sub(r",\s*map_error_m: \[[^\]]*\]", "", text)

    def with_error(lamp):
        error_m = ", ".join(f"{value:.7f}" for value in rng.normal(0, survey_sd_m, 3))
        return f"{lamp[0]}, map_error_m: [{error_m}]"

    text = re.sub(r"- \{id: \d+, position_m: \[[^\]]*\]", with_error, text)
    text = text.replace("columns: 6, rows: 6", "columns: 3, rows: 2")
    folder.mkdir(parents=True)
    scene = folder / "rig.yaml"
    scene.write_text(text.rstrip("\n") + "\n" + FIVE_CAPTURE_SETS)
    return scene


def run(programs, program, *arguments, may_fail=False):
    command = [programs / program, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode and not may_fail:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")


def write_captures(folder, position_sd_m, rng, reference_point, true_position):
    """Writes captures.csv with measured positions: the error is common to all captures of a position."""
    truth = read_rows(folder / "truth.csv")
    errors_m = {}
    with open(folder / "captures.csv", "w", newline="") as file:
        names = ["image", "pivot", "x_m", "y_m", "z_m", "reference_point", "position_sd_m"]
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        for row in truth:
            at_m = true_position(row)
            if at_m not in errors_m:
                errors_m[at_m] = rng.normal(0, position_sd_m, 3)
            measured = [f"{value:.7f}" for value in np.add(at_m, errors_m[at_m])]
            pivot = f"s{list(errors_m).index(at_m)}" if reference_point == "axis" else ""
            writer.writerow([row["image"], pivot, *measured, reference_point, POSITION_SD_M])


def camera_position(row):
    return tuple(float(row[axis]) for axis in AXES[:3])


def axis_position(row):
    x_m, y_m, z_m = camera_position(row)
    return (*min(FIVE_POSITIONS_M, key=lambda position: np.hypot(x_m - position[0], y_m - position[1])), z_m)


def errors_and_sds(fixes, truth):
    """Returns errors and reported standard deviations, each an array with a row per fix: x, y, z, yaw."""
    true = {row["image"]: row for row in read_rows(truth)}
    rows = [row for row in read_rows(fixes) if row["status"] == "ok"]
    errors = np.array([[float(row[a]) - float(true[row["image"]][a]) for a in AXES] for row in rows])
    errors[:, 3] = (errors[:, 3] + np.pi) % (2 * np.pi) - np.pi
    return errors, np.array([[float(row[column]) for column in SD_COLUMNS] for row in rows])


def map_errors_m(refined, true):
    """Returns the errors x, y, z of each lamp of the refined map."""
    positions = [re.findall(r"position_m: \[([^\]]*)\]", path.read_text()) for path in (refined, true)]
    found_m, true_m = (np.array([[float(v) for v in lamp.split(",")] for lamp in lamps]) for lamps in positions)
    return found_m - true_m


def unit(programs, name, seed, survey_sd_m, position_sd_m, folder):
    """Calibrates one unit. Returns {calibration: (errors and standard deviations of its fixes, errors of its map)}."""
    rng = np.random.default_rng([seed, len(name)])
    shutil.rmtree(folder, ignore_errors=True)
    scene = write_scene(name, survey_sd_m, rng, folder)
    session, fixes = folder / "session", folder / "fixes.csv"
    boards = name != "downlights"
    sets = ["boards", "rotation", "dispersion", "positions", "check"] if boards else ["check"]
    run(programs, "vlp-simulate", "--quiet", scene, "--seed", seed, "--only", ",".join(sets), "-o", session)
    lamps, check = session / "lamps.yaml", session / "check"
    lamps.write_text(lamps.read_text().replace("lamps:\n", f"sd_m: {survey_sd_m}\nlamps:\n", 1))

    def locate(calibration, lamp_map):
        run(programs, "vlp-locate", check, "--lamps", lamp_map, "--calibration", calibration, "-o", fixes)
        return errors_and_sds(fixes, check / "truth.csv")

    if not boards:
        return {"true lens": (*locate(session / "true_calibration.yaml", lamps), None)}
    write_captures(session / "dispersion", position_sd_m, rng, "camera", camera_position)
    write_captures(session / "positions", position_sd_m, rng, "axis", axis_position)
    camera = (session / "true_calibration.yaml").read_text()
    run(programs, "vlp-calibrate", session, "-o", folder / "steps", "--no-report", "--row-time-s",
        re.search(r"row_time_s: ([^\s,}]+)", camera)[1], "--readout", re.search(r"readout: (\w+)", camera)[1],
        may_fail=True)  # gates may fail
    found = {"steps": (*errors_and_sds(folder / "steps/check-fixes.csv", check / "truth.csv"), None)}
    for way, captures in (("adjusted", ["rotation", "dispersion"]), ("positions", ["positions"])):
        refined, adjusted = folder / f"{way}-lamps.yaml", folder / f"{way}.yaml"
        run(programs, "vlp-adjust", *(session / one for one in captures), "--lamps", lamps, "--calibration",
            folder / "steps/rotated.yaml", "--refine-map", refined, "-o", adjusted)
        found[way] = (*locate(adjusted, refined), map_errors_m(refined, session / "true_lamps.yaml"))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=list(SURVEY_SD_M))
    parser.add_argument("--programs", type=pathlib.Path, default=SOURCE / "build/bin")
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, metavar="SEED")
    parser.add_argument("--survey-sd-mm", type=float, metavar="SD", help="standard deviation of the survey, "
                        "also stated in the map (default: that of the scene)")
    parser.add_argument("--exact-positions", action="store_true", help="known positions without errors, although "
                        "0.1 mm is stated (ratios are then below the limits)")
    options = parser.parse_args()
    position_sd_m = 0 if options.exact_positions else POSITION_SD_M
    missed = False
    for name in options.scenes:
        by_calibration = {}
        survey_sd_m = SURVEY_SD_M[name] if options.survey_sd_mm is None else 1e-3 * options.survey_sd_mm
        for seed in range(options.first, options.first + options.units):
            found_of_unit = unit(options.programs, name, seed, survey_sd_m, position_sd_m, options.folder / name)
            for way, found in found_of_unit.items():
                by_calibration.setdefault(way, []).append(found)
        for way, units in by_calibration.items():
            errors, sds, map_m = zip(*units)
            errors, squares = np.concatenate(errors), (np.concatenate(errors) / np.concatenate(sds)) ** 2
            x, y, height, yaw = squares.mean(axis=0)
            ratios = np.sqrt([(x + y) / 2, height, yaw])
            print(f"{name}, {way}: {len(units)} units, {len(squares)} fixes; error / sd {ratios[0]:.2f} "
                  f"horizontally, {ratios[1]:.2f} in height, {ratios[2]:.2f} in yaw; within 1.96 "
                  f"{(squares < 1.96**2).mean():.3f}; mean error {1e3 * np.hypot(*errors[:, :2].T).mean():.3f} mm, "
                  f"height {1e3 * np.abs(errors[:, 2]).mean():.3f} mm", end="")
            if map_m[0] is not None:
                map_error_m = np.concatenate(map_m)
                print(f"; map {1e3 * np.hypot(*map_error_m[:, :2].T).mean():.3f} mm, height "
                      f"{1e3 * np.abs(map_error_m[:, 2]).mean():.3f} mm", end="")
            print(flush=True)
            missed |= way != "steps" and not ((MIN_RATIO < ratios) & (ratios < MAX_RATIO)).all()
    sys.exit(missed)


main()
