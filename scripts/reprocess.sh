#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs vlp-calibrate on all sessions of an archive and compares the results with
# earlier ones.
#
#   scripts/reprocess.sh ARCHIVE RESULTS [--gates FILE] [--previous RESULTS]
#                        [--cores N] [--profile slurm] [--session-gates FILE]
#                        [--row-time-s S] [--readout rows|columns]
#                        [--shard-size N] [--keep N] [--scan files|folders]
#                        [--rebuild-catalogue]
#   scripts/reprocess.sh --diff RESULTS CAMERA/SESSION [KEY | OTHER_RESULTS]
#
# The folders ARCHIVE/CAMERA/SESSION/ have the contents that vlp-calibrate --help
# lists. They are not modified. RESULTS contains:
#   summary.csv            one row per session: verdict, metrics, remarks, reason,
#                          version, processor time
#   fleet.csv, lamps.csv   calibrated parameters and lamp offsets per session
#   overview.html          report of the run and of changes since --previous
#   changes.json           the same in machine-readable form, with the gates
#   sessions/, failed/     results of each session; session.json has the reason
#                          if there is no result
# Results that are up to date are not computed again. After an interruption the
# same command continues. A session without a result does not stop the others.
#
# --cores N        number of shards that run in parallel on this machine
#                  (default: number of cores plus one)
# --profile NAME   profile of scripts/reprocess/profiles, or a folder; slurm
#                  submits shards to a cluster
# --previous       results of an earlier run to compare with
# --gates          file of gates for the whole archive, vlp-archive-gates/1
# --session-gates  file of gates, vlp-gates/1, for sessions without gates.yaml;
#                  a change of this file requires no new calibration
# --row-time-s     row time: time between the readout of successive rows, in s
#                  (default: estimated)
# --readout        readout direction, rows or columns (default: estimated)
# --shard-size N   maximum number of sessions per job (default: 50)
# --keep N         number of former results of each session to keep in former/
#                  (default: 1)
# --scan           detection of changed sessions. files: checks all files.
#                  folders: checks folders, tables and YAML files; it does not
#                  detect an image that is overwritten in place. Default: files;
#                  for more than 10,000 sessions folders, and files once a week
# --rebuild-catalogue  discard the catalogue and compute all digests again
# --diff           print differences between the result of a session and a former
#                  one, given by the first characters of its key (default: the
#                  last), or the result in OTHER_RESULTS
#
# Exit code: 0 done; 1 done, but a gate of the archive is not met, or a gate of
# a session if the archive has no gate_fraction. Default gates: vanished: 0, no
# session of RESULTS or --previous is missing in ARCHIVE; suspect: 0, none is
# implausible, such as a copy, or with boards of another camera, and no entry of
# ARCHIVE is something else. archive.csv can state the expected files.
# 2 invalid input; 3 incomplete: the run could not finish, no session has a
# result, or more sessions have none than no_result or no_result_fraction of
# --gates allow.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)/reprocess
bin=${VLP_PROGRAMS_DIR:-}
if [ -z "$bin" ]; then  # programs of the build of this source tree, or else the installed ones
  bin=$(cd "$scripts/../.." && pwd)/build/bin
  [ -x "$bin/vlp-calibrate" ] || bin=$(dirname "$(command -v vlp-calibrate || echo "$bin/vlp-calibrate")")
fi
python=${VLP_PYTHON:-/usr/bin/python3}  # default: the interpreter of Debian's snakemake

refuse() {
  echo "reprocess.sh: error: $1" >&2
  exit 2
}
usage() { refuse "$1; see reprocess.sh --help"; }
if [ "${1:-}" = --diff ]; then
  shift
  PYTHONDONTWRITEBYTECODE=1 exec "$python" "$scripts/diff.py" "$@"
fi
folders=() plan=() profile=''
cores=$(($(nproc) + 1))
while [ $# -gt 0 ]; do
  case $1 in
    --gates | --session-gates | --previous | --shard-size | --keep | --scan | --cores | --profile | --row-time-s | --readout)
      [ $# -gt 1 ] || usage "$1 needs a value"
      case $1 in
        --cores | --shard-size) [[ $2 =~ ^[1-9][0-9]*$ ]] || usage "$1: should be a number from 1" ;;
        --keep) [[ $2 =~ ^[0-9]+$ ]] || usage "$1: should be a number" ;;
        --scan) [[ $2 =~ ^(files|folders)$ ]] || usage "$1: should be files or folders" ;;
        --row-time-s) [[ $2 =~ ^[0-9.]+(e-?[0-9]+)?$ ]] || usage "$1: should be seconds" ;;
        --readout) [[ $2 =~ ^(rows|columns)$ ]] || usage "$1: should be rows or columns" ;;
      esac ;;&
    --gates | --session-gates | --previous | --shard-size | --keep | --scan) plan+=("$1" "$2"); shift ;;
    --row-time-s | --readout) plan+=("--camera-option=$1" "--camera-option=$2"); shift ;;
    --rebuild-catalogue) plan+=("$1") ;;
    --cores) cores=$2; shift ;;
    --profile)
      if [ -d "$scripts/profiles/$2" ]; then profile=$scripts/profiles/$2; else profile=$2; fi
      [ -e "$profile/config.yaml" ] || usage "--profile $2: no such profile, nor a folder with config.yaml"
      shift ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    -*) usage "unknown option $1" ;;
    *) folders+=("${1%/}") ;;
  esac
  shift
