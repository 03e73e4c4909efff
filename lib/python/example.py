#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Computes the fixes of all captures of a table and their errors against the ground truth.

From the project's folder, or with another folder of a lamp map, a calibration, detections and truth:

    PYTHONPATH=build/python python3 lib/python/example.py [datasets/example]
"""

import pathlib
import sys

import numpy as np
import vlp

folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/example")

# Lamp map and camera.
lamps = vlp.LampMap(folder / "lamps.yaml")
calibration = vlp.Calibration(folder / "calibration.yaml")
positioner = vlp.Positioner(lamps, calibration)
print(f"{len(lamps)} lamps; camera {calibration.camera_id}, {calibration.lens_model}")

# Detections: a row for each lamp in each image. One frame:
seen = vlp.read_detections(folder / "detections.csv")
first = seen["frames"] == 0
fix = positioner.locate(seen["lamps"][first], seen["pixels"][first], seen["sigma_px"][first])
print(fix, "sd of x", np.sqrt(fix.covariance[0, 0]))

# All of them at once, as arrays.
fixes = positioner.locate_frames(seen["frames"], seen["lamps"], seen["pixels"], seen["sigma_px"])
ok = fixes["status"] == 0
for status in set(fixes["status"][~ok]):
    print("no fix:", vlp.explanation(status))

truth = vlp.read_truth(folder / "truth.csv")
assert seen["images"] == truth["images"]
errors_m = np.linalg.norm((fixes["position_m"] - truth["position_m"])[ok, :2], axis=1)
print(f"{ok.sum()} fixes, mean error {1000 * errors_m.mean():.3f} mm")

# Directions of the lamps of the first frame in the camera.
rays = calibration.lens.unproject(seen["pixels"][first])
print("largest angle from the axis", np.degrees(np.arccos(rays[:, 2].min())).round(1), "degrees")
