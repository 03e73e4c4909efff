#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Other gates of sessions are applied without another calibration, and give the verdict of vlp-calibrate --gates.
source "$(dirname "$0")/common.sh"
results=$scratch/session-gates-results gates=$scratch/session-gates-file.yaml errors=$scratch/session-gates-errors
rm -rf "$results"
cp -a "$baseline" "$results"
name=camera-00001/session-01
judge() {  # EXIT_CODE OPTION...
  local code=0
  reprocess "$results" --shard-size 3 "${@:2}" >"$said" 2>"$errors" || code=$?
  [ "$code" = "$1" ] || fail "exit code $code in place of $1: $(cat "$said" "$errors")"
  grep -q '^this run    ran 0, of them 0 without a result; reused 10; ' "$said" || fail "calibrated again: $(cat "$said")"
}
printf 'format: vlp-gates/1\ngates: {mean_mm: 0.0001, coverage: 0.999999}\n' >"$gates"
judge 1 --session-gates "$gates"
grep -q '^gates       7 with a result' "$said" && grep -q '7 of 10 sessions miss a gate' "$errors" || fail "$(cat "$said" "$errors")"
code=0
"$bin/vlp-calibrate" "$archive/$name" -o "$scratch/session-gates-alone" --gates "$gates" --camera-id camera-00001 --no-report \
  "${options[@]}" >/dev/null 2>&1 || code=$?
[ "$code" = 1 ] || fail "exit code $code of vlp-calibrate"
/usr/bin/python3 - "$results/summary.csv" "$scratch/session-gates-alone/session.json" <<'PYTHON' || fail "another verdict"
import csv, json, sys
row = next(csv.DictReader(open(sys.argv[1])))
alone = json.load(open(sys.argv[2]))
assert alone["reason"].startswith("mean_mm is ") or "; " in alone["reason"], alone["reason"]
assert row["verdict"] == alone["verdict"] == "gate", (row["verdict"], alone["verdict"])
assert sorted(row["reason"].split("; ")) == sorted(alone["reason"].split("; ")), (row["reason"], alone["reason"])
PYTHON
judge 0
grep -q '^gates       0 with a result' "$said" || fail "the gates stay: $(cat "$said")"
expect_baseline "$results"

# The metrics with a lower limit are those of vlp-calibrate.
at_least=$("$bin/vlp-calibrate" --help | sed -n '/^Gates:/,$p' |
  awk '/^  [a-z]/ { name = $1 } { text = text " " $0 } text ~ /, +at +least$/ { printf "%s ", name }')
stated=$(cd "$source_dir/scripts/reprocess" && PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c '
import session_gates
print(*session_gates.AT_LEAST, end=" ")')
[ -n "$stated" ] && [ "$at_least" = "$stated" ] || fail "at least: '$at_least', and in session_gates.py '$stated'"
rm -rf "$results" "$gates" "$errors" "$scratch/session-gates-alone"
