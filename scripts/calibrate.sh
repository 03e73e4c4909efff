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
#                               and the report (optional)
#   line-*/                     along a straight line each, with truth.csv (optional, for the report)
#   gates.yaml                  what the errors have to keep to (optional)
#
# Results (default STATION_DIR/results): calibration.yaml, check-fixes.csv, evaluation.json,
# report.html, and what each stage wrote and said. A row time that is not given is found from the
# rotation captures. A stage whose inputs, options, program and outputs are as before is not run
# again; what this run does not make, or cannot, is removed.
#
# Exit code: 0 done; 1 done, and a gate is not met; 2 bad input; 3 the captures do not determine it.
set -euo pipefail
bin=${VLP_PROGRAMS_DIR:-$(cd "$(dirname "$0")/.." && pwd)/build/bin}

refuse() {
  echo "calibrate.sh: $1" >&2
  exit 2
}
station='' results='' camera=()
while [ $# -gt 0 ]; do
  case $1 in
    -o | --output | --camera-id | --row-time-s | --readout)
      [ $# -gt 1 ] || refuse "$1 wants a value; see calibrate.sh --help" ;;&
    -o | --output) results=$2; shift ;;
    --camera-id | --readout | --row-time-s) camera+=("$1" "$2"); shift ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    -*) refuse "unknown option $1; see calibrate.sh --help" ;;
    *) [ -z "$station" ] || refuse "one station at a time, not also $1"; station=${1%/} ;;
  esac
  shift
done
[ -n "$station" ] || refuse "which STATION_DIR? See calibrate.sh --help"
results=${results:-$station/results}

