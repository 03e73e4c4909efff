#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# The table of Chen and Guan, "High Accuracy VLP based on Image Sensor using Error Calibration
# Method", on rendered images of a rig like theirs, with their numbers beside ours: horizontal errors
# of 432 stationary fixes without calibration, with the rotation centre, and with the dispersion on
# top of it; by the paper's own methods, and by the exact ones. The lens is taken as known. A fix is of
# the first two, or three, of the lamps in its image; the last row is of all, and of a lamp map that is
# refined from the rotation captures.
#
#   scripts/reproduce_paper.sh [SCENE]     default: datasets/paper-rig-faulty
#
# Build first (scripts/test.sh). Everything goes to out/reproduce-SCENE; images that are there are
# used again.
set -euo pipefail
cd "$(dirname "$0")/.."

scene=${1:-datasets/paper-rig-faulty}
out=out/reproduce-$(basename "$scene")
folders=(rotation dispersion dispersion-turning check)
for program in simulate detect rotation dispersion locate; do
  if [ ! -x build/bin/vlp-$program ]; then
    echo "reproduce_paper.sh: build/bin/vlp-$program is missing: run scripts/test.sh first" >&2
    exit 2
  fi
done
mkdir -p out
log=$out.log
: >"$log"
vlp() {  # PROGRAM ARGUMENT...
  if ! build/bin/vlp-"$1" --quiet "${@:2}" 2>>"$log"; then
    tail -n 3 "$log" >&2
    exit 1
  fi
}

vlp simulate "$scene/scene.yaml" --only "$(IFS=,; echo "${folders[*]}")" -o "$out"
# Of the true calibration the camera alone.
awk '/^[a-z]/ { part = $1 } part != "rotation_center:"' "$out/true_calibration.yaml" \
  >"$out/camera.yaml"
for folder in "${folders[@]}"; do
  vlp detect "$out/$folder" --lamps "$out/lamps.yaml" --calibration "$out/camera.yaml" \
    -o "$out/$folder.csv"
  for lamps in 2 3; do
    awk -F, -v lamps=$lamps 'NR == 1 || seen[$1]++ < lamps' "$out/$folder.csv" \
      >"$out/$folder-$lamps.csv"
  done
done

# Mean and largest error, and that which 90 % stay below, in mm.
errors_of() {  # FIXES
  awk -F, 'FNR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
           NR == FNR { x[$1] = $2; y[$1] = $3; next }
           $column["status"] == "ok" {
             dx = $column["x_m"] - x[$1]; dy = $column["y_m"] - y[$1]
             printf "%.9f\n", 1e3 * sqrt(dx * dx + dy * dy)
           }' "$out/check/truth.csv" "$1" | sort -g |
    awk '{ error[NR] = $1; sum += $1 }
         END { printf "%6.2f %6.2f %6.2f", sum / NR, error[int(0.9 * NR + 0.5)], error[NR] }'
}
locate() {  # DETECTIONS CALIBRATION CORRECTION [LAMPS]
  vlp locate "$1" --lamps "${4:-$out/lamps.yaml}" --calibration "$2" --correction "$3" \
    -o "$out/fixes.csv"
  errors_of "$out/fixes.csv"
}

row() {  # LABEL NONE ROTATION DISPERSION
  printf '%-28s %22s %22s %22s\n' "$@"
}
# Rotation centre and dispersion by some methods, then the fixes of so many lamps.
measured() {  # LABEL LAMPS ROTATION-METHOD DISPERSION-METHOD DISPERSION-CAPTURES
  local station=$out/$5 none rotation dispersion
  vlp rotation "$out/rotation.csv" --lamps "$out/lamps.yaml" --calibration "$out/camera.yaml" \
    --method "$3" -o "$out/rotated.yaml"
  vlp dispersion "$station-$2.csv" --captures "$station/captures.csv" --lamps "$out/lamps.yaml" \
    --calibration "$out/rotated.yaml" --method "$4" -o "$out/calibration.yaml"
  none=$(locate "$out/check-$2.csv" "$out/camera.yaml" none)
  rotation=$(locate "$out/check-$2.csv" "$out/calibration.yaml" rotation)
  dispersion=$(locate "$out/check-$2.csv" "$out/calibration.yaml" all)
  row "$1" "$none" "$rotation" "$dispersion"
}

echo "Horizontal errors of the fixes in mm: mean, 90 %, largest"
row "" none rotation dispersion
row "two lamps    the paper" "19.9      -      -" "15.4   21.3      -" " 8.2      -   19.3"
measured "             its methods" 2 circle paper dispersion
measured "             exact methods" 2 axis camera dispersion-turning
row "three lamps  the paper" "21.4      -      -" "10.8   16.8      -" " 8.8      -      -"
measured "             its methods" 3 circle paper dispersion
measured "             exact methods" 3 axis camera dispersion-turning

vlp rotation "$out/rotation.csv" --method lamps --lamps "$out/lamps.yaml" \
  --calibration "$out/camera.yaml" --refine-map "$out/refined-lamps.yaml" -o "$out/levelled.yaml"
none=$(locate "$out/check.csv" "$out/camera.yaml" none)
refined=$(locate "$out/check" "$out/levelled.yaml" rotation "$out/refined-lamps.yaml")
row "all lamps    refined map" "$none" "$refined" "-"
