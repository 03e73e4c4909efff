#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Units for the station of datasets/station, each with a lens, a mount and noise of its own: whether
# good ones pass, and faulty ones fail with the cause named first. In the project's folder, built:
#   tests/benchmarks/station_trials.sh good [COUNT [FIRST_SEED]]     by default 50 units, from seed 1
#   tests/benchmarks/station_trials.sh faulty [COUNT [FIRST_SEED]]   5 of each of six kinds
#   tests/benchmarks/station_trials.sh kinds [COUNT [FIRST_SEED]]    1 of each of 30 kinds
#   tests/benchmarks/station_trials.sh mixed [COUNT [FIRST_SEED]]    10 units, each step with images of another
#   tests/benchmarks/station_trials.sh loose [COUNT [FIRST_SEED]]    5 units that move before the check
#   tests/benchmarks/station_trials.sh fixture|camera|images [COUNT [FIRST_SEED]]  faults of lamps and known
#                                    points; of camera and sensor; of settings and images: 11, 16 and 21
#                                    units of three sizes each; 1 seed
#   tests/benchmarks/station_trials.sh sharpness [COUNT [FIRST_SEED]]  of each seed a good unit and 15
#                                    with a veil, smear, dust, defocus or tilt, boards only; 1 seed
#   tests/benchmarks/station_trials.sh timing [COUNT [FIRST_SEED]]   1 unit
# A line for each, and the capability of good ones; exit code 1 when one did not end as it should. A good
# unit takes 9 s of processor time, six faulty ones 30 s. Changed images need /usr/bin/python3 with
# OpenCV (python3-opencv). timing: the
# processor time, pictures included, and how long the verdict takes after the last image, others
# coming every 50 ms before.
set -euo pipefail
cd "$(dirname "$0")/../.."
PATH=$PWD/build/bin:$PATH
what=${1:-good} count=${2:-} first=${3:-1}
declare -A counts=([good]=50 [faulty]=5 [kinds]=1 [mixed]=10 [loose]=5 [sharpness]=1 [timing]=1 [fixture]=1 [camera]=1 [images]=1)
[ -n "${counts[$what]:-}" ] || { sed -n '5,22s/^# \?//p' "$0"; exit 2; }
count=${count:-${counts[$what]}}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -rT datasets/station "$work/station"
wrong=0

# uniform VARIABLE FROM TO: draws a number that depends on the seed.
uniform() {
  state=$(((state * 1103515245 + 12345) % 2147483648))
  printf -v "$1" '%s' "$(awk -v s="$state" -v a="$2" -v b="$3" \
    'BEGIN { printf "%.6g", a + (b - a) * s / 2147483648 }')"
}

# scene_of SEED FOCAL_FROM FOCAL_TO CENTRE_OFF_PX BLUR_PX: makes the scene of a unit with its lens in
# this range, up to one degree of tilt and up to 5 mm of lever arm.
scene_of() {
  state=$(($1 * 7919))
  local fx ratio direction tilt azimuth arm_x arm_y
  uniform fx "$2" "$3"  # the first numbers of successive seeds are similar
  uniform fx "$2" "$3"
  uniform ratio 0.999 1.001
  uniform direction 0 6.28318
  uniform tilt 0 1
  uniform azimuth 0 360
  uniform arm_x -0.005 0.005
  uniform arm_y -0.005 0.005
  local lens
  lens=$(awk -v f="$fx" -v r="$ratio" -v d="$direction" -v off="$4" 'BEGIN {
    printf "%.6g, %.6g, %.6g, %.6g", f, f * r, 399.5 + off * cos(d), 299.5 + off * sin(d) }')
  sed -e "s/^seed: .*/seed: $1/" -e "s/\[520, 520.6, 402.3, 297.4,/[$lens,/" \
    -e "s/blur_px: 0.7/blur_px: $5/" \
    -e "s/tilt_deg: 0.4/tilt_deg: $tilt/" -e "s/tilt_azimuth_deg: 60/tilt_azimuth_deg: $azimuth/" \
    -e "s/lever_arm_m: \[0.002, -0.001\]/lever_arm_m: [$arm_x, $arm_y]/" \
    datasets/station/scene.yaml >"$work/scene.yaml"
}

