#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Compares fixes of a camera with motion capture of the body that carries it.

    scripts/compare_with_mocap.py BODY FIT_FIXES CHECK_FIXES [-o TRUTH]

BODY        poses of the body in the capture volume: timestamp [ns], x, y, z (m), qx, qy, qz, qw; image names are timestamps
FIT_FIXES   fixes.csv from which the mounting is fitted
CHECK_FIXES fixes.csv of other images, which are judged
TRUTH       output file: positions of the camera at the images of CHECK_FIXES, truth.csv for vlp-evaluate

The mounting is the position of the camera on the body, and the pose of the lamp map in the capture volume. With the pose
(R, p) of the body, the position c of the camera on the body and the pose (Q, t) of the map, the camera is in the map at

    Q^T (R c + p - t)

The fit minimizes 2 (sqrt(1 + (e / 5 mm)^2) - 1) over the coordinates e of fix minus this position. Requires numpy.
"""
import argparse
import csv
import sys

import numpy as np

SCALE_M = 5e-3
NUM_ITERATIONS = 100


def read_body(path):
    """Returns the timestamps in ns, relative to the first one, the first one, and the rows x, y, z, qx, qy, qz, qw."""
    with open(path, encoding="utf-8") as file:
        rows = [line.split(",") for line in file if line[:1].isdigit()]
    if not rows or any(len(row) != 8 for row in rows):
        sys.exit(f"{path}: has no rows of 8 columns: timestamp, position, quaternion; give the poses of the body")
    first = int(rows[0][0])
    return [int(row[0]) - first for row in rows], first, np.array([[float(x) for x in row[1:]] for row in rows])


def make_rotation(q):
    """Returns the rotation matrix of a quaternion x, y, z, w of any length."""
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def interpolate_pose(body, image):
    """Returns rotation and position of the body at an image, linear between two poses."""
    times, first, rows = body
    stamp = image.split(".")[0]
    if not stamp.isdigit():
        sys.exit(f"{image}: its name is no time in ns; name images by their times, as the motion capture does")
    time = int(stamp) - first
    after = int(np.searchsorted(times, time, side="right"))
    if not 0 < after < len(times):
        sys.exit(f"{image}: is not within the time of the motion capture")
    part = (time - times[after - 1]) / (times[after] - times[after - 1])
    before, next_row = rows[after - 1], rows[after]
    sign = 1 if before[3:] @ next_row[3:] > 0 else -1
    pose = (1 - part) * before + part * np.r_[next_row[:3], sign * next_row[3:]]
    return make_rotation(pose[3:]), pose[:3]


def read_fixes(path, body):
    """Returns image, pose of the body, position and standard deviations of each fix, m."""
    with open(path, encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["status"] == "ok" and row["x_sd_m"]]
    if not rows:
        sys.exit(f"{path}: has no fix with standard deviations")
    vector = lambda row, key: np.array([float(row[key.format(axis)]) for axis in "xyz"])
    return [(row["image"], interpolate_pose(body, row["image"]), vector(row, "{}_m"), vector(row, "{}_sd_m")) for row in rows]


def compute_camera(mounting, pose):
    """Returns the position of the camera in the map, m."""
    camera, rotation, origin = mounting
    return rotation.T @ (pose[0] @ camera + pose[1] - origin)


def fit_mounting(fixes):
    """Fits the mounting; the initial one has the camera at the origin of the body."""
    points = np.array([fix[2] for fix in fixes])
    bodies = np.array([fix[1][1] for fix in fixes])
    u, _, v = np.linalg.svd((bodies - bodies.mean(0)).T @ (points - points.mean(0)))
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    mounting = np.zeros(3), rotation, bodies.mean(0) - rotation @ points.mean(0)
    for _ in range(NUM_ITERATIONS):
        normal, right = np.zeros((9, 9)), np.zeros(9)
        for _, pose, position, _ in fixes:
            at = compute_camera(mounting, pose)
            x, y, z = at
            # Derivatives with respect to the camera on the body, a rotation of the map, and its position.
            jacobian = np.hstack([mounting[1].T @ pose[0], [[0, -z, y], [z, 0, -x], [-y, x, 0]], -mounting[1].T])
            weights = 1 / np.sqrt(1 + ((at - position) / SCALE_M) ** 2)
            normal += jacobian.T @ (weights[:, None] * jacobian)
            right -= jacobian.T @ (weights * (at - position))
        if np.linalg.matrix_rank(normal) < len(normal):
            sys.exit("the fixes do not determine the mounting: give three or more, with other rolls, pitches and yaws")
        step = np.linalg.solve(normal, right)
        half = np.r_[step[3:6] / 2, 1]  # rotation by minus the vector of the skew matrix above
        mounting = mounting[0] + step[:3], mounting[1] @ make_rotation(half), mounting[2] + step[6:]
    return mounting


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("body")
    parser.add_argument("fit_fixes")
    parser.add_argument("check_fixes")
    parser.add_argument("-o", "--output", help="truth.csv of CHECK_FIXES")
    arguments = parser.parse_args()
    body = read_body(arguments.body)
    mounting = fit_mounting(read_fixes(arguments.fit_fixes, body))
    fixes = read_fixes(arguments.check_fixes, body)
    truth = [compute_camera(mounting, pose) for _, pose, _, _ in fixes]
    errors = np.array([at - position for at, (_, _, position, _) in zip(truth, fixes)])
    lengths_mm = 1e3 * np.linalg.norm(errors, axis=1)
    normalized = np.sqrt(np.mean((errors / np.array([fix[3] for fix in fixes])) ** 2))
    print(f"fixes         {len(fixes)}")
    print(f"error         {np.median(lengths_mm):.2f} mm median, {lengths_mm.max():.2f} mm largest")
    print(f"error / sd    {normalized:.2f}, rms")
    if arguments.output:
        with open(arguments.output, "w", encoding="utf-8") as file:
            file.write("image,x_m,y_m,z_m\n")
            file.writelines(f"{fix[0]},{at[0]:.6f},{at[1]:.6f},{at[2]:.6f}\n" for fix, at in zip(fixes, truth))


if __name__ == "__main__":
    main()
