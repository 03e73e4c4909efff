# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Common part of the tests of scripts/reprocess.sh; arguments: SOURCE BIN SCRATCH.
set -euo pipefail
source_dir=$1 bin=$2 scratch=$3
export VLP_PROGRAMS_DIR=$bin
archive=$scratch/archive baseline=$scratch/baseline
said=$scratch/$(basename "$0" .sh).said

/usr/bin/python3 -c 'import snakemake' 2>/dev/null ||
  { echo "snakemake is missing: scripts/setup.sh --batch"; exit 77; }

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
options=(--row-time-s 3e-5 --readout rows)
reprocess() {  # RESULTS OPTION...
  "$source_dir/scripts/reprocess.sh" "$archive" "$1" "${options[@]}" "${@:2}"
}
# The same as a process group, to be killed as a whole: kill -9 -- -$!
start_reprocess() {  # RESULTS OPTION...
  setsid "$source_dir/scripts/reprocess.sh" "$archive" "$1" "${options[@]}" "${@:2}" >"$said" 2>&1 &
}
patiently() {  # SECONDS COMMAND...: until it succeeds
  local ends=$((SECONDS + $1))
  until "${@:2}" >/dev/null 2>&1; do
    [ $SECONDS -lt $ends ] || fail "in vain: ${*:2}"
    sleep 0.05
  done
}
# Pythons with a Snakemake of their own, as scripts/reprocess/README.md makes them.
other_snakemakes() {
  local python
  for python in "${VLP_SNAKEMAKES:-$source_dir/out/snakemake}"/*/bin/python; do
    [ ! -x "$python" ] || echo "$python"
  done
}
# Takes copies of some sessions, for a test to change, as its archive.
take() {  # FOLDER SESSION...
  local session
  rm -rf "$1"
  for session in "${@:2}"; do
    mkdir -p "$1/${session%/*}"
    cp -a "$archive/$session" "$1/$session"
  done
  archive=$1
}
# Everything that a run gives but what it costs; or what it gives for some sessions.
bytes_of() {  # RESULTS [SESSION...]
  local results=$1 session
  shift
  if [ $# = 0 ]; then
    (cd "$results" && find sessions failed overview.html fleet.csv lamps.csv -type f | sort | xargs sha256sum)
    sed 's/,[^,]*$//' "$results/summary.csv"
  fi
  for session; do
    (cd "$results" && find sessions failed -path "*/$session/*" -type f | sort | xargs sha256sum)
    grep "^${session/\//,}," "$results/summary.csv" | sed 's/,[^,]*$//'
  done
}
expect_baseline() {  # RESULTS [SESSION...]
  diff <(bytes_of "$baseline" "${@:2}") <(bytes_of "$@") || fail "$1 is not as an undisturbed run leaves it"
}
as_its_schema_says() {  # NAME FILE...
  "$source_dir/tests/support/schema_check.py" "$@" || fail "another document than its schema says"
}
state_of_archive() { find "$archive" -printf '%P %s %T@\n' | sort | sha256sum; }
