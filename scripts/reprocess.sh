#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs the chain again over an archive of captures, and says what changed.
#
#   scripts/reprocess.sh ARCHIVE RESULTS [--gates FILE] [--previous RESULTS] [--cores N]
#                        [--profile slurm] [--session-gates FILE] [--row-time-s S]
#                        [--readout rows|columns] [--shard-size N]
#
# ARCHIVE/CAMERA/SESSION/ is laid out as scripts/calibrate.sh has it, and only read. RESULTS gets
#   summary.csv            a row per session: verdict, figures, reason, version, digests, cost
#   overview.html          the same for people, with what changed since --previous
#   changes.json           that comparison for programs, and the gates
#   sessions/, failed/     per session its results, or why there are none, with what each stage said
# What is current is not run again; an interrupted run goes on. A session without a result does not stop
# the others.
#
# --cores N        at a time on this machine (default: all)
# --profile NAME   a profile of scripts/reprocess/profiles or a folder: slurm submits shards to a cluster
# --previous       results of an earlier run to compare with
# --gates          what the archive as a whole has to keep to, vlp-archive-gates/1
# --session-gates  gates of vlp-evaluate for sessions that have no gates.yaml of their own
# --shard-size N   sessions in a job (default 20)
#
# Exit code: 0 done; 1 done, and a gate is not met; 2 bad input; 3 some shards could not be done.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)/reprocess
bin=${VLP_PROGRAMS_DIR:-$(cd "$scripts/../.." && pwd)/build/bin}
python=${VLP_PYTHON:-/usr/bin/python3}  # the one that Debian's snakemake is for

usage() {
  echo "reprocess.sh: error: $1; see reprocess.sh --help" >&2
  exit 2
}
folders=() plan=() how=()
cores=$(nproc)
while [ $# -gt 0 ]; do
  case $1 in
    --gates | --session-gates | --previous | --shard-size | --cores | --profile | --row-time-s | --readout)
      [ $# -gt 1 ] || usage "$1 wants a value" ;;&
    --gates | --session-gates | --previous | --shard-size) plan+=("$1" "$2"); shift ;;
    --row-time-s | --readout) plan+=("--camera-option=$1" "--camera-option=$2"); shift ;;
    --cores) cores=$2; shift ;;
    --profile)
      how=(--profile "$2")
      if [ -d "$scripts/profiles/$2" ]; then how=(--profile "$scripts/profiles/$2"); fi
      shift ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    -*) usage "unknown option $1" ;;
    *) folders+=("${1%/}") ;;
  esac
  shift
done
[ ${#folders[@]} = 2 ] || usage "which ARCHIVE and RESULTS?"
[[ $cores =~ ^[1-9][0-9]*$ ]] || usage "--cores: should be a number from 1"
results=${folders[1]}
"$python" -c 'import snakemake' 2>/dev/null ||
  { echo "reprocess.sh: error: snakemake is missing; run scripts/setup.sh --batch" >&2; exit 2; }
[ ${#how[@]} -gt 0 ] || how=(--cores "$cores")

export PYTHONDONTWRITEBYTECODE=1
case $(realpath -m "$results")/ in
  "$(realpath -m "${folders[0]}")"/*) usage "$results: is in the archive, which is only read" ;;
esac
[ -d "${folders[0]}" ] || usage "${folders[0]}: is not a folder"
mkdir -p "$results/.state"
exec 9>"$results/.state/lock"
flock --nonblock 9 || usage "$results: another run is at work there"
"$python" "$scripts/plan.py" "${folders[@]}" --bin "$bin" "${plan[@]}"
log=$results/.state/reprocess.log
mapfile -t again <"$results/.state/again.txt"
[ ${#again[@]} = 0 ] || how+=(--forcerun "${again[@]}")
# A run that was killed leaves Snakemake's own lock, which the one above stands for.
if ! "$python" -m snakemake --snakefile "$scripts/Snakefile" --directory "$results" --nolock \
  --rerun-incomplete --rerun-triggers mtime --keep-going --scheduler greedy "${how[@]}" \
  >"$log" 2>&1 9>&-
then
  grep -E '^Error|Error in rule|    log:' "$log" >&2 || tail -n 20 "$log" >&2
  echo "reprocess.sh: error: some shards could not be done; see $log; the same command goes on" >&2
  exit 3
fi
exec "$python" "$scripts/verdict.py" "$results"