render() {
  rm -rf "$work/unit"
  vlp-simulate -q "$work/scene.yaml" -o "$work/unit" "$@"
}

# tried KIND SEED EXPECTED: runs the unit; the line of the verdict must contain the text.
tried() {
  local said
  said=$(vlp-station run --station "$work/station/station.yaml" --camera-id "$1-$2" \
    --batch "$work/unit" 2>&1 >"$work/screen" | grep -v ': info: ' || true)
  [ -n "$said" ] || said=$(grep -o '^PASS' "$work/screen" || true)
  said="$(grep -o -m 1 -E '^(PASS|FAIL|INVALID)' "$work/screen" || true) ${said#*camera*: }"
  local end=''
  if [[ $said != *$3* ]]; then
    wrong=$((wrong + 1)) end='   NOT AS IT SHOULD'
  fi
  printf '%-24s %4d   %s%s\n' "$1" "$2" "${said/ PASS/}" "$end"
}

good() {
  scene_of "$1" 514.8 525.2 5 0.7
  render
  tried good "$1" PASS
}

faulty() {
  scene_of "$1" 514.8 525.2 $((14 + $1 % 16)) 0.7
  render --only boards
  tried decentered "$1" 'the lens is decentered'
  scene_of "$1" 514.8 525.2 5 2.$((2 + $1 % 8))
  render --only boards
  tried blurred "$1" 'the lens is blurred'
  if [ $(($1 % 2)) = 0 ]; then scene_of "$1" 460 500 5 0.7; else scene_of "$1" 540 580 5 0.7; fi
  render --only boards
  tried wrong "$1" 'wrong lens'

  scene_of "$1" 514.8 525.2 5 0.7
  render
  rm -rf "$work/good"
  cp -r "$work/unit" "$work/good"
  local lamps=$work/station/lamps.yaml lamp=$((1 + $1 % 6)) other=$((1 + ($1 + 1 + $1 % 5) % 6))
  # The lamp is at its position of the scene, and has an error of 2 to 6 cm in the map.
  awk -v id="$lamp" -v off=0.0$((2 + $1 % 5)) -F'[][]' '$0 ~ "id: " id "," {
    split($2, at, ", "); $0 = $1 "[" at[1] + off ", " at[2] - off / 2 ", " at[3] "]" $3 } { print }' \
    datasets/station/lamps.yaml >"$lamps"
  tried loose "$1" "lamp $lamp hangs"
  cp datasets/station/lamps.yaml "$lamps"
  local first_hz second_hz
  first_hz=$(sed -n "s/.*id: $lamp,.*frequency_hz: \([0-9]*\).*/\1/p" "$lamps")
  second_hz=$(sed -n "s/.*id: $other,.*frequency_hz: \([0-9]*\).*/\1/p" "$lamps")
  sed -i -e "/id: $lamp,/s/$first_hz/$second_hz/" -e "/id: $other,/s/$second_hz/$first_hz/" "$lamps"
  [ "$lamp" -lt "$other" ] || { local swap=$lamp; lamp=$other other=$swap; }
  unit_again
  tried swapped "$1" "lamps $lamp and $other"
  unit_again
  cp datasets/station/lamps.yaml "$lamps"
  sed -i 's/first_id: 0/first_id: 30/' "$work/station/board.yaml"
  tried board "$1" 'wrong board'
  cp datasets/station/board.yaml "$work/station/board.yaml"
}

