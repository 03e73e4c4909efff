#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs vlp-calibrate again over an archive of captures, and says what changed.
#
#   scripts/reprocess.sh ARCHIVE RESULTS [--gates FILE] [--previous RESULTS]
#                        [--cores N] [--profile slurm] [--session-gates FILE]
#                        [--row-time-s S] [--readout rows|columns]
#                        [--shard-size N] [--keep N] [--scan files|folders]
#                        [--rebuild-catalogue]
#   scripts/reprocess.sh --diff RESULTS CAMERA/SESSION [KEY | OTHER_RESULTS]
#
# ARCHIVE/CAMERA/SESSION/ is laid out as vlp-calibrate has it, and only read.
# RESULTS gets
#   summary.csv            a row per session: verdict, figures, what to look at,
#                          reason, version, cost
#   fleet.csv, lamps.csv   what was calibrated, and where each lamp was seen,
#                          over time
#   overview.html          the same for people, with what changed since
#                          --previous
#   changes.json           that comparison for programs, and the gates
#   sessions/, failed/     per session its results, or why there are none:
#                          session.json
# Results that are up to date are not computed again; an interrupted run
# continues. A session without a result does not stop the others.
#
# --cores N        shards at a time on this machine (default: one more than it
#                  has cores, so that none is idle while one waits)
# --profile NAME   a profile of scripts/reprocess/profiles or a folder: slurm
#                  submits shards to a cluster
# --previous       results of an earlier run to compare with
# --gates          what the archive as a whole has to keep to,
#                  vlp-archive-gates/1
# --session-gates  gates (vlp-gates/1) for sessions that have no gates.yaml of
#                  their own; other ones need no other calibration
# --row-time-s     from one row of the read-out to the next (default: found)
# --readout        along which the shutter reads (default: found)
# --shard-size N   sessions in a job at most (default 50)
# --keep N         results that a session had before, of which so many stay in
#                  former/ (default 1)
# --scan           at what, to see that a session changed: at its files, or at
#                  its folders, tables and YAML files, to which an image that
#                  is written over in place looks the same. Default: files; in
#                  an archive of more than 10,000 sessions folders, and files
#                  once a week
# --rebuild-catalogue  forgets what was seen: all contents are looked at again
# --diff           says what differs between a session's result and a former
#                  one, by its key's first letters (default: the last one), or
#                  that of other results
#
# Exit code: 0 done; 1 done, but a gate of the archive is not met, or a gate of
# a session if the archive has no gate_fraction. By default the archive has one
# gate, vanished: 0: each session of RESULTS and of --previous is still there.
# 2 bad input; 3 incomplete: the run could not finish, no session has a result,
# or more than no_result or no_result_fraction of --gates allow have none.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)/reprocess
bin=${VLP_PROGRAMS_DIR:-}
if [ -z "$bin" ]; then  # those of the build that this belongs to, or else those that are installed
  bin=$(cd "$scripts/../.." && pwd)/build/bin
  [ -x "$bin/vlp-calibrate" ] || bin=$(dirname "$(command -v vlp-calibrate || echo "$bin/vlp-calibrate")")
fi
python=${VLP_PYTHON:-/usr/bin/python3}  # the one that Debian's snakemake is for; that of an environment

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
      [ $# -gt 1 ] || usage "$1 wants a value"
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
      [ -e "$profile/config.yaml" ] || usage "--profile $2: neither of ours nor a folder with config.yaml"
      shift ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    --look | --look=*) usage "option '--look' is now called '--scan'" ;;
    -*) usage "unknown option $1" ;;
    *) folders+=("${1%/}") ;;
  esac
  shift
done
[ ${#folders[@]} = 2 ] || usage "ARCHIVE and RESULTS are missing, or something more is there"
results=${folders[1]}
snakemake=$("$python" -c 'from importlib.metadata import version; print(version("snakemake"))' 2>/dev/null) ||
  refuse "snakemake is missing; scripts/setup.sh --batch or apt install snakemake installs it"
if [[ $profile == "$scripts/profiles/slurm" && $snakemake != 7.* ]] &&
  ! "$python" -c 'import snakemake_executor_plugin_slurm' 2>/dev/null; then
  refuse "Snakemake $snakemake submits by snakemake-executor-plugin-slurm, which is missing beside it: install it by pip"
fi
if [ -n "$profile" ]; then
  how=(--profile "$profile")
else
  how=(--cores "$cores") plan+=(--at-a-time "$cores")
fi

export PYTHONDONTWRITEBYTECODE=1
case $(realpath -m "$results")/ in
  "$(realpath -m "${folders[0]}")"/*) usage "$results: is in the archive, which is only read" ;;
esac
[ -d "${folders[0]}" ] || usage "${folders[0]}: is not a folder"
# A .state that something else made is never written into or deleted: ours says so in "owner" and, once planned, in
# run.json. A run that was killed at its very start leaves it empty, or with the lock alone.
state=$results/.state made=''
for file in "$state/lock" "$state/owner"; do
  [ ! -L "$file" ] || refuse "$file: is a symbolic link, which is not followed: remove it"
done
case $(ls -A "$state" 2>/dev/null) in
  '' | lock) made=1 ;;
  *)
    [ -e "$state/owner" ] || grep -qs '^ "archive": ' "$state/run.json" ||
      refuse "$results: holds a .state that is not of reprocess.sh; give the results a folder of their own"
    ;;
esac
mkdir -p "$state" 2>/dev/null && : 2>/dev/null >>"$state/lock" ||
  refuse "$results: cannot be written to"
exec 9>>"$state/lock"
flock --nonblock 9 || refuse "$results: another run is at work there"
# noclobber (-C): a link that came meanwhile is not followed.
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
# A run that was killed leaves Snakemake's own lock, which the one above stands for: Snakemake holds it to
# its end, should this shell end before, and its jobs do not.
"$python" -m snakemake --snakefile "$scripts/Snakefile" --directory "$results" --nolock \
  --rerun-incomplete --rerun-triggers mtime --keep-going --scheduler greedy "${how[@]}" \
  >"$log" 2>&1 &
run=$!
# Snakemake would finish its shards first: what it has started on this machine is ended with it.
stop() {
  trap '' HUP INT TERM
  local started=("$run") level=$run
  while level=$(pgrep --parent "$level" | paste -sd,) && [ -n "$level" ]; do started+=(${level//,/ }); done
  kill -TERM "${started[@]}" 2>/dev/null || true
  wait "$run" || true
  echo "reprocess.sh: error: interrupted; the same command goes on" >&2
  exit 3
}
trap stop HUP INT TERM
code=0
wait "$run" || code=$?
trap - HUP INT TERM
if [ "$code" != 0 ]; then
  mapfile -t failed < <(grep -A 12 '^Error in rule' "$log" | sed -n 's/^ *log: \([^ ]*\).*/\1/p' | sort -u | head -n 5)
  [ ${#failed[@]} -gt 0 ] || tail -n 20 "$log" >&2
  for said in "${failed[@]}"; do
    words=$(tail -n 1 "$results/$said")
    echo "$results/$said: ${words:-holds nothing; is the disk full?}" >&2
  done
  echo "reprocess.sh: error: not all could be done; see $log; the same command goes on" >&2
  exit 3
fi
exec "$python" "$scripts/verdict.py" "$results"
