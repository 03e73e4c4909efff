#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Kills scripts/reprocess.sh with all of its processes at random times while it runs over an archive of
# datasets/archive, and continues it. All files must be complete at any time, and the final results identical to those
# of an undisturbed run. Finished runs are deleted and started again until the number of kills is reached. Shards have
# three sessions, so that results of one session are moved while another one runs.
#
#   reprocess_kills.sh FOLDER    50 kills (KILLS=N), 6 sessions (SESSIONS=N); SEED=N: other times
source_dir=$(cd "$(dirname "$0")/../.." && pwd)
bin=${VLP_PROGRAMS_DIR:-$source_dir/build/bin}
kills=${KILLS:-50} RANDOM=${SEED:-1}
set -- "$source_dir" "$bin" "$(realpath -m "${1:?which FOLDER?}")"
mkdir -p "$3"
source "$source_dir/tests/reprocess/common.sh"
run=(--shard-size 3 --cores 2)
[ -e "$archive" ] ||
  "$bin/vlp-simulate" --quiet "$source_dir/datasets/archive/scene.yaml" --archive "${SESSIONS:-6}" -o "$archive"
rm -rf "$baseline"
began=$(date +%s%3N)
reprocess "$baseline" "${run[@]}" >"$said"
whole_ms=$(($(date +%s%3N) - began))

results=$scratch/killed
rm -rf "$results"
killed=0 finished=0 after=()
while [ $killed -lt "$kills" ]; do
  began=$(date +%s%3N)
  start_reprocess "$results" "${run[@]}"
  pid=$!
  sleep "$(awk -v share=$RANDOM -v whole=$whole_ms 'BEGIN { print share / 32768 * whole / 1000 }')"
  kill -9 -- "-$pid" 2>/dev/null || true
  code=0
  wait $pid 2>/dev/null || code=$?
  if [ $code = 137 ]; then
    killed=$((killed + 1))
    after+=("$(($(date +%s%3N) - began))")
    for session in "$results"/sessions/*/* "$results"/failed/*/*; do
      [ ! -e "$session" ] || [ -s "$session/row.json" ] || fail "kill $killed: $session is not whole"
    done
  elif [ $code != 0 ]; then
    fail "exit code $code: $(cat "$said")"
  fi
  # Finished runs are started again; every tenth killed run is continued to its end.
  if [ $code = 0 ] || [ $((killed % 10)) = 0 ]; then
    reprocess "$results" "${run[@]}" >"$said"
    expect_baseline "$results"
    [ -z "$(ls "$results/.state/work")" ] || fail "something is left of the work"
    finished=$((finished + 1))
    rm -rf "$results"
  fi
done
if [ -e "$results" ]; then
  reprocess "$results" "${run[@]}" >"$said"
  expect_baseline "$results"
  finished=$((finished + 1))
fi
echo "killed $killed times, from $(printf '%s\n' "${after[@]}" | sort -n | head -n 1) to" \
  "$(printf '%s\n' "${after[@]}" | sort -n | tail -n 1) ms after the beginning of a run, of which an undisturbed one takes" \
  "$whole_ms; gone on with to the end $finished times: the same bytes"
rm -rf "$results" "$baseline"