# scene_change SED_SCRIPT: changes the scene that scene_of has written.
scene_change() {
  local before
  before=$(<"$work/scene.yaml")
  sed -i "$1" "$work/scene.yaml"
  [ "$before" != "$(<"$work/scene.yaml")" ] || { echo "nothing of the scene is $1" >&2; exit 2; }
}
# station_change FILE SED_SCRIPT: changes a file of the station; station_again: restores all of them.
station_change() {
  local before
  before=$(<"$work/station/$1")
  sed -i "$2" "$work/station/$1"
  [ "$before" != "$(<"$work/station/$1")" ] || { echo "nothing of $1 is $2" >&2; exit 2; }
}
station_again() { cp datasets/station/*.yaml "$work/station/"; }

# unit_again: makes the images of the good unit appear as those of another camera: equal pixels, other files.
again=0
unit_again() {
  rm -rf "$work/unit"
  cp -r "$work/good" "$work/unit"
  again=$((again + 1))
  find "$work/unit" -name '*.png' -exec sh -c 'for f; do echo "$0" >>"$f"; done' "$again" {} +
}

# picture COMMANDS STEP...: changes all images of steps. `image` has floats; `x` and `y` are the
# coordinates of its pixels.
picture() {
  local commands=$1 step
  shift
  for step; do
    /usr/bin/python3 - "$commands" "$work/unit/$step"/*.png <<'EOF'
import sys
import cv2
import numpy
for name in sys.argv[2:]:
    image = cv2.imread(name, cv2.IMREAD_GRAYSCALE).astype(numpy.float32)
    y, x = numpy.mgrid[: image.shape[0], : image.shape[1]]
    exec(sys.argv[1])
    cv2.imwrite(name, image.clip(0, 255).astype(numpy.uint8))
EOF
  done
}

# Each kind of fault of the camera, the station or the operator once, with the cause that is reported
# first.
kinds() {
  local seed=$1 table
  # The camera.
  scene_of "$seed" 514.8 525.2 18 0.7
  render --only boards
  tried decentered "$seed" 'the lens is decentered'
  scene_of "$seed" 514.8 525.2 5 2.5
  render --only boards
  tried blurred "$seed" 'the lens is blurred'
  scene_of "$seed" 460 500 5 0.7
  render --only boards
  tried wrong-lens "$seed" 'wrong lens'
  scene_of $((seed + 3000)) 514.8 525.2 5 0.7
  scene_change 's/tilt_deg: [0-9.]*$/tilt_deg: 4/'
  render
  tried leaning "$seed" 'the camera is tilted on its mount'
  scene_of $((seed + 2000)) 514.8 525.2 5 0.7
  scene_change 's/lever_arm_m: .*/lever_arm_m: [0.03, 0.01]/'
  render
  tried beside "$seed" 'the camera is off its axis'

  # The good unit with errors of the station and of the operator.
  scene_of "$seed" 514.8 525.2 5 0.7
  render
  rm -rf "$work/good"
  cp -r "$work/unit" "$work/good"
  # A fingerprint on the lens: a veil and a slight blur.
  picture 'image = 0.7 * cv2.GaussianBlur(image, (0, 0), 2.5) + 0.3 * image.mean()' \
    boards rotation dispersion check
  tried dirty-lens "$seed" 'the lens is blurred: out of focus, or dirty'
  unit_again
  picture 'image = cv2.blur(image, (15, 1))' boards
  tried vibration "$seed" 'the lens is blurred'

  # The board.
  unit_again
  station_change board.yaml 's/first_id: 0/first_id: 30/'
  tried other-board "$seed" 'wrong board'
  station_again
  scene_of $((seed + 5000)) 514.8 525.2 5 0.7
  scene_change 's/warp_m: .*/warp_m: [0.01, -0.0002]/'
  render --only boards
  tried bent-board "$seed" 'the board is warped'
  unit_again
  picture 'image = 12 * image' boards
  tried bright-boards "$seed" 'overexposed'
  scene_of $((seed + 6000)) 514.8 525.2 5 0.7
  scene_change 's/white_e_per_s: .*/white_e_per_s: 2.4e+4/;s/black_e_per_s: .*/black_e_per_s: 1.5e+3/;s/surround_e_per_s: .*/surround_e_per_s: 6.0e+3/'
  render --only boards
  tried dark-boards "$seed" 'too dark'

  # The lamps, and their entries in the station's files.
  unit_again
  station_change lamps.yaml 's/\[0, 0.28, 1.6\]/[0.04, 0.26, 1.6]/'
  tried loose-lamp "$seed" 'lamp 5 hangs'
  station_again
  unit_again
  station_change lamps.yaml 's/\[0.6, -0.3, 1.6\]/[0.61, -0.3, 1.6]/'
  tried lamp-10-mm "$seed" 'lamp 3 hangs'
  station_again
  unit_again
  station_change lamps.yaml 's/id: 2, \(.*\)frequency_hz: 2000/id: 2, \1frequency_hz: 3800/;s/id: 5, \(.*\)frequency_hz: 3800/id: 5, \1frequency_hz: 2000/'
  tried swapped "$seed" 'lamps 2 and 5'
  station_again
  unit_again
  station_change lamps.yaml 's/frequency_hz: 2500/frequency_hz: 2780/'
  tried lamp-of-other-frequency "$seed" 'lamp 3 is never visible'
  station_again
  scene_of $((seed + 4000)) 514.8 525.2 5 0.7
  scene_change '/id: 4,/s/electron_rate_e_per_s: 2.0e+8/electron_rate_e_per_s: 1.0e+5/'
  render
  tried unlit-lamp "$seed" 'lamp 4 is never visible'
  scene_of "$seed" 514.8 525.2 5 0.7
  scene_change 's/ambient_e_per_s: .*/ambient_e_per_s: 1.0e+10/'
  render --only rotation
  cp -r "$work/good/boards" "$work/unit/"
  find "$work/unit/boards" -name '*.png' -exec sh -c 'for f; do echo x >>"$f"; done' sh {} +
  tried bright-lamps "$seed" 'overexposed'
  scene_of $((seed + 7000)) 514.8 525.2 5 0.7
  scene_change 's/electron_rate_e_per_s: 2.0e+8/electron_rate_e_per_s: 2.0e+6/;s/ambient_e_per_s: .*/ambient_e_per_s: 1.0e+4/'
  render --only rotation
  cp -r "$work/good/boards" "$work/unit/"
  find "$work/unit/boards" -name '*.png' -exec sh -c 'for f; do echo z >>"$f"; done' sh {} +
  tried dark-lamps "$seed" 'dark'
  unit_again
  station_change camera_type.yaml 's/row_time_s: 3.0e-05/row_time_s: 3.3e-05/'
  tried row-time "$seed" 'row time is 33 us in camera_type.yaml'
  station_again
  unit_again
  station_change camera_type.yaml 's/row_time_s: 3.0e-05/row_time_s: 2.85e-05/'
  tried row-time-5-percent "$seed" 'row time is 28.5 us in camera_type.yaml'
  station_again
  unit_again
  station_change camera_type.yaml 's/row_time_s: 3.0e-05/row_time_s: 3.75e-05/'
  tried row-time-25-percent "$seed" 'row time is 37.5 us in camera_type.yaml'
  station_again

  # The known positions.
  unit_again
  for table in captures truth; do
    [ ! -e "$work/unit/check/$table.csv" ] || awk -F, -v OFS=, \
      '/^0003.png/ { $3 += 0.02 } { print }' "$work/good/check/$table.csv" >"$work/unit/check/$table.csv"
  done
  tried one-point "$seed" '0003.png was not taken at the position in its table'
  unit_again
  for table in captures truth; do
    [ ! -e "$work/unit/dispersion/$table.csv" ] || awk -F, -v OFS=, \
      '/^0.*png/ { $3 += 0.02 } { print }' "$work/good/dispersion/$table.csv" >"$work/unit/dispersion/$table.csv"
  done
  tried station-moved "$seed" 'positions of the dispersion are off'
  unit_again
  rm -f "$work/unit/check/captures.csv" "$work/unit/check/truth.csv"
  tried no-table "$seed" 'captures have no position'

  unit_again
  rm -r "$work/unit/check"
  cp -r "$work/unit/boards" "$work/unit/check"
  tried boards-as-check "$seed" 'check'
  unit_again
  rm -r "$work/unit/boards"
  cp -r "$work/unit/check" "$work/unit/boards"
  tried check-as-boards "$seed" 'boards (0/36)'
  rm -rf "$work/unit"
  cp -r "$work/good" "$work/unit"
  vlp-station run -q --station "$work/station/station.yaml" --camera-id "other-$seed" \
    --batch "$work/unit" >/dev/null 2>&1 || true
  tried anothers "$seed" "already of camera other-$seed"
  # Two cameras in one unit's folders.
  scene_of $((seed + 1000)) 505 510 9 0.7
  render --only rotation,dispersion,check
  cp -r "$work/good/boards" "$work/unit/"
  find "$work/unit/boards" -name '*.png' -exec sh -c 'for f; do echo y >>"$f"; done' sh {} +
  tried swapped-units "$seed" 'lamps and boards are imaged by different lenses'
  # The capture tool writes four views repeatedly.
  unit_again
  (cd "$work/unit/boards" && for image in 00[0-3]?.png; do
    cp "000$((10#${image%.png} % 4)).png" double.png && echo "$image" >>double.png && mv double.png "$image"
  done)
  tried double-images "$seed" 'the same image again'
  unit_again
  rm -f "$work"/unit/boards/00[123]?.png
  tried few-boards "$seed" 'boards: too few images'
}

