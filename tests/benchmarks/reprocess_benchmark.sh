#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Measures the cost of scripts/reprocess.sh on this machine, compared with its programs alone. Requires
# an idle machine; the steps can be run separately.
#
#   reprocess_benchmark.sh FOLDER [archive] [hand] [half] [all] [verdict]    default: all steps
#
# archive  renders 200 sessions of datasets/archive (or SESSIONS=N), once
# hand     runs the programs alone over the first half, one session per core at a time
# half     runs reprocess.sh over the same half
# all      runs reprocess.sh over all sessions
# verdict  exit code 1 if a limit is exceeded
set -euo pipefail
source_dir=$(cd "$(dirname "$0")/../.." && pwd)
bin=${VLP_PROGRAMS_DIR:-$source_dir/build/bin}
folder=$(realpath -m "${1:?which FOLDER?}")
sessions=${SESSIONS:-200} cores=$(nproc)
/usr/bin/python3 -c 'import snakemake' 2>/dev/null || { echo "snakemake is missing: scripts/setup.sh --batch"; exit 77; }
mkdir -p "$folder/measured"
export bin folder

archive() {
  "$bin/vlp-simulate" --quiet "$source_dir/datasets/archive/scene.yaml" --archive "$sessions" -o "$folder/all"
  rm -rf "$folder/half"
  mkdir "$folder/half"
  # Two sessions per camera.
  find "$folder/all" -mindepth 1 -maxdepth 1 -name 'camera-*' | sort | head -n $((sessions / 4)) |
    xargs ln -s --target-directory="$folder/half"
}

busy_s() {  # processor time of the whole machine since it started
  awk -v hz="$(getconf CLK_TCK)" '/^cpu / { print ($2 + $3 + $4 + $7 + $8) / hz }' /proc/stat
}

# Measures time, processor time, the maximum memory of all processes in MB, and the processor time of other programs.
measured() {  # NAME COMMAND...
  local name=$1 largest=0 now TIMEFORMAT='%R %U %S' run before
  shift
  before=$(busy_s)
  { # In its own session, which identifies its processes.
    time setsid --wait bash -c 'echo $$ >"$0"; exec "$@"' "$folder/measured/$name.session" "$@" \
      >"$folder/measured/$name.said" 2>&1
  } 2>"$folder/measured/$name.time" &
  run=$!
  trap "kill -- -\$(cat '$folder/measured/$name.session') 2>/dev/null" EXIT
  while sleep 0.5 && kill -0 $run 2>/dev/null; do
    now=$(ps -o rss= --sid "$(cat "$folder/measured/$name.session")" | awk '{ sum += $1 } END { print int(sum / 1024) }') || continue  # it has just ended
    [ "$now" -le "$largest" ] || largest=$now
  done
  wait $run
  trap - EXIT
  read -r wall user system <"$folder/measured/$name.time"
  echo "$wall $user $system $largest $before $(busy_s)" >"$folder/measured/$name"
  awk -v name="$name" -v cores="$cores" '{
    printf "%-6s %.1f s, %.1f s of processor time: %.1f %% of the cores; %d MB; others %.1f %%\n", name, $1,
      $2 + $3, 100 * ($2 + $3) / $1 / cores, $4, 100 * ($6 - $5 - $2 - $3) / $1 / cores }' "$folder/measured/$name"
}

by_hand() {  # SESSION
  local station=$1 work
  work=$folder/hand/$(basename "$(dirname "$station")")/$(basename "$station")
  mkdir -p "$work"
  cd "$work"
  {
    vlp-intrinsics "$station/boards" --board "$station/board.yaml" --row-time-s 3e-5 --readout rows \
      --threads 1 -o lens.yaml &&
      vlp-rotation "$station/rotation" --lamps "$station/lamps.yaml" --calibration lens.yaml \
        --threads 1 -o rotated.yaml &&
      vlp-dispersion "$station/dispersion" --lamps "$station/lamps.yaml" --calibration rotated.yaml \
        --threads 1 -o calibration.yaml &&
      vlp-locate "$station/check" --lamps "$station/lamps.yaml" --calibration calibration.yaml \
        --threads 1 -o fixes.csv &&
      vlp-evaluate fixes.csv --truth "$station/check/truth.csv" --threads 1 --json evaluation.json
  } >said.txt 2>&1 || true  # some sessions are damaged
}
export -f by_hand
all_by_hand() {
  PATH=$bin:$PATH
  find -L "$folder/half" -mindepth 2 -maxdepth 2 -type d | sort |
    xargs --max-procs="$1" --max-args=1 bash -c 'by_hand "$0"'
}
export -f all_by_hand

hand() {
  rm -rf "$folder/hand"
  measured hand bash -c "all_by_hand $cores"
}
reprocess() {  # half OR all
  rm -rf "$folder/$1-results"
  printf 'format: vlp-archive-gates/1\ngates: {gate_fraction: 1, suspect: 200}\n' >"$folder/gates.yaml"  # some lenses fail their gates
  measured "$1" "$source_dir/scripts/reprocess.sh" "$folder/$1" "$folder/$1-results" --row-time-s 3e-5 \
    --readout rows --gates "$folder/gates.yaml"
}

verdict() {
  cd "$folder/measured"
  awk -v cores="$cores" '
    { wall[FILENAME] = $1; cpu[FILENAME] = $2 + $3; mb[FILENAME] = $4 }
    function ask(what, value, least, most) {
      kept = value >= least && value <= most
      printf "%-58s %8.2f  %s\n", what, value, kept ? "kept" : "NOT KEPT"
      if (!kept) missed = 1
    }
    END {
      ask("share of the cores (0.9 or more)", cpu["all"] / wall["all"] / cores, 0.9, 1.01)
      ask("GiB of memory (below 2)", mb["all"] / 1024, 0, 2)
      ask("all beside half, seconds (1.8 to 2.2 times)", wall["all"] / wall["half"], 1.8, 2.2)
      ask("beside the programs by hand, processor time (to 1.15 times)", cpu["half"] / cpu["hand"], 0, 1.15)
      ask("beside the programs by hand, seconds (to 1.15 times)", wall["half"] / wall["hand"], 0, 1.15)
      exit missed
    }' hand half all
}

steps=("${@:2}")
[ ${#steps[@]} -gt 0 ] || steps=(archive hand half all verdict)
for step in "${steps[@]}"; do
  case $step in
    half | all) reprocess "$step" ;;
    archive | hand | verdict) "$step" ;;
    *) echo "reprocess_benchmark.sh: unknown step $step" >&2; exit 2 ;;
  esac
done
