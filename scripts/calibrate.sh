#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Calibrates one camera from a folder of its captures, checks it, and writes a report.
#
#   scripts/calibrate.sh STATION_DIR [-o RESULTS_DIR] [--camera-id ID] [--row-time-s S]
#                        [--readout rows|columns]
#
# What is in STATION_DIR is only read:
#   lamps.yaml                  the lamps, with their frequencies
#   boards/, board.yaml         images of the board, and what it is; or camera.yaml, when the camera
#                               part of the calibration is there already
#   rotation/                   captures while the camera turns on the spot
#   dispersion/                 at a known station, turning; captures.csv says where (optional)
#   check/                      to locate; with truth.csv, or places in captures.csv, also the errors
#                               (optional)
#   line-*/                     along a straight line each, with truth.csv (optional, for the report)
#   gates.yaml                  what the errors have to keep to (optional)
#
# Results (default STATION_DIR/results): calibration.yaml, fixes.csv, evaluation.json, report.html,
# and what each stage wrote and said. A row time that is not given is found from the rotation
# captures. A stage whose inputs, options and program are as before is not run again.
#
# Exit code: 0 done; 1 done, and a gate is not met; 2 bad input; 3 the captures do not determine it.
set -euo pipefail
bin=${VLP_PROGRAMS_DIR:-$(cd "$(dirname "$0")/.." && pwd)/build/bin}

usage() {
  echo "calibrate.sh: $1; usage: calibrate.sh STATION_DIR [-o RESULTS_DIR] [--camera-id ID]" \
    "[--row-time-s S] [--readout rows|columns]" >&2
  exit 2
}
station='' results='' row_time='' camera=()
while [ $# -gt 0 ]; do
  case $1 in
    -o | --output | --camera-id | --row-time-s | --readout)
      [ $# -gt 1 ] || usage "$1 wants a value" ;;&
    -o | --output) results=$2; shift ;;
    --camera-id | --readout) camera+=("$1" "$2"); shift ;;
    --row-time-s) row_time=$2; camera+=("$1" "$2"); shift ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    -*) usage "unknown option $1" ;;
    *) [ -z "$station" ] || usage "one station at a time, not also $1"; station=${1%/} ;;
  esac
  shift
done
[ -n "$station" ] || usage "which STATION_DIR?"
results=${results:-$station/results}

need() {  # NAME...: that which is missing ends it
  for name; do
    [ -e "$station/$name" ] || { echo "$station/$name: missing" >&2; exit 2; }
  done
}
need lamps.yaml rotation
[ -e "$station/camera.yaml" ] || need board.yaml boards
[ -x "$bin/vlp-evaluate" ] || { echo "$bin: no programs; run scripts/test.sh first" >&2; exit 2; }
mkdir -p "$results/stages"
verdict=0

digest_of() {  # FILE OR FOLDER...: of names and contents
  for input; do
    if [ -d "$input" ]; then
      (cd "$input" && find . -type f -print0 | sort -z | xargs -0 --no-run-if-empty sha256sum)
    else
      sha256sum "$input"
    fi
  done
}

