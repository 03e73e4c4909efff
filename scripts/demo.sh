#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs packages, builds, renders images of a camera in a room like that of Chen and Guan, calibrates the
# camera from them, computes its position in 432 other images, and prints the errors of the fixes.
# Results are in out/demo; existing ones are not computed again. The other programs are built after that.
set -euo pipefail
cd "$(dirname "$0")/.."

# run_logged COMMAND...: prints the end of the log if the command fails.
run_logged() {
  if ! "$@" >>out/demo/build.log 2>&1; then
    tail -n 30 out/demo/build.log >&2
    return 1
  fi
}

scripts/setup.sh --build
mkdir -p out/demo
: >out/demo/build.log
echo "Building (some minutes the first time; the log is out/demo/build.log) ..."
tests=()
[ -e build/CMakeCache.txt ] || tests=(-DBUILD_TESTING=OFF)  # the packages of the tests may be missing
# Clang compiles in three quarters of the time of GCC. CXX in the environment chooses another compiler.
CXX=${CXX:-clang++} run_logged cmake --preset release -DVLP_TOOLBOX=ON "${tests[@]}"
run_logged cmake --build --preset release --target vlp-simulate vlp-calibrate

rig=datasets/paper-rig session=out/demo/paper-rig
echo "Rendering captures of a camera to $session ..."
build/bin/vlp-simulate --quiet $rig/scene.yaml \
  --only boards,rotation,dispersion,check,line-x,line-y -o $session
cp $rig/gates.yaml $session/
echo "Calibrating the camera with vlp-calibrate:"
code=0
build/bin/vlp-calibrate $session -o out/demo/results --camera-id paper-rig --row-time-s 3e-5 \
  --readout rows || code=$?
echo
report=out/demo/results/report.html calibration=out/demo/results/calibration.yaml
if [ -e $report ] && [ -e $calibration ]; then
  echo "Open $report; the calibration is $calibration"
else
  echo "demo.sh: there is no report; see above" >&2
fi
echo "Building the other programs ..."
run_logged cmake --build --preset release --target vlp_programs || code=$((code > 0 ? code : 1))
exit $code
