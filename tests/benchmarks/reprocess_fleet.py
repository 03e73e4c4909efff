#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Tests the detection of changes by scripts/reprocess.sh with a rendered fleet of known truth.

    reprocess_fleet.py FOLDER [--programs BIN] [--seed N] [--quiet-year] [--only-figures]

Renders 20 cameras with 10 sessions each, evenly over a year, alternately in two rooms, from datasets/archive. The maps
of the rooms stay unchanged. Sessions have 28 images of the board and 24 of the rotation instead of 20 and 12, with
which a tilt of 0.02 degrees is detected only in 4 of 5 such fleets. The focal length of one camera drifts by 0.1 % over
the year, the tilt of another by 0.02 degrees, the principal point of a third by 0.3 px; a lamp of one room is moved by
1 mm on one day, one of the other room by 5 mm. --quiet-year: no changes. Calibrates the sessions with reprocess.sh and
prints the detected cameras and lamps with dates and sizes, and for each parameter its error divided by the reported
standard deviation. Existing files in FOLDER are reused, so that an interrupted run continues; --only-figures neither
renders nor calibrates. Exit code 1 if a change is missed, has a wrong date or an error of more than five standard
deviations, or if an unchanged camera or lamp is reported.
"""
import argparse
import datetime
import json
import math
import os
import random
import shutil
import statistics
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "scripts/reprocess")]
try:
    import snakemake  # noqa: F401
    import yaml
except ImportError:
    print("snakemake is missing: scripts/setup.sh --batch")
    sys.exit(77)
import fleet
from files import read_table, table, write_atomically

CAMERAS, SESSIONS, DAYS = 20, 10, 365
BOARDS, YAWS = 28, 12
# Changes over the year: fraction of the focal length; degrees towards the image's x; px along x.
FOCAL, TILT, CENTER = (3, 0.001), (8, 0.02), (15, 0.3)
MOVED = [(0, 2, 150, (0.0008, 0.0006)), (1, 5, 240, (-0.003, 0.004))]  # room, lamp, day, displacement in meters


def camera_name(camera):
    return f"camera-{camera:02d}"


class Year:
    """Camera, room, date and changes of each session."""

    def __init__(self, seed, quiet):
        self.seed, self.quiet = seed, quiet
        self.scene = yaml.safe_load((SOURCE / "datasets/archive/scene.yaml").read_text())
        spreads = self.scene.pop("archive")
        captures = {of_it["folder"]: of_it for of_it in self.scene["captures"]}
        captures["boards"]["views"]["count"], captures["rotation"]["turn"]["count"] = BOARDS, YAWS
        chance = random.Random(seed)

        def share():
            return chance.uniform(-1, 1)

        self.cameras = []
        for _ in range(CAMERAS):
            intrinsics = list(self.scene["camera"]["intrinsics"])
            focal = 1 + spreads["focal_fraction"] * share()
            intrinsics[:2] = [focal * value for value in intrinsics[:2]]
            intrinsics[2:4] = [value + spreads["principal_point_px"] * share() for value in intrinsics[2:4]]
            intrinsics[4:] = [value * (1 + spreads["distortion_fraction"] * share()) for value in intrinsics[4:]]
            mount = self.scene["mount"]
            toward = math.radians(mount["tilt_azimuth_deg"])
            lean = [mount["tilt_deg"] * part for part in (math.cos(toward), math.sin(toward))]
            lean = [part + spreads["tilt_deg"] * share() for part in lean]
            arm = [part + spreads["lever_arm_m"] * share() for part in mount["lever_arm_m"]]
            self.cameras.append((intrinsics, lean, arm))
        error = spreads["map_error_m"]
        lamps = len(self.scene["lamps"])
        self.maps = [[[error * share() for _ in range(3)] for _ in range(lamps)] for _ in range(2)]

    def day(self, camera, session):
        return round(DAYS * (session * CAMERAS + camera) / (CAMERAS * SESSIONS - 1))

    def date(self, day):
        return (datetime.date(2025, 1, 1) + datetime.timedelta(days=day)).isoformat()

    def room(self, camera, session):
        return (camera + session) % 2

    def moved(self, room, day):
        """Of each lamp that no longer is where it was surveyed: by how much."""
        return {lamp: by for of_room, lamp, since, by in MOVED if (of_room, self.quiet) == (room, False) and day >= since}

    def drifted(self, what, camera, day):
        return what[1] * day / DAYS if camera == what[0] and not self.quiet else 0

    def unit(self, camera, day):
        """Intrinsics, lean in degrees along x and y, lever arm."""
        intrinsics, lean, arm = self.cameras[camera]
        intrinsics = list(intrinsics)
        intrinsics[:2] = [(1 + self.drifted(FOCAL, camera, day)) * value for value in intrinsics[:2]]
        intrinsics[2] += self.drifted(CENTER, camera, day)
        return intrinsics, [lean[0] + self.drifted(TILT, camera, day), lean[1]], arm

    def scene_of(self, camera, session):
        scene = json.loads(json.dumps(self.scene))
        day, room = self.day(camera, session), self.room(camera, session)
        intrinsics, (x, y), arm = self.unit(camera, day)
        scene["seed"] = 1 + ((self.seed * CAMERAS + camera) * SESSIONS + session)
        scene["camera"] |= {"id": camera_name(camera), "intrinsics": intrinsics}
        azimuth = math.degrees(math.atan2(y, x))
        scene["mount"] = {"tilt_deg": math.hypot(x, y), "tilt_azimuth_deg": azimuth, "lever_arm_m": arm}
        moved = self.moved(room, day)
        for lamp, error in zip(scene["lamps"], self.maps[room]):
            dx, dy = moved.get(lamp["id"], (0, 0))
            for i, by in enumerate((dx, dy, 0)):
                lamp["position_m"][i] += by
            lamp["map_error_m"] = [error[0] - dx, error[1] - dy, error[2]]
        return scene

    def sessions(self):
        for camera in range(CAMERAS):
            for session in range(SESSIONS):
                yield camera, session, self.session_name(camera, session)

    def session_name(self, camera, session):
        return f"{self.date(self.day(camera, session))}-{session:02d}"


def render(year, archive, programs):
    scenes = archive.parent / "scenes"
    scenes.mkdir(parents=True, exist_ok=True)

    def one(of_it):
        camera, session, name = of_it
        place = archive / camera_name(camera) / name
        if place.exists():
            return
        scene = scenes / f"{camera:02d}-{session:02d}.yaml"
        scene.write_text(yaml.safe_dump(year.scene_of(camera, session)))
        unfinished = scenes / scene.stem
        shutil.rmtree(unfinished, ignore_errors=True)
        subprocess.run([programs / "vlp-simulate", "--quiet", "--threads", "1", scene, "-o", unfinished], check=True)
        place.parent.mkdir(parents=True, exist_ok=True)
        unfinished.rename(place)

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(one, year.sessions()))
    rows = []
    surveyed = {}  # position plus error of a moved lamp equals the surveyed position, except for the last digit
    for camera, session, name in year.sessions():
        room = year.room(camera, session)
        lamps = archive / camera_name(camera) / name / "lamps.yaml"
        first = surveyed.setdefault(room, lamps.read_text())
        if lamps.read_text() != first:
            lamps.write_text(first)
        rows.append({"camera": camera_name(camera), "session": name, "room": f"room {room}"})
    write_atomically(archive / "archive.csv", table(["camera", "session", "room"], rows))


def calibrate(archive, results, programs):
    gates = archive.parent / "gates.yaml"
    gates.write_text("format: vlp-archive-gates/1\ngates: {gate_fraction: 1}\n")  # gate of lenses; irrelevant here
    command = [SOURCE / "scripts/reprocess.sh", archive, results, "--row-time-s", "3e-5", "--readout", "rows"]
    environment = {**os.environ, "VLP_PROGRAMS_DIR": str(programs)}
    subprocess.run([*command, "--gates", gates], check=True, env=environment)


def deviations(year, results):
    """Of each figure of which the truth is known: how far it is off, in units of the stated sd, less its camera's mean,
    which the next sessions share; rms, with the freedom that the mean takes made good."""
    off = {}
    for row in read_table(results / "fleet.csv"):
        camera, session = int(row["camera"][-2:]), int(row["session"][-2:])
        intrinsics, lean, arm = year.unit(camera, year.day(camera, session))
        truth = {"focal_x_px": intrinsics[0], "focal_y_px": intrinsics[1], "principal_point_x_px": intrinsics[2]}
        truth |= {"center_y_px": intrinsics[3], "lever_arm_x_mm": 1e3 * arm[0], "lever_arm_y_mm": 1e3 * arm[1]}
        for figure, value in truth.items():
            if row[figure] and row[fleet.sd_column(figure)]:
                kind = fleet.parameter_of(figure)
                off.setdefault(kind, {}).setdefault((camera, figure), []).append(
                    (float(row[figure]) - value, float(row[fleet.sd_column(figure)]))
                )
    for kind, series in off.items():
        squares = freedoms = 0
        for errors in series.values():
            mean = statistics.fmean(error for error, _ in errors)
            squares += sum(((error - mean) / sd) ** 2 for error, sd in errors)
            freedoms += len(errors) - 1
        all_off = [error for errors in series.values() for error, _ in errors]
        sd = statistics.median(sd for errors in series.values() for _, sd in errors)
        scatter = math.sqrt(squares / freedoms)
        yield kind, scatter, statistics.pstdev(all_off), sd


def verdict(year, results):
    found = json.loads((results / "changes.json").read_text())["fleet"]
    missed = 0

    def ask(what, met, words):
        nonlocal missed
        missed += not met
        print(f"{what:58} {words:44} {'correct' if met else 'WRONG'}")

    quiet = year.quiet
    expected = {} if quiet else {camera_name(FOCAL[0]): "focal", camera_name(TILT[0]): "tilt", camera_name(CENTER[0]): "center"}
    called = {alarm["camera"]: alarm["changes"] for alarm in found["cameras"]}
    for camera, what in expected.items():
        changes = called.get(camera, [])
        first = f"{changes[0]['column']} {changes[0]['change']:+.3g} ± {changes[0]['sd']:.2g}" if changes else "not called"
        ask(f"{camera}: {what} drifts", bool(changes), first)
    for camera in sorted(called.keys() - expected.keys()):
        ask(f"{camera}: unchanged", False, called[camera][0]["column"])
    moves = [] if quiet else MOVED
    for room, lamp, day, by in moves:
        ones = [one for one in found["lamps"] if (one["room"], one["lamp"]) == (f"room {room}", lamp)]
        what = f"room {room}, lamp {lamp}: {1e3 * math.hypot(*by):.0f} mm on {year.date(day)}"
        if not ones:
            ask(what, False, "not called")
            continue
        one = ones[0]
        off = [abs(moved - 1e3 * true) for moved, true in zip(one["displacement_mm"], by)]
        dated = one["before"]["date"] < year.date(day) <= one["since"]["date"]
        words = f"{math.hypot(*one['displacement_mm']):.2f} mm, {one['before']['date']} to {one['since']['date']}"
        ask(what, dated and max(o / sd for o, sd in zip(off, one["sd_mm"])) < 5, words)
    for one in found["lamps"]:
        if (one["room"], one["lamp"]) not in [(f"room {room}", lamp) for room, lamp, _, _ in moves]:
            ask(f"{one['room']}, lamp {one['lamp']}: unchanged", False, f"{one['displacement_mm']} mm")
    between = ", ".join(f"{name} {tau:.3g}" for name, tau in found["between_sessions"].items() if tau)
    print(f"standard deviations between sessions, besides the stated ones: {between}")
    return missed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--programs", type=Path, default=SOURCE / "build/bin")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quiet-year", action="store_true")
    parser.add_argument("--only-figures", action="store_true")
    options = parser.parse_args()
    year = Year(options.seed, options.quiet_year)
    folder = options.folder.resolve() / (f"{'quiet' if options.quiet_year else 'year'}-{options.seed}")
    archive, results = folder / "archive", folder / "results"
    if not options.only_figures:
        render(year, archive, options.programs.resolve())
        calibrate(archive, results, options.programs.resolve())
    for kind, scatter, off, sd in deviations(year, results):
        print(f"{kind:15} {sd:8.3g} stated, off by {off:8.3g}; scatter over stated {scatter:.2f}")
    sys.exit(1 if verdict(year, results) else 0)


if __name__ == "__main__":
    main()
