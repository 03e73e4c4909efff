#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# An archive of ten sessions, of which three are damaged: each good one has its result, each bad one its
# reason, and the archive is as it was. Leaves archive and results for the other tests.
source "$(dirname "$0")/common.sh"
rm -rf "$scratch"
mkdir -p "$scratch"
# Sessions 2, 5 and 9 are damaged; 3 leans, 8 is out of focus.
sed 's/fault_fraction: .*/fault_fraction: 0.2/; s/damage_fraction: .*/damage_fraction: 0.3/' \
  "$source_dir/datasets/archive/scene.yaml" >"$scratch/scene.yaml"
"$bin/vlp-simulate" --quiet "$scratch/scene.yaml" --archive 10 -o "$archive"
before=$(state_of_archive)
reprocess "$baseline" --shard-size 3 --cores 2 >"$said"
cat "$said"
[ "$before" = "$(state_of_archive)" ] || fail "the archive has changed"
grep -q '^no result   3, and 0 that crashed' "$said" || fail "three sessions are damaged"
[ "$(wc -l <"$baseline/summary.csv")" = 11 ] || fail "a row per session"
while IFS=, read -r camera session _ damage _; do
  [ "$camera" != camera ] || continue
  name=$camera/$session
  if [ -n "$damage" ]; then
    [ ! -e "$baseline/sessions/$name" ] || fail "$name is damaged ($damage) and has a result"
    grep -q '"reason": "[a-z]' "$baseline/failed/$name/row.json" || fail "$name has no reason"
    grep -q '"verdict": "no result"' "$baseline/failed/$name/session.json" || fail "$name has no session.json"
    [ "$damage" != cut-images ] || grep -q '"reason": ".*none of its .* images can be used.*cut short' "$baseline/failed/$name/row.json" ||
      fail "$name is not said to be cut short: $(grep reason "$baseline/failed/$name/row.json")"
    if grep -rq "$scratch" "$baseline/failed/$name"; then fail "$name tells of a folder of this machine"; fi
  else
    [ ! -e "$baseline/failed/$name" ] || fail "$name is whole and has no result"
    for file in calibration.yaml camera.cameramodel fixes.csv evaluation.json session.json; do
      [ -s "$baseline/sessions/$name/$file" ] || fail "$name has no $file"
    done
  fi
done <"$archive/archive.csv"
as_its_schema_says row "$baseline"/*/*/*/row.json
as_its_schema_says changes "$baseline/changes.json"
as_its_schema_says plan "$baseline"/.state/{run,compare}.json
# The results of reprocessing equal those of vlp-calibrate byte for byte, and its report shows the same values.
name=camera-00001/session-01 alone=$scratch/alone
"$bin/vlp-calibrate" "$archive/$name" -o "$alone" --camera-id camera-00001 "${options[@]}" >"$said"
cmp "$alone/check-fixes.csv" "$baseline/sessions/$name/fixes.csv"
cmp "$alone/lens.cameramodel" "$baseline/sessions/$name/camera.cameramodel"
cmp "$alone/calibration.yaml" "$baseline/sessions/$name/calibration.yaml"
cmp "$alone/session.json" "$baseline/sessions/$name/session.json"
code=0
"${VLP_PYTHON:-/usr/bin/python3}" "$source_dir/tests/support/browser_check.py" "$baseline/overview.html" >"$said" || code=$?
[ "$code" = 0 ] || [ "$code" = 77 ] || fail "$(cat "$said")"  # 77: no browser
rm -f "$baseline/overview.pdf"
if grep -q 'src="http\|<script' "$baseline/overview.html"; then fail "the overview is not self-contained"; fi
rm -rf "$alone"