# good_unit SEED: renders a good unit and keeps it for unit_again.
good_unit() {
  scene_of "$1" 514.8 525.2 5 0.7
  render
  rm -rf "$work/good"
  cp -r "$work/unit" "$work/good"
}

# set_positions STEP AWK: changes the rows of the tables with positions of a step; x and y are the numbers of their
# columns.
set_positions() {
  local table
  for table in captures truth; do
    [ ! -e "$work/good/$1/$table.csv" ] || awk -F, -v OFS=, "FNR == 1 { x = \$2 == \"x_m\" ? 2 : 3; y = x + 1 }
      FNR > 1 { $2 } { print }" "$work/good/$1/$table.csv" >"$work/unit/$1/$table.csv"
  done
}

# Faults of lamps and fixture in three sizes, the smallest just outside the gates.
fixture() {
  local seed=$1 size lamp=$((1 + $1 % 6)) table
  good_unit "$seed"
  for size in 0.004 0.006 0.010; do
    unit_again
    awk -v id="$lamp" -v off=$size -F'[][]' '$0 ~ "id: " id "," {
      split($2, at, ", "); $0 = $1 "[" at[1] + off ", " at[2] ", " at[3] "]" $3 } { print }' \
      datasets/station/lamps.yaml >"$work/station/lamps.yaml"
    tried "lamp-off-$size" "$seed" "INVALID*lamp $lamp hangs"
    station_again
  done
  for size in 0.0015 0.003 0.008; do
    unit_again
    set_positions check "\$x += $size"
    tried "fixture-off-$size" "$seed" 'INVALID*positions of the check'
  done
  for size in 0.0025 0.004 0.008; do
    unit_again
    set_positions dispersion "\$y += $size"
    tried "reference-off-$size" "$seed" 'INVALID*positions of the dispersion'
  done
  unit_again
  set_positions check '$x *= 1000; $y *= 1000'
  tried check-in-mm "$seed" 'x_m: the values agree with the fixes if they are in mm'
  unit_again
  for table in captures truth; do
    [ ! -e "$work/good/check/$table.csv" ] ||
      awk -F, -v OFS=, 'FNR == 1 { print; next } { name[FNR] = $1; sub(/^[^,]*,/, ""); rest[FNR] = $0 }
        END { for (i = 2; i <= FNR; ++i) print name[i], rest[FNR + 2 - i] }' \
        "$work/good/check/$table.csv" >"$work/unit/check/$table.csv"
  done
  tried check-reversed "$seed" 'INVALID*in reverse order'
}

