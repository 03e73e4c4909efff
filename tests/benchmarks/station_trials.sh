#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Units for the station of datasets/station, each with a lens, a mount and noise of its own: whether
# good ones pass, and faulty ones fail with the cause named first. In the project's folder, built:
#   tests/benchmarks/station_trials.sh good [COUNT [FIRST_SEED]]     by default 50 units, from seed 1
#   tests/benchmarks/station_trials.sh faulty [COUNT [FIRST_SEED]]   5 of each kind
#   tests/benchmarks/station_trials.sh timing [COUNT [FIRST_SEED]]   1 unit
# A line for each; exit code 1 when one did not end as it should. A good unit takes 9 s of processor
# time, six faulty ones 30 s. timing: the processor time, pictures included, and how long the verdict
# takes after the last image, others coming every 50 ms before.
set -euo pipefail
cd "$(dirname "$0")/../.."
PATH=$PWD/build/bin:$PATH
what=${1:-good} count=${2:-} first=${3:-1}
declare -A counts=([good]=50 [faulty]=5 [timing]=1)
[ -n "${counts[$what]:-}" ] || { sed -n '5,14s/^# \?//p' "$0"; exit 2; }
count=${count:-${counts[$what]}}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -rT datasets/station "$work/station"
wrong=0

# uniform VARIABLE FROM TO: a number that the seed decides.
uniform() {
  state=$(((state * 1103515245 + 12345) % 2147483648))
  printf -v "$1" '%s' "$(awk -v s="$state" -v a="$2" -v b="$3" \
    'BEGIN { printf "%.6g", a + (b - a) * s / 2147483648 }')"
}

# scene_of SEED FOCAL_FROM FOCAL_TO CENTRE_OFF_PX BLUR_PX: a unit with its lens in this range, up to
# one degree of tilt and 5 mm beside the axis.
scene_of() {
  state=$(($1 * 7919))
  local fx ratio direction tilt azimuth arm_x arm_y
  uniform fx "$2" "$3"  # the first numbers of seeds side by side are alike
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

# tried KIND SEED EXPECTED: runs the unit; the verdict's line should hold the text.
tried() {
  local said
  said=$(vlp-station run --station "$work/station/station.yaml" --camera-id "$1-$2" \
    --batch "$work/unit" 2>&1 >"$work/screen" | grep -v ': info: ' || true)
  [ -n "$said" ] || said=$(grep -o '^PASS' "$work/screen" || true)
  local end=''
  if [[ $said != *"$3"* ]]; then
    wrong=$((wrong + 1)) end='   NOT AS IT SHOULD'
  fi
  printf '%-10s %4d   %s%s\n' "$1" "$2" "${said#*camera*: }" "$end"
}

good() {
  scene_of "$1" 514.8 525.2 5 0.7
  render
  tried good "$1" PASS
}

faulty() {
  scene_of "$1" 514.8 525.2 $((14 + $1 % 16)) 0.7
  render --only boards
  tried decentred "$1" 'the lens is decentred'
  scene_of "$1" 514.8 525.2 5 2.$((2 + $1 % 8))
  render --only boards
  tried blurred "$1" 'the lens is blurred'
  if [ $(($1 % 2)) = 0 ]; then scene_of "$1" 460 500 5 0.7; else scene_of "$1" 540 580 5 0.7; fi
  render --only boards
  tried wrong "$1" 'wrong lens'

  scene_of "$1" 514.8 525.2 5 0.7
  render
  local lamps=$work/station/lamps.yaml lamp=$((1 + $1 % 6)) other=$((1 + ($1 + 1 + $1 % 5) % 6))
  # The lamp is where the scene has it, and is 2 to 6 cm off in the map.
  awk -v id="$lamp" -v off=0.0$((2 + $1 % 5)) -F'[][]' '$0 ~ "id: " id "," {
    split($2, at, ", "); $0 = $1 "[" at[1] + off ", " at[2] - off / 2 ", " at[3] "]" $3 } { print }' \
    datasets/station/lamps.yaml >"$lamps"
  tried loose "$1" "lamp $lamp is loose"
  cp datasets/station/lamps.yaml "$lamps"
  local first_hz second_hz
  first_hz=$(sed -n "s/.*id: $lamp,.*frequency_hz: \([0-9]*\).*/\1/p" "$lamps")
  second_hz=$(sed -n "s/.*id: $other,.*frequency_hz: \([0-9]*\).*/\1/p" "$lamps")
  sed -i -e "/id: $lamp,/s/$first_hz/$second_hz/" -e "/id: $other,/s/$second_hz/$first_hz/" "$lamps"
  [ "$lamp" -lt "$other" ] || { local swap=$lamp; lamp=$other other=$swap; }
  tried swapped "$1" "lamps $lamp and $other"
  cp datasets/station/lamps.yaml "$lamps"
  sed -i 's/first_id: 0/first_id: 30/' "$work/station/board.yaml"
  tried board "$1" 'wrong board'
  cp datasets/station/board.yaml "$work/station/board.yaml"
}

timing() {
  scene_of "$1" 514.8 525.2 5 0.7
  render
  local TIMEFORMAT='%U %S' processor step image arriving=$work/station/captures/timing
  processor=$({ time vlp-station run -q --station "$work/station/station.yaml" \
    --camera-id timing --batch "$work/unit"; } 2>&1)
  mkdir -p "$arriving"/{boards,rotation,dispersion,check}
  cp "$work"/unit/dispersion/captures.csv "$arriving/dispersion/"
  cp "$work"/unit/check/captures.csv "$arriving/check/"
  { time vlp-station run -q --station "$work/station/station.yaml" --camera-id timing \
    --idle-s 60; } 2>"$work/time" &
  local station=$!
  for step in boards rotation dispersion check; do
    for image in "$work/unit/$step"/*.png; do
      cp "$image" "$arriving/$step/.coming"
      # The last one comes when all others are done with.
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
echo "$what: seeds $first to $((first + count - 1)), $wrong not as they should"
[ "$wrong" = 0 ]
