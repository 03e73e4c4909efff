#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Reproduces the table of Chen and Guan, "High Accuracy VLP based on Image Sensor using Error Calibration
# Method", with rendered images of a similar rig. Prints their results and ours: horizontal errors of
# 432 stationary fixes without calibration, with the rotation center, and with rotation center and
# dispersion, for the methods of the paper and for the exact ones. The lens is treated as known. Fixes use
# the first two or three lamps of an image, or all. The last row uses a lamp map that is refined from the
# rotation captures. Below the table one line states the cause of each difference, with values of this
# run.
#
#   scripts/reproduce_paper.sh [SCENE [OUT]]     default: datasets/paper-rig-faulty out/reproduce-SCENE
#
# Build first (scripts/test.sh); the programs are those in VLP_PROGRAMS_DIR, by default build/bin. Existing
# images in OUT are reused. Exit code 1 if a capture has no fix.
set -euo pipefail
cd "$(dirname "$0")/.."

scene=${1:-datasets/paper-rig-faulty}
out=${2:-out/reproduce-$(basename "$scene")}
bin=${VLP_PROGRAMS_DIR:-build/bin}
folders=(rotation dispersion dispersion-one-yaw check)
for program in simulate detect rotation dispersion locate; do
  if [ ! -x "$bin/vlp-$program" ]; then
    echo "reproduce_paper.sh: $bin/vlp-$program is missing: run scripts/test.sh first" >&2
    exit 2
  fi
done
mkdir -p "$out"
log=$out.log
: >"$log"
vlp() {  # PROGRAM ARGUMENT...
  if ! "$bin/vlp-$1" --quiet "${@:2}" 2>>"$log"; then
    tail -n 3 "$log" >&2
    exit 1
  fi
}

vlp simulate "$scene/scene.yaml" --only "$(IFS=,; echo "${folders[*]}")" -o "$out"
# Extracts the camera from the true calibration.
awk '/^[a-z]/ { part = $1 } part != "rotation_center:"' "$out/true_calibration.yaml" \
  >"$out/camera.yaml"
# Adds the errors of bounding-box centers, 1.7 px rms: normal noise of 1.2 px per axis.
noisy() {  # DETECTIONS
  awk -F, -v OFS=, 'function uniform() {
                      state = (state * 16807) % 2147483647
                      return state / 2147483647
                    }
                    function noise() {
                      radius = 1.2 * sqrt(-2 * log(uniform()))
                      return radius * cos(6.283185307 * uniform())
                    }
                    BEGIN { state = 1 }
                    NR == 1 { print "image,lamp,u_px,v_px"; next }
                    { print $1, $2, $3 + noise(), $4 + noise() }' "$1"
}
for folder in "${folders[@]}"; do
  vlp detect "$out/$folder" --lamps "$out/lamps.yaml" --calibration "$out/camera.yaml" \
    -o "$out/$folder.csv"
  noisy "$out/$folder.csv" >"$out/$folder-noisy.csv"
  for lamps in 2 3; do
    for kind in "" -noisy; do
      awk -F, -v lamps=$lamps 'NR == 1 || seen[$1]++ < lamps' "$out/$folder$kind.csv" \
        >"$out/$folder$kind-$lamps.csv"
    done
  done
done

# Prints mean, 90 % quantile and maximum of the errors in mm.
errors_of() {  # FIXES
  awk -F, 'FNR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
           NR == FNR { x[$1] = $2; y[$1] = $3; ++captures; next }
           $column["status"] == "ok" && $1 in x {
             dx = $column["x_m"] - x[$1]; dy = $column["y_m"] - y[$1]
             printf "%.9f\n", 1e3 * sqrt(dx * dx + dy * dy); ++fixes
           }
           END {
             if (fixes == captures) exit
             printf "reproduce_paper.sh: %d of %d captures have no fix: %s\n", captures - fixes,
                    captures, FILENAME | "cat >&2"
             exit 1
           }' "$out/check/truth.csv" "$1" | sort -g |
    awk '{ error[NR] = $1; sum += $1 }
         END { printf "%6.2f %6.2f %6.2f", sum / NR, error[int(0.9 * NR + 0.5)], error[NR] }'
}
locate() {  # DETECTIONS CALIBRATION CORRECTION [LAMPS]
  vlp locate "$1" --lamps "${4:-$out/lamps.yaml}" --calibration "$2" --correction "$3" \
    -o "$out/fixes.csv"
  errors_of "$out/fixes.csv"
}

# Fails early if a capture has no fix.
locate "$out/check.csv" "$out/camera.yaml" none >/dev/null

# Calibrates rotation center and dispersion with the given methods; writes $out/$1.yaml.
calibrate() {  # NAME LAMPS ROTATION-METHOD DISPERSION-METHOD DISPERSION-CAPTURES [KIND]
  vlp rotation "$out/rotation${6:-}.csv" --lamps "$out/lamps.yaml" \
    --calibration "$out/camera.yaml" --method "$3" -o "$out/$1-rotated.yaml"
  vlp dispersion "$out/$5${6:-}$2.csv" --captures "$out/$5/captures.csv" \
    --lamps "$out/lamps.yaml" --calibration "$out/$1-rotated.yaml" --method "$4" \
    -o "$out/$1.yaml"
}
row() {  # LABEL NONE ROTATION DISPERSION
  printf '%-28s %22s %22s %22s\n' "$@"
}
mean_of() {  # ERRORS
  awk '{ print $1 }' <<<"$1"
}
# Prints a row of the table and sets none, rotation and dispersion to the means.
measured() {  # LABEL NAME CHECK
  none=$(locate "$out/check$3.csv" "$out/camera.yaml" none)
  rotation=$(locate "$out/check$3.csv" "$out/$2.yaml" rotation)
  dispersion=$(locate "$out/check$3.csv" "$out/$2.yaml" all)
  row "$1" "$none" "$rotation" "$dispersion"
  none=$(mean_of "$none") rotation=$(mean_of "$rotation") dispersion=$(mean_of "$dispersion")
}