done
[ ${#folders[@]} = 2 ] || usage "ARCHIVE and RESULTS are missing, or there are additional arguments"
results=${folders[1]}
snakemake=$("$python" -c 'from importlib.metadata import version; print(version("snakemake"))' 2>/dev/null) ||
  refuse "snakemake is missing; scripts/setup.sh --batch or apt install snakemake installs it"
if [[ $profile == "$scripts/profiles/slurm" && $snakemake != 7.* ]] &&
  ! "$python" -c 'import snakemake_executor_plugin_slurm' 2>/dev/null; then
  refuse "Snakemake $snakemake needs snakemake-executor-plugin-slurm, which is missing: install it with pip"
fi
if [ -n "$profile" ]; then
  how=(--profile "$profile")
else
  how=(--cores "$cores") plan+=(--at-a-time "$cores")
fi

export PYTHONDONTWRITEBYTECODE=1
case $(realpath -m "$results")/ in
  "$(realpath -m "${folders[0]}")"/*) usage "$results: is in the archive, which must not be modified" ;;
esac
[ -d "${folders[0]}" ] || usage "${folders[0]}: is not a folder"
# A .state of another program is never changed or deleted: that of this script has the file "owner" and, after planning,
# run.json. A run that was killed at its start leaves it empty, or only with the lock.
state=$results/.state made=''
for file in "$state/lock" "$state/owner"; do
  [ ! -L "$file" ] || refuse "$file: is a symbolic link, which is not followed: remove it"
done
case $(ls -A "$state" 2>/dev/null) in
  '' | lock) made=1 ;;
  *)
    [ -e "$state/owner" ] || grep -qs '^ "archive": ' "$state/run.json" ||
      refuse "$results: contains a .state that is not of reprocess.sh; give the results a folder of their own"
    ;;
esac
# [FILE-1]
mkdir -p "$state" 2>/dev/null && : 2>/dev/null >>"$state/lock" ||
  refuse "$results: cannot be written to"
exec 9>>"$state/lock"
flock --nonblock 9 || refuse "$results: another run is at work there"
# noclobber (-C) does not follow a link that was created in the meantime.
[ -e "$state/owner" ] || (set -C; echo 'scripts/reprocess.sh' >"$state/owner") 2>/dev/null ||
  refuse "$results: cannot be written to"
code=0
"$python" "$scripts/plan.py" "${folders[@]}" --bin "$bin" "${plan[@]}" || code=$?
if [ "$code" != 0 ]; then
  if [ -n "$made" ] && [ ! -e "$results/.state/run.json" ]; then rm -r "$results/.state"; fi
  rmdir "$results" 2>/dev/null || true
  exit "$code"
fi
log=$results/.state/reprocess.log
mapfile -t again <"$results/.state/again.txt"
[ ${#again[@]} = 0 ] || how+=(--forcerun "${again[@]}")
# --nolock: a killed run would leave the lock of Snakemake. The lock above replaces it: Snakemake inherits it and
# holds it until it ends, even if this shell ends earlier; its jobs do not.
"$python" -m snakemake --snakefile "$scripts/Snakefile" --directory "$results" --nolock \
  --rerun-incomplete --rerun-triggers mtime --keep-going --scheduler greedy "${how[@]}" \
  >"$log" 2>&1 &
run=$!
end_incomplete() { "$python" "$scripts/run_page.py" "$results" || true; echo "reprocess.sh: error: $1" >&2; exit 3; }
# Snakemake would finish its shards first: its child processes on this machine are terminated, too.
stop() {
  trap '' HUP INT TERM
  local started=("$run") level=$run
  while level=$(pgrep --parent "$level" | paste -sd,) && [ -n "$level" ]; do started+=(${level//,/ }); done
  kill -TERM "${started[@]}" 2>/dev/null || true
  wait "$run" || true
  # [ARCHIVE-3] `interrupted;`
  end_incomplete "interrupted; the same command continues"
}
trap stop HUP INT TERM
code=0
wait "$run" || code=$?
trap - HUP INT TERM
if [ "$code" != 0 ]; then
  mapfile -t failed < <(grep -A 12 '^Error in rule' "$log" | sed -n 's/^ *log: \([^ ]*\).*/\1/p' | sort -u | head -n 5)
  [ ${#failed[@]} -gt 0 ] || tail -n 20 "$log" >&2
  for file in "${failed[@]}"; do
    last_line=$(tail -n 1 "$results/$file")
    echo "$results/$file: ${last_line:-is empty; is the disk full?}" >&2
  done
  # [ARCHIVE-3] `not all could` | job ended early: disk, memory, or SIGTERM, SIGINT, SIGHUP | same command continues
  end_incomplete "not all could be processed; see $log; the same command continues"
fi
exec "$python" "$scripts/verdict.py" "$results"
