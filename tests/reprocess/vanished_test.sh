#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# A session that is deleted between two runs is named and ends the run with exit code 1, until it is back, its
# results are deleted, or a gate allows it. A lost result is named, too, and is a gate.
source "$(dirname "$0")/common.sh"
results=$scratch/vanished-results gates=$scratch/vanished-gates.yaml errors=$scratch/vanished-errors
rm -rf "$results"
kept=camera-00001/session-01 gone=camera-00002/session-01
take "$scratch/vanished" "$kept" "$gone"
run() {  # EXIT_CODE OPTION...
  local code=0
  reprocess "$results" "${@:2}" >"$said" 2>"$errors" || code=$?
  [ "$code" = "$1" ] || fail "exit code $code in place of $1: $(cat "$said" "$errors")"
}
run 0
grep -q '>PASS<' "$results/overview.html" || fail "the overview has no verdict"
mv "$archive/${gone%/*}" "$scratch/vanished-camera"
for _ in 1 2; do  # the second run has no row of it in the summary before
  run 1
  grep -q "^vanished    1 no longer in the archive: $gone\$" "$said" || fail "$(cat "$said")"
  grep -q "gate vanished: is 1, at most 0 is allowed: $gone\$" "$errors" && [ "$(wc -l <"$errors")" = 1 ] || fail "$(cat "$errors")"
done
grep -q '>FAIL<' "$results/overview.html" || fail "the overview passes"
sed -n '/^<h2>Actions/p' "$results/overview.html" | grep -q "$gone" || fail "it is not what to do"
as_its_schema_says changes "$results/changes.json"
as_its_schema_says plan "$results"/.state/{run,compare}.json
printf 'format: vlp-archive-gates/1\ngates: {vanished: 1}\n' >"$gates"
run 0 --gates "$gates"
grep -q "^vanished    1 no longer in the archive: $gone\$" "$said" || fail "allowed, and not named: $(cat "$said")"
# Other results than these have it.
run 1 --previous "$baseline"
grep -q "gate vanished: is 9, at most 0 is allowed: camera-00001/session-02; $gone; " "$errors" || fail "$(cat "$errors")"
mv "$scratch/vanished-camera" "$archive/${gone%/*}"
run 0
grep -q '^this run    ran 0' "$said" || fail "its result was lost: $(cat "$said")"

# The rotation of a session is lost: it had a result, which is kept.
mv "$archive/$gone/rotation" "$scratch/vanished-rotation"
printf 'format: vlp-archive-gates/1\ngates: {lost_results: 0}\n' >"$gates"
run 1 --gates "$gates"
grep -q "^lost        1 had a result before: $gone\$" "$said" || fail "$(cat "$said")"
grep -q '^            1 of them: rotation: is missing$' "$said" || fail "$(cat "$said")"
grep -q "gate lost_results: is 1, at most 0 is allowed: $gone\$" "$errors" || fail "$(cat "$errors")"
[ -n "$(find "$results/former/$gone" -name calibration.yaml)" ] || fail "the former result is gone"
mv "$scratch/vanished-rotation" "$archive/$gone/rotation"
run 0 --gates "$gates"
rm -rf "$archive/${gone%/*}" "$results/sessions/$gone"
run 0
rm -rf "$archive" "$results" "$gates" "$errors"
