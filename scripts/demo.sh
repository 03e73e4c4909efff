#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Sets up, builds, and shows on the example data what the toolbox does: what accuracy the room
# allows, and fixes with and without the calibration of the camera's tilt. Results go to out/demo.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
mkdir -p out/demo
: >out/demo/build.log
echo "Building (a few minutes the first time; the log is out/demo/build.log) ..."
if ! { cmake --preset release -DVLP_TOOLBOX=ON &&
       cmake --build --preset release --target vlp-limits vlp-locate; } \
  >out/demo/build.log 2>&1
then
  tail -n 30 out/demo/build.log >&2
  exit 1
fi

example=datasets/example
camera=(--lamps $example/lamps.yaml --calibration $example/calibration.yaml)

echo
echo "== What the room allows: five lamps, a level camera on the floor, 0.05 px of noise"
build/bin/vlp-limits "${camera[@]}" --height-m 0 --noise-px 0.05 --center-px 0.1 --tilt-deg 0.01 \
  --lamp-map-mm 0.1 --floor-m -1 1 -0.8 0.8 --map out/demo/limits.csv --picture out/demo/limits.png
echo
echo "== Where the camera was, with its calibrated tilt of 1.3 degrees"
build/bin/vlp-locate $example/detections.csv "${camera[@]}" -o out/demo/fixes.csv
echo
echo "== The same without that calibration: the residuals tell"
build/bin/vlp-locate $example/detections.csv "${camera[@]}" --correction none \
  -o out/demo/fixes-uncorrected.csv
echo
echo "Written to out/demo: fixes.csv, fixes-uncorrected.csv, limits.csv, limits.png"
