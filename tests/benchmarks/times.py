#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Measures the processor times that tests/ACCURACY.md states, each beside a reference loop in the same run.

    times.py [--build FOLDER] [--turns N] [--factor F] [NAME...]

Prints, for each quantity, the median processor time (user and system) of N turns, that of the reference loop before
and after each turn, and their ratio, as the rows of the table "Times" of tests/ACCURACY.md. NAME selects quantities.
Exit code 1 if a ratio differs from the stated one by more than F times (default 1.5), or is not stated.
"""
import argparse
import json
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PAGE = SOURCE / "tests/ACCURACY.md"
ROW = re.compile(r"^\| (?P<name>[^|]+?) \| (?P<time>[\d.]+) \| (?P<loop>[\d.]+) \| (?P<ratio>[\d.]+) \|$", re.M)


def run(*command, cwd):
    """Runs a command and returns its output and the processor time of it and its children in seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"times.py: {' '.join(map(str, command))}: exit code {done.returncode}\n{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


class Trials:
    """The quantities: a method each, which returns seconds; its docstring is the name in the table."""

    def __init__(self, build, folder):
        self.bin = build / "bin"
        self.benchmarks = build / "tests/benchmarks"
        self.folder = folder

    def program(self, name, *arguments):
        return run(self.bin / name, "--quiet", *arguments, cwd=self.folder)[1]

    def benchmark(self, subject, name):
        """Returns the processor time of an iteration in seconds."""
        output, _ = run(self.benchmarks / f"{subject}_benchmark", f"--benchmark_filter=^{name}$",
                        "--benchmark_format=json", cwd=self.folder)
        result = json.loads(output)["benchmarks"][0]
        return result["cpu_time"] * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}[result["time_unit"]]

    def rendered(self, scene, *arguments):
        """Returns the folder of rendered captures; renders them at the first call."""
        folder = self.folder / "-".join([scene, *arguments]).replace("/", "_")
        if not folder.exists():
            self.program("vlp-simulate", SOURCE / f"datasets/{scene}/scene.yaml", *arguments, "-o", folder)
        return folder

    def fixes(self):
        """1,000,000 fixes, four lamps"""
        return 1e6 * self.benchmark("fix", "fix/lamps:4")

    def fixes_with_uncertainty(self):
        """fixes with the uncertainty of calibration and map"""
        return 1e6 * self.benchmark("fix", "fix_with_the_common_part/lamps:4")

    def fixes_in_motion(self):
        """fixes with velocity"""
        return 1e6 * self.benchmark("fix", "fix_of_a_body/velocity/lamps:4")

    def detection(self):
        """detection, 1,000 images of 800 x 600"""
        return 1e3 * self.benchmark("detection", "detect")

    def detection_opencv(self):
        """the same by connected components of OpenCV"""
        return 1e3 * self.benchmark("detection", "opencv_components")

    def detection_large(self):
        """detection, 1,000 images of 33 Mpx, columns"""
        return 1e3 * self.benchmark("detection", "detect_in_33_mpx_by_columns")

    def unprojection(self):
        """10,000,000 unprojections, OPENCV8"""
        return 1e4 * self.benchmark("lens", "unproject_here/opencv8")  # 1,000 points each

    def unprojection_splined(self):
        """the same, splined, 16 x 14"""
        return 1e4 * self.benchmark("lens", "unproject_here/splined")

    def lens(self):
        """`vlp-intrinsics`, 36 images"""
        rig = self.rendered("paper-rig", "--only", "boards")
        return self.program("vlp-intrinsics", rig / "boards", "--board", rig / "board.yaml", "--corners", "corners.csv",
                            "-o", "camera.yaml")

    def lens_from_corners(self):
        """`vlp-intrinsics`, their corners"""
        rig = self.rendered("paper-rig", "--only", "boards")
        if not (self.folder / "corners.csv").exists():
            self.lens()
        return self.program("vlp-intrinsics", "corners.csv", "--board", rig / "board.yaml", "--imager-px", 800, 600,
                            "-o", "from_corners.yaml")

    def session(self):
        """`vlp-calibrate`, 50 images of `archive`"""
        station = next(self.rendered("archive", "--archive", "1").glob("camera-*/*/"))
        output = tempfile.mkdtemp(dir=self.folder)  # an earlier result would be used again
        return self.program("vlp-calibrate", station, "--row-time-s", 3e-5, "--readout", "rows", "-o", output)

    def unit(self):
        """`vlp-station`, 136 images"""
        output, _ = run(SOURCE / "tests/benchmarks/station_trials.sh", "timing", cwd=SOURCE)
        return float(re.search(r"([\d.]+) s of processor time", output)[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--factor", type=float, default=1.5)
    helpers = ("program", "benchmark", "rendered")
    names = [name for name in vars(Trials) if name[0] != "_" and name not in helpers]
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(names))
    options = parser.parse_args()
    unknown = set(options.names) - set(names)
    if unknown:
        parser.error(f"no quantity {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    stated = {row["name"]: float(row["ratio"]) for row in ROW.finditer(PAGE.read_text(encoding="utf-8"))}
    loop = [options.build.resolve() / "tests/benchmarks/reference_loop"]
    wrong = []
    with tempfile.TemporaryDirectory(prefix="vlp-times-") as folder:
        trials = Trials(options.build.resolve(), Path(folder))
        print("| quantity | time, s | reference loop, s | ratio |\n|---|---|---|---|")
        for name in options.names or names:
            getattr(trials, name)()  # renders, and fills caches
            times, loops = [], []
            for _ in range(options.turns):
                loops.append(run(*loop, cwd=folder)[1])
                times.append(getattr(trials, name)())
                loops.append(run(*loop, cwd=folder)[1])
            time_s, loop_s = statistics.median(times), statistics.median(loops)
            ratio, title = time_s / loop_s, getattr(Trials, name).__doc__
            print(f"| {title} | {time_s:.3g} | {loop_s:.3g} | {ratio:.3g} |", flush=True)
            if title not in stated:
                wrong.append(f"{name}: {PAGE.name} states no ratio; add the row")
            elif not 1 / options.factor <= ratio / stated[title] <= options.factor:
                wrong.append(f"{name}: ratio {ratio:.3g}, {PAGE.name} states {stated[title]:g}; find out why, or state it")
    for line in wrong:
        print(f"times.py: {line}", file=sys.stderr)
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