# Faults of the camera in three sizes.
camera() {
  local seed=$1 size number=0 all="boards rotation dispersion check"
  for size in 4 5 7; do
    scene_of $((10 * seed + 30000 + size)) 514.8 525.2 5 0.7
    scene_change "s/tilt_deg: [0-9.]*\$/tilt_deg: $size/"
    render
    tried "tilted-$size" "$seed" 'FAIL*the camera is tilted'
  done
  for size in '-0.20, 0.06' '-0.30, 0.10' '-0.25, 0.12'; do
    number=$((number + 1))
    scene_of $((10 * seed + 40000 + number)) 514.8 525.2 5 0.7
    scene_change "s/-0.25, 0.08/$size/"
    render
    tried "distortion-$number" "$seed" 'FAIL*of another type'
  done

  good_unit "$seed"
  # The sensor and its glass.
  for size in 10 30 100; do
    unit_again
    picture "r = numpy.random.RandomState($seed); image[r.randint(0, 600, $size), r.randint(0, 800, $size)] = 255" $all
    tried "hot-pixels-$size" "$seed" 'FAIL*defective pixels'
  done
  unit_again
  picture "image[:, 200 + $seed % 400] = 2" $all
  tried dead-column "$seed" 'FAIL*defective'
  for size in 0.3 0.5 0.8; do
    unit_again
    picture "image = image * (1 - $size * numpy.exp(-((x - 760)**2 + (y - 560)**2) / (2 * 90.0**2)))" $all
    tried "shaded-corner-$size" "$seed" 'FAIL*shade'
  done
  for size in 0.06 0.12 0.25; do
    unit_again
    picture "image = image * (1 - $size * ((x - 300 - $seed % 200)**2 + (y - 250)**2 < 25**2))" $all
    tried "dust-25-px-$size" "$seed" 'FAIL*dust'
  done
}

