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
reprocess "$results" --cores 2 --previous "$previous" --gates "$scratch/gates.yaml" >"$scratch/said" 2>"$scratch/errors" || code=$?
[ "$code" = 1 ] || fail "exit code $code"
grep -q '^changed     0 better, 1 worse, 6 the same, 0 newly without' "$scratch/said" || fail "$(cat "$scratch/said")"
grep -q 'gate worse_share: is 0.1429, at most 0.1 is asked for' "$scratch/errors" || fail "$(cat "$scratch/errors")"
[ "$(wc -l <"$scratch/errors")" = 1 ] || fail "the other gates are met"
grep -q '>FAIL<' "$results/overview.html" || fail "the overview says nothing"
printf 'format: vlp-archive-gates/1\ngates: {no_result: 3}\n' >"$scratch/gates.yaml"
reprocess "$results" --cores 2 --previous "$previous" --gates "$scratch/gates.yaml" >/dev/null

# Gates of sessions.
printf 'format: vlp-gates/1\ngates: {mean_mm: 0.0001}\n' >"$scratch/session-gates.yaml"
reprocess "$results" --cores 2 --session-gates "$scratch/session-gates.yaml" >"$scratch/said"
grep -q '^gates       7 with a result that misses a gate' "$scratch/said" || fail "$(cat "$scratch/said")"
grep -q 'mean_mm is .* at most 0.0001 mm' "$results/summary.csv" || fail "no reason"

refused() {  # MESSAGE ARGUMENT...: exit code 2 and one line
  local code=0
  "$source_dir/scripts/reprocess.sh" "${@:2}" >/dev/null 2>"$scratch/errors" || code=$?
  [ "$code" = 2 ] && grep -q -- "$1" "$scratch/errors" && [ "$(wc -l <"$scratch/errors")" = 1 ] ||
    fail "${*:2}: $code $(cat "$scratch/errors")"
}
refused 'which ARCHIVE' "$archive"
refused 'is in the archive' "$archive" "$archive/results"
refused 'is not a folder' "$scratch/nowhere" "$scratch/refused"
refused 'unknown option' "$archive" "$scratch/refused" --odd
refused 'holds no summary.csv' "$archive" "$scratch/refused" --previous "$scratch"
printf 'format: vlp-archive-gates/1\ngates: {odd: 3}\n' >"$scratch/gates.yaml"
refused "gate 'odd' is unknown; there are: no_result" "$archive" "$scratch/refused" --gates "$scratch/gates.yaml"
mkdir -p "$scratch/empty"
refused 'no sessions in it' "$scratch/empty" "$scratch/refused"