need() {  # NAME...: that which is missing ends it
  for name; do
    [ -e "$station/$name" ] || refuse "$station/$name: missing; see calibrate.sh --help"
  done
}
need lamps.yaml rotation
if [ -e "$station/camera.yaml" ]; then
  [ ${#camera[@]} = 0 ] || refuse "${camera[0]}: $station/camera.yaml says what the camera is"
else
  need board.yaml boards
fi
for program in intrinsics train rotation dispersion locate evaluate; do
  [ -x "$bin/vlp-$program" ] || refuse "$bin/vlp-$program: missing; run scripts/test.sh first"
done
for folder in "$station" "$station"/{boards,rotation,dispersion,check}; do
  [ ! "$results" -ef "$folder" ] || refuse "$results: results go to a folder of their own"
done
mkdir -p "$results/stages" || refuse "$results: cannot be written to"
verdict=0 unmet=()
final=("$results"/{calibration.yaml,evaluation.json,gates.xml,report.html})

digest_of() {  # FILE OR FOLDER...: of names and contents
  for input; do
    if [ -d "$input" ]; then
      (cd "$input" && find -L . -type f -print0 | sort -z | xargs -0 --no-run-if-empty sha256sum)
    else
      sha256sum <"$input"
    fi
  done
}

# Runs a program on inputs, unless these, its arguments, the program and its outputs are as they were
# when it last ended. What it says goes to stages/NAME.txt.
stage() {  # NAME INPUT... -- OUTPUT... -- PROGRAM ARGUMENT...
  local name=$1 inputs=() outputs=() code=0 state key
  shift
  while [ "$1" != -- ]; do inputs+=("$1"); shift; done
  shift
  while [ "$1" != -- ]; do outputs+=("$results/$1"); shift; done
  local program=$2 log=$results/stages/$name.txt
  shift 2
  key=$( { digest_of "$bin/$program" "${inputs[@]}"; printf '%s\n' "$@"; } | sha256sum)
  if [ -e "$log.key" ] && [ "$(sed -n 1p "$log.key")" = "$key" ] &&
    [ "$(sed -n 2p "$log.key")" = "$(digest_of "${outputs[@]}" 2>/dev/null | sha256sum)" ]
  then
    code=$(sed -n 3p "$log.key") state='as before'
  else
    rm -f "$log.key" "${outputs[@]}"
    local begin_us=${EPOCHREALTIME//[!0-9]/}
    "$bin/$program" "$@" >"$log" 2>"$log.messages" || code=$?
    if [ "$code" -gt 1 ]; then
      cat "$log.messages" >&2
      rm -f "$log.messages" "${final[@]}"
      echo "calibrate.sh: $name ended with exit code $code" >&2
      exit "$code"
    fi
    sed -i '/: info: /d' "$log.messages"
    local tenths=$(((${EPOCHREALTIME//[!0-9]/} - begin_us + 50000) / 100000))
    state=$(printf '%3d.%d s' $((tenths / 10)) $((tenths % 10)))
    printf '%s\n%s\n%s\n' "$key" "$(digest_of "${outputs[@]}" | sha256sum)" "$code" >"$log.key"
  fi
  printf '%-13s %s%s\n' "$name" "$state" "$([ "$code" = 0 ] || echo ', a gate is not met')"
  sed 's/^/              /' "$log.messages"
  if [ "$code" = 1 ]; then
    verdict=1
    unmet+=(--unmet "$name: $(sed -n 's/^.*: error: //p' "$log.messages" | paste -sd ' ')")
  fi
}

# From here on the results are of this run.
lamps=$station/lamps.yaml pictures=()
if [ -e "$station/camera.yaml" ]; then
  rm -f "$results"/{lens,camera}.* "$results"/stages/{intrinsics,row-time}.*
  lens=$station/camera.yaml
else
  lens=$results/lens.yaml
  stage intrinsics "$station/boards" "$station/board.yaml" -- lens.yaml lens.svg -- vlp-intrinsics \
    "$station/boards" --board "$station/board.yaml" "${camera[@]}" \
    --cache "$results/stages/corners" --plot "$results/lens.svg" -o "$lens"
  pictures+=(--picture "$results/lens.svg")
fi
if grep -q 'row_time_s:' "$lens"; then
  rm -f "$results"/camera.yaml "$results"/stages/row-time.*
else
  stage row-time "$station/rotation" "$lamps" "$lens" -- camera.yaml -- vlp-train \
    "$station/rotation" --row-time --lamps "$lamps" --calibration "$lens" -o "$results/camera.yaml"
  lens=$results/camera.yaml
fi
stage rotation "$station/rotation" "$lamps" "$lens" -- rotated.yaml rotation.svg -- \
  vlp-rotation "$station/rotation" --lamps "$lamps" --calibration "$lens" \
  --plot "$results/rotation.svg" -o "$results/rotated.yaml"
pictures+=(--picture "$results/rotation.svg")
calibration=$results/calibration.yaml
if [ -e "$station/dispersion" ]; then
  stage dispersion "$station/dispersion" "$lamps" "$results/rotated.yaml" -- \
    calibration.yaml dispersion.svg -- vlp-dispersion "$station/dispersion" --lamps "$lamps" \
    --calibration "$results/rotated.yaml" --plot "$results/dispersion.svg" -o "$calibration"
  pictures+=(--picture "$results/dispersion.svg")
else
  rm -f "$results/dispersion.svg" "$results"/stages/dispersion.*
  cp "$results/rotated.yaml" "$calibration" || refuse "$calibration: cannot be written"
fi
final=("$results"/{evaluation.json,gates.xml,report.html})  # what follows does not change the camera

locate() {  # FOLDER: to FOLDER-fixes.csv
  local fixes=$1-fixes.csv
  stage "$1" "$station/$1" "$lamps" "$calibration" -- "$fixes" -- vlp-locate "$station/$1" \
    --lamps "$lamps" --calibration "$calibration" -o "$results/$fixes"
}
if [ -e "$station/check" ]; then locate check; else rm -f "$results"/check-fixes.csv; fi

# Errors, where the truth is known, and the report with all pictures that there are.
truth=$station/check/truth.csv
if [ ! -e "$truth" ] && head -n 1 "$station/check/captures.csv" 2>/dev/null | grep -q x_m; then
  truth=$station/check/captures.csv
fi
if [ ! -e "$truth" ]; then
  rm -f "${final[@]}"
  echo "No errors and no report: $station/check has no truth.csv"
  exit "$verdict"
fi
fixes=$results/check-fixes.csv
inputs=("$fixes" "$truth" "$lamps" "$calibration")
report=("${pictures[@]}")
for ((i = 1; i < ${#pictures[@]}; i += 2)); do inputs+=("${pictures[i]}"); done

ends_of() {  # TRUTH: x and y where a line begins, and where it ends
  awk -F, '{ sub(/\r$/, "") }
           NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
           NF > 1 { x = $column["x_m"]; y = $column["y_m"]; if (!any++) printf "%s %s ", x, y }
           END { print x, y }' "$1"
}
for line in "$station"/line-*/; do
  line=$(basename "$line")
  [ -e "$station/$line/truth.csv" ] || continue
  locate "$line"
  read -ra ends_m <<<"$(ends_of "$station/$line/truth.csv")"
  if [[ ! ${ends_m[*]} =~ ^([-+.eE0-9]+( |$)){4}$ ]]; then
    rm -f "${final[@]}"
    refuse "$station/$line/truth.csv: its x_m and y_m are no plain numbers"
  fi
  inputs+=("$results/$line-fixes.csv")
  report+=(--track "$results/$line-fixes.csv" "${ends_m[@]}")
done
outputs=(report.html evaluation.json)
if [ -e "$station/gates.yaml" ]; then
  outputs+=(gates.xml)
  inputs+=("$station/gates.yaml")
  report+=(--gates "$station/gates.yaml" --junit "$results/gates.xml")
else
  rm -f "$results/gates.xml"
fi
stage evaluate "${inputs[@]}" -- "${outputs[@]}" -- vlp-evaluate "$fixes" --truth "$truth" \
  --lamps "$lamps" --calibration "$calibration" --json "$results/evaluation.json" \
  --report "$results/report.html" "${report[@]}" "${unmet[@]}"
echo
cat "$results/stages/evaluate.txt"
exit "$verdict"