# Settings of the camera and images in three sizes.
images() {
  local seed=$1 size lamps="rotation dispersion check" all="boards rotation dispersion check"
  good_unit "$seed"
  for size in 0.7 0.5 0.3; do
    unit_again
    picture "image = 2 + $size * (image - 2)" $all
    tried "gain-$size" "$seed" 'INVALID*gain'
  done
  for size in 4 8 16; do
    unit_again
    picture "image = image + $size" $all
    tried "black-level-$size" "$seed" 'INVALID*black level'
  done
  for size in 0.2 0.1 0.05; do
    unit_again
    picture "image = 2 + $size * (image - 2)" boards
    tried "dark-boards-$size" "$seed" 'INVALID*dark'
    unit_again
    picture "image = 2 + $size * (image - 2)" $lamps
    tried "dark-lamps-$size" "$seed" 'INVALID*dark'
  done

  for size in 20 40 80; do
    unit_again
    picture "image = cv2.resize(image[$size*3//4:-$size*3//4 or None, $size:-$size], None, None, 800 / (800 - 2 * $size), 600 / (600 - 2 * ($size * 3 // 4)))[:600, :800]" $all
    tried "cropped-$size" "$seed" 'INVALID*scaled'
  done
  for size in 5 9 15; do
    unit_again
    picture "image = cv2.blur(image, ($size, 1))" $lamps
    tried "motion-blur-$size" "$seed" 'INVALID*blur'
  done
}