# Runs a program on inputs, options that begin with -- left as they are, unless all is as it was
# when it last ended well. What it says goes to stages/NAME.txt.
stage() {  # NAME INPUT... -- OUTPUT PROGRAM ARGUMENT...
  local name=$1 inputs=() code=0 key
  shift
  while [ "$1" != -- ]; do inputs+=("$1"); shift; done
  local output=$results/$2 program=$3 log=$results/stages/$name.txt
  shift 3
  key=$( { digest_of "$bin/$program" "${inputs[@]}"; printf '%s\n' "$@"; } | sha256sum)
  if [ -e "$output" ] && [ -e "$log.key" ] && [ "$(head -n 1 "$log.key")" = "$key" ]; then
    code=$(tail -n 1 "$log.key")
    printf '%-11s as before%s\n' "$name" "$([ "$code" = 0 ] || echo ', a gate is not met')"
  else
    rm -f "$log.key"
    local begin_us=${EPOCHREALTIME//[!0-9]/}
    "$bin/$program" "$@" >"$log" 2>"$log.messages" || code=$?
    cat "$log.messages" >>"$log"
    if [ "$code" -gt 1 ]; then
      cat "$log.messages" >&2
      rm "$log.messages"
      echo "calibrate.sh: $name ended with exit code $code; see $log" >&2
      exit "$code"
    fi
    local tenths=$(((${EPOCHREALTIME//[!0-9]/} - begin_us + 50000) / 100000))
    printf '%-11s %3d.%d s%s\n' "$name" $((tenths / 10)) $((tenths % 10)) \
      "$([ "$code" = 0 ] || echo ', a gate is not met:')"
    sed '/: info: /d; s/^/            /' "$log.messages"
    rm "$log.messages"
    printf '%s\n%s\n' "$key" "$code" >"$log.key"
  fi
  [ "$code" = 0 ] || verdict=$code
}

lamps=$station/lamps.yaml
if [ -e "$station/camera.yaml" ]; then
  cp "$station/camera.yaml" "$results/lens.yaml"
else
  stage intrinsics "$station/boards" "$station/board.yaml" -- lens.yaml vlp-intrinsics \
    "$station/boards" --board "$station/board.yaml" "${camera[@]}" --cache "$results/stages/corners" \
    --plot "$results/camera.svg" -o "$results/lens.yaml"
fi
if grep -q '^  row_time_s:' "$results/lens.yaml"; then
  cp "$results/lens.yaml" "$results/camera.yaml"
else
  stage row-time "$station/rotation" "$lamps" "$results/lens.yaml" -- camera.yaml vlp-train \
    "$station/rotation" --row-time --lamps "$lamps" --calibration "$results/lens.yaml" \
    -o "$results/camera.yaml"
fi
stage rotation "$station/rotation" "$lamps" "$results/camera.yaml" -- rotated.yaml vlp-rotation \
  "$station/rotation" --lamps "$lamps" --calibration "$results/camera.yaml" \
  --plot "$results/rotation.svg" -o "$results/rotated.yaml"
if [ -e "$station/dispersion" ]; then
  stage dispersion "$station/dispersion" "$lamps" "$results/rotated.yaml" -- calibration.yaml \
    vlp-dispersion "$station/dispersion" --lamps "$lamps" --calibration "$results/rotated.yaml" \
    --plot "$results/dispersion.svg" -o "$results/calibration.yaml"
else
  cp "$results/rotated.yaml" "$results/calibration.yaml"
fi

calibration=$results/calibration.yaml
locate() {  # FOLDER: to FOLDER-fixes.csv
  local fixes=$1-fixes.csv
  stage "locate-$1" "$station/$1" "$lamps" "$calibration" -- "$fixes" vlp-locate "$station/$1" \
    --lamps "$lamps" --calibration "$calibration" -o "$results/$fixes"
}
[ ! -e "$station/check" ] || locate check

# Errors, where the truth is known, and the report with all pictures that there are.
truth=$station/check/truth.csv
if [ ! -e "$truth" ] && head -n 1 "$station/check/captures.csv" 2>/dev/null | grep -q x_m; then
  truth=$station/check/captures.csv
fi
if [ -e "$truth" ]; then
  fixes=$results/check-fixes.csv
  inputs=("$fixes" "$truth" "$lamps" "$calibration")
  report=()
  for picture in camera rotation dispersion; do
    [ ! -e "$results/$picture.svg" ] || report+=(--picture "$results/$picture.svg")
  done
  for line in "$station"/line-*/; do
    [ -e "$line/truth.csv" ] || continue
    line=$(basename "$line")
    locate "$line"
    read -ra ends_m < <(awk -F, 'NR == 2 { print $2, $3 } END { print $2, $3 }' \
      "$station/$line/truth.csv" | paste -sd ' ')
    inputs+=("$results/$line-fixes.csv")
    report+=(--track "$results/$line-fixes.csv" "${ends_m[@]}")
  done
  if [ -e "$station/gates.yaml" ]; then
    inputs+=("$station/gates.yaml")
    report+=(--gates "$station/gates.yaml" --junit "$results/gates.xml")
  fi
  stage evaluate "${inputs[@]}" -- report.html vlp-evaluate "$fixes" --truth "$truth" \
    --lamps "$lamps" --calibration "$calibration" --json "$results/evaluation.json" \
    --report "$results/report.html" "${report[@]}"
  echo
  cat "$results/stages/evaluate.txt"
fi
exit "$verdict"