for lamps in 2 3; do
  calibrate paper-$lamps -$lamps circle chen-guan dispersion-one-yaw
  calibrate exact-$lamps -$lamps axis camera dispersion
  calibrate noisy-$lamps -$lamps circle chen-guan dispersion-one-yaw -noisy
done
calibrate exact "" axis camera dispersion
vlp rotation "$out/rotation.csv" --method lamps --lamps "$out/lamps.yaml" \
  --calibration "$out/camera.yaml" --refine-map "$out/refined-lamps.yaml" -o "$out/leveled.yaml"

captures=$(($(wc -l <"$out/check/truth.csv") - 1))
echo "Horizontal errors of $captures fixes in mm: mean, 90 %, largest"
row "" none rotation dispersion
row "two lamps    the paper" "19.9      -      -" "15.4   21.3      -" " 8.2      -   19.3"
measured "             its methods" paper-2 -2
none_2=$none rotation_2=$rotation dispersion_2=$dispersion
measured "             exact methods" exact-2 -2
exact_2=$dispersion turned_2=$rotation
row "three lamps  the paper" "21.4      -      -" "10.8   16.8      -" " 8.8      -      -"
measured "             its methods" paper-3 -3
none_3=$none rotation_3=$rotation dispersion_3=$dispersion
measured "             exact methods" exact-3 -3
exact_3=$dispersion turned_3=$rotation
measured "all lamps    exact methods" exact ""
exact_all=$dispersion
refined=$(locate "$out/check" "$out/leveled.yaml" rotation "$out/refined-lamps.yaml")
row "             refined map" "" "$refined" "-"
noisy_2=$(mean_of "$(locate "$out/check-noisy-2.csv" "$out/noisy-2.yaml" all)")
noisy_3=$(mean_of "$(locate "$out/check-noisy-3.csv" "$out/noisy-3.yaml" all)")
true_map=$(mean_of "$(locate "$out/check.csv" "$out/exact.yaml" all "$out/true_lamps.yaml")")

# Prints the numbers of a list in a calibration, separated by spaces.
numbers() {  # FILE KEY
  awk -v key="$2:" '$1 == key { gsub(/[][,]/, " "); $1 = ""; print; exit }' "$1"
}
height=$(awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
                  { sum += $column["z_m"] } END { print sum / (NR - 1) }' "$out/check/truth.csv")
lamps_height=$(awk -F'[][,]' '/position_m/ { sum += $5; ++n } END { print sum / n }' \
               "$out/lamps.yaml")
read -r true_u true_v <<<"$(numbers "$out/true_calibration.yaml" center_px)"
read -r circle_u circle_v <<<"$(numbers "$out/paper-2.yaml" center_px)"
read -r arm_x arm_y <<<"$(numbers "$out/exact.yaml" lever_arm_m)"
read -r focal _ center_u center_v _ <<<"$(numbers "$out/camera.yaml" intrinsics)"
awk -v height="$(awk -v a="$lamps_height" -v b="$height" 'BEGIN { print a - b }')" \
  -v focal="$focal" -v u="$true_u" -v v="$true_v" -v cu="$center_u" -v cv="$center_v" \
  -v circle_u="$circle_u" -v circle_v="$circle_v" -v arm_x="${arm_x:-0}" -v arm_y="${arm_y:-0}" \
  -v none="$none_2 and $none_3" -v rotation="$rotation_2 and $rotation_3" \
  -v turned="$turned_2 and $turned_3" \
  -v dispersion="$dispersion_2 and $dispersion_3" -v exact="$exact_2, $exact_3 and $exact_all" \
  -v noisy="$noisy_2 and $noisy_3" -v true_map="$true_map" '
  function length_of(x, y) { return sqrt(x * x + y * y) }
  BEGIN {
    degrees = 57.29577951
    tilt = atan2(length_of(u - cu, v - cv), focal)
    off = length_of(circle_u - u, circle_v - v)
    print "\nCauses of the differences from the paper, two and three lamps; mm"
    printf "none        ours %s, theirs 19.9 and 21.4: our camera is tilted by %.2f degrees, which is " \
           "%.1f\n            at %.2f m under the lamps; theirs would be a tilt of %.2f degrees.\n",
           none, tilt * degrees, 1e3 * height * tilt, height, atan2(0.0199, height) * degrees
    printf "rotation    ours %s, theirs 15.4 and 10.8: the center of our circles has an error of " \
           "%.2f px, %.1f\n            at that height, because the camera is %.1f from its axis of " \
           "rotation and the lamps\n            move on ellipses. The exact method models both: %s.\n",
           rotation, off, 1e3 * height * off / focal,
           1e3 * length_of(arm_x, arm_y), turned
    printf "dispersion  ours %s, theirs 8.2 and 8.8: we detect lamps by their outlines. With the " \
           "errors\n            of bounding-box centers, 1.7 px rms, it is %s. An offset is correct " \
           "only at\n            the position, height and yaw of the reference point; the errors of the " \
           "exact\n            methods are %s for two, three and all lamps.\n", dispersion, noisy, exact
    printf "exact       the remaining error is that of the lamp map: with the true map and all lamps it " \
           "is %s.\n",
           true_map
  }'