# mixed SEED: a good unit with three images of another camera in one step, for each step; expects
# INVALID with the name of one of them. check-whole: all images of the check are of another camera;
# expects INVALID.
mixed() {
  local step image said named
  scene_of $(($1 + 1000)) 505 510 9 0.7
  render
  rm -rf "$work/other"
  mv "$work/unit" "$work/other"
  scene_of "$1" 514.8 525.2 5 0.7
  render
  rm -rf "$work/good"
  mv "$work/unit" "$work/good"
  for step in boards rotation dispersion check; do
    unit_again
    named=''
    for image in $(find "$work/good/$step" -name '*.png' -printf '%f\n' | sort | awk "NR % 4 == $1 % 4" | head -3); do
      cp "$work/other/$step/$image" "$work/unit/$step/$image"
      echo "mixed $again" >>"$work/unit/$step/$image"
      named+="${named:+|}${image%.png}"
    done
    said=$(vlp-station run --station "$work/station/station.yaml" --camera-id "mixed-$step-$1" \
      --batch "$work/unit" 2>&1 | grep -v ': info: ' || true)
    if grep -q INVALID <<<"$said" && grep -qE "($named)" <<<"$said"; then
      printf 'mixed %-18s %4d   named\n' "$step" "$1"
    else
      wrong=$((wrong + 1))
      printf 'mixed %-18s %4d   NOT AS IT SHOULD: %s\n' "$step" "$1" "$(grep -m 1 -E 'PASS|FAIL|INVALID' <<<"$said")"
    fi
  done
  unit_again
  cp "$work/other/check"/*.png "$work/unit/check/"
  tried check-whole "$1" 'INVALID*the images of check are of another camera'
}

# loose SEED: a unit that moves before the check, 6 mm sideways or by 0.3 degrees of tilt; expects FAIL.
loose() {
  local table tilt expected='the camera moved on its mount'
  scene_of "$1" 514.8 525.2 5 0.7
  render
  rm -rf "$work/good"
  cp -r "$work/unit" "$work/good"
  # The ground truth contains the yaws.
  for table in captures truth; do
    awk -F, -v OFS=, -v direction="$1" 'NR == FNR { yaw[$1] = $5; next }
      FNR == 1 { x = $2 == "x_m" ? 2 : 3 }
      FNR > 1 {
        $x -= 0.006 * cos(yaw[$1] + direction)
        $(x + 1) -= 0.006 * sin(yaw[$1] + direction)
      } { print }' "$work/good/check/truth.csv" "$work/good/check/$table.csv" \
      >"$work/unit/check/$table.csv"
  done
  tried loose-sideways "$1" "$expected: in the check, it is displaced by 6.0 mm"
  tilt=$(sed -n 's/.*tilt_deg: \([0-9.]*\)$/\1/p' "$work/scene.yaml")
  scene_change "s/tilt_deg: $tilt\$/tilt_deg: $(awk -v t="$tilt" 'BEGIN { print t + 0.3 }')/"
  render --only check
  mv "$work/unit/check" "$work/tilted"
  unit_again
  rm -r "$work/unit/check"
  mv "$work/tilted" "$work/unit/check"
  tried loose-tilted "$1" "$expected"
}

# optics_of SEED LINE...: makes a unit whose focus, tilt and veil vary as those of good units, with
# these lines in the scene's optics. A line with a defocus replaces the lens's own.
optics_of() {
  local seed=$1 blur veil tilt_x tilt_y line optics
  shift
  scene_of "$seed" 514.8 525.2 5 0.7
  uniform blur 0.66 0.74
  uniform veil 0 0.01
  uniform tilt_x -0.15 0.15
  uniform tilt_y -0.15 0.15
  optics="veil: $veil\\n  defocus: {radius_px: 0, tilt_px: [$tilt_x, $tilt_y]}"
  for line; do
    case $line in
      veil*) optics=${optics/veil: $veil/$line} ;;
      defocus*) optics="veil: $veil\\n  $line" ;;
      *) optics+="\\n  $line" ;;
    esac
  done
  scene_change "s/blur_px: 0.7.*/blur_px: $blur\\n  $optics/"
  render --only boards
}

