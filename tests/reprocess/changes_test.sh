#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Compared with earlier results; gates of the archive and of sessions; refusals.
source "$(dirname "$0")/common.sh"
results=$scratch/changes previous=$scratch/previous
rm -rf "$results" "$previous"
cp -a "$baseline" "$results"
cp -a "$baseline" "$previous"

# As if an earlier version had been better by half in the first session that has a figure.
awk -F, -v OFS=, 'NR > 1 && $7 && !done { $7 /= 2; done = 1 } 1' "$baseline/summary.csv" >"$previous/summary.csv"
printf 'format: vlp-archive-gates/1\ngates: {no_result: 3, newly_failed: 0, worse_share: 0.1}\n' >"$scratch/gates.yaml"
code=0
reprocess "$results" --shard-size 3 --previous "$previous" --gates "$scratch/gates.yaml" >"$said" 2>"$scratch/errors" || code=$?
[ "$code" = 1 ] || fail "exit code $code"
grep -q '^changed     0 better, 1 worse, 6 the same, 0 newly without' "$said" || fail "$(cat "$said")"
grep -q 'gate worse_share: is 0.1429, at most 0.1 is asked for' "$scratch/errors" || fail "$(cat "$scratch/errors")"
[ "$(wc -l <"$scratch/errors")" = 1 ] || fail "the other gates are met"
grep -q '>FAIL<' "$results/overview.html" || fail "the overview says nothing"
printf 'format: vlp-archive-gates/1\ngates: {no_result: 3}\n' >"$scratch/gates.yaml"
reprocess "$results" --shard-size 3 --previous "$previous" --gates "$scratch/gates.yaml" >/dev/null

# Gates of sessions: of their own, those that are given for the others, and those of the lens.
(
  take "$scratch/gates" camera-00001/session-01
  mkdir "$archive/unit 2"
  cp -r "$archive/camera-00001/session-01" "$archive/unit 2/few boards"
  printf 'format: vlp-gates/1\ngates: {mean_mm: 0.0001}\n' >"$archive/camera-00001/session-01/gates.yaml"
  printf 'format: vlp-gates/1\ngates: {mean_mm: 5}\n' >"$scratch/session-gates.yaml"
  few="$archive/unit 2/few boards"
  rm "$few"/boards/00{05..19}.png
  mv "$few/check/truth.csv" "$few/check/captures.csv"
  reprocess "$scratch/gates-results" --session-gates "$scratch/session-gates.yaml" >"$said"
  grep -q '^gates       2 with a result that misses a gate' "$said" || fail "$(cat "$said")"
  grep -q '^camera.*mean_mm is .* at most 0.0001 mm' "$scratch/gates-results/summary.csv" || fail "no reason"
  grep -q '^unit 2,few boards,gate,12,.*halves_px is ' "$scratch/gates-results/summary.csv" || fail "no reason"
  grep -q '"verdict": "gate"' "$scratch/gates-results/sessions/unit 2/few boards/session.json" || fail "passes without a lens"
  grep -q 'id: "unit 2"' "$scratch/gates-results/sessions/unit 2/few boards/calibration.yaml" || fail "whose calibration?"
)

refused() {  # MESSAGE ARGUMENT...: exit code 2 and one line
  local code=0
  "$source_dir/scripts/reprocess.sh" "${@:2}" >/dev/null 2>"$scratch/errors" || code=$?
  [ "$code" = 2 ] && grep -q -- "$1" "$scratch/errors" && [ "$(wc -l <"$scratch/errors")" = 1 ] ||
    fail "${*:2}: $code $(cat "$scratch/errors")"
}
refused 'ARCHIVE and RESULTS are missing' "$archive"
refused 'is in the archive' "$archive" "$archive/results"
refused 'is not a folder' "$scratch/nowhere" "$scratch/refused"
refused 'unknown option' "$archive" "$scratch/refused" --odd
refused '--shard-size: should be a number' "$archive" "$scratch/refused" --shard-size 0
refused '--readout: should be rows or columns' "$archive" "$scratch/refused" --readout diagonals
refused 'neither of ours nor a folder' "$archive" "$scratch/refused" --profile odd
refused 'holds no summary.csv' "$archive" "$scratch/refused" --previous "$scratch"
refused 'this run writes there' "$archive" "$previous" --previous "$previous"
refused 'cannot be written to' "$archive" /dev/null/results
printf 'format: vlp-gates/1\ngates: {odd_mm: 3}\n' >"$scratch/gates.yaml"
refused "gates.yaml:2: gates: key 'odd_mm' is unknown" "$archive" "$scratch/refused" --session-gates "$scratch/gates.yaml"
printf 'format: vlp-archive-gates/1\ngates: {odd: 3}\n' >"$scratch/gates.yaml"
refused "gate 'odd' is unknown; there are: no_result" "$archive" "$scratch/refused" --gates "$scratch/gates.yaml"
mkdir -p "$scratch/empty" "$scratch/odd/camera/it's"
refused 'no sessions in it' "$scratch/empty" "$scratch/refused"
refused 'names of cameras and sessions' "$scratch/odd" "$scratch/refused"
[ ! -e "$scratch/refused" ] || fail "something is left of what was refused"
rm -rf "$results" "$previous" "$scratch"/gates* "$scratch/refused"