# Sharpness and cleanliness of the lens, with boards only: a good unit then lacks the rotation.
sharpness() {
  local seed=$1 x y strength
  # A strong smear hides tags of several views, which an operator replaces.
  station_again
  station_change station.yaml 's/board_views: 36/board_views: 24/'
  optics_of "$seed"
  tried good "$seed" 'rotation: not enough images'
  uniform x 150 650
  uniform y 120 480
  for strength in 0.05 0.1 0.25; do
    optics_of "$seed" "veil: $strength"
    tried "veil-$strength" "$seed" 'veiling glare'
  done
  for strength in 0.1 0.2 0.4; do
    optics_of "$seed" "smears: [{at_px: [$x, $y], radius_px: 150, fraction: $strength, sigma_px: 8}]"
    tried "smear-$strength" "$seed" 'the lens is smeared'
  done
  for strength in 0.1 0.2 0.4; do
    optics_of "$seed" "dust: [{at_px: [$x, $y], radius_px: 50, depth: $strength}]"
    tried "dust-$strength" "$seed" 'dust is on the lens'
  done
  for strength in 1.2 1.8 2.4; do
    optics_of "$seed" "defocus: {radius_px: $strength}"
    tried "defocus-$strength" "$seed" 'out of focus'
  done
  for strength in 0.7 1.2 2; do
    optics_of "$seed" "defocus: {radius_px: 0, tilt_px: [$(awk -v s="$strength" -v a="$seed" \
      'BEGIN { printf "%.3f, %.3f", s * cos(a), s * sin(a) }')]}"
    tried "tilt-$strength" "$seed" 'the focal plane is tilted'
  done
}

timing() {
  scene_of "$1" 514.8 525.2 5 0.7
  render
  # A station of its own: the records of the first would refuse the same images.
  rm -rf "$work/second"
  cp -r "$work/station" "$work/second"
  local TIMEFORMAT='%U %S' processor step image arriving=$work/second/captures/timing
  processor=$({ time vlp-station run -q --station "$work/station/station.yaml" \
    --camera-id timing --batch "$work/unit"; } 2>&1)
  mkdir -p "$arriving"/{boards,rotation,dispersion,check}
  cp "$work"/unit/dispersion/captures.csv "$arriving/dispersion/"
  cp "$work"/unit/check/captures.csv "$arriving/check/"
  { time vlp-station run -q --station "$work/second/station.yaml" --camera-id timing \
    --idle-s 60; } 2>"$work/time" &
  local station=$!
  for step in boards rotation dispersion check; do
    for image in "$work/unit/$step"/*.png; do
      cp "$image" "$arriving/$step/.coming"
      # The last image arrives after all others are processed.
      [ "${image##*/unit/}" != check/0035.png ] || sleep 3
      local last_s=$EPOCHREALTIME
      mv "$arriving/$step/.coming" "$arriving/$step/${image##*/}"
      sleep 0.05
    done
  done
  wait "$station" || wrong=$((wrong + 1))
  awk -v seed="$1" -v p="$processor $(cat "$work/time")" -v a="$last_s" -v b="$EPOCHREALTIME" '
    BEGIN { split(p, t, " ")
      printf "timing     %4d   %.2f s of processor time from full folders, ", seed, t[1] + t[2]
      printf "%.2f s as they come, ", t[3] + t[4]
      printf "verdict %.2f s after the last image\n", b - a }'
}

for ((seed = first; seed < first + count; ++seed)); do "$what" "$seed"; done
[ "$what" != good ] || vlp-station capability --station "$work/station/station.yaml"
echo "$what: seeds $first to $((first + count - 1)), $wrong not as they should"
[ "$wrong" = 0 ]
