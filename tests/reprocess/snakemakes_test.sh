#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# With each Snakemake that is there: the system's, and those in environments of their own
# (scripts/reprocess/README.md). A shard that cannot be done is said to be so, and going on gives the same bytes.
source "$(dirname "$0")/common.sh"
results=$scratch/snakemakes
sessions=(camera-00001/session-01 camera-00002/session-01)
take "$results-archive" "${sessions[@]}"
for python in /usr/bin/python3 $(other_snakemakes); do
  version=$("$python" -m snakemake --version)
  echo "Snakemake $version"
  export VLP_PYTHON=$python
  rm -rf "$results"
  mkdir "$results"
  touch "$results/sessions"  # in the way of what comes
  code=0
  reprocess "$results" --shard-size 1 >"$said" 2>"$said.errors" || code=$?
  [ "$code" = 3 ] || fail "exit code $code with Snakemake $version"
  for shard in 000000 000001; do
    grep -q "/.state/logs/$shard.txt: .*Error: .*sessions" "$said.errors" || fail "$version: $(cat "$said.errors")"
  done
  grep -q 'not all could be processed; see .*; the same command continues' "$said.errors" || fail "$version: no summary"
  rm "$results/sessions"
  reprocess "$results" --shard-size 1 >"$said" || fail "$version: exit code $?"
  grep -q '^this run    ran 2, of them 0 without a result; reused 0; ' "$said" || fail "$version: $(cat "$said")"
  expect_baseline "$results" "${sessions[@]}"
  reprocess "$results" --shard-size 1 >"$said"
  grep -q '^this run    ran 0, .*; reused 2; ' "$said" || fail "$version: $(cat "$said")"
  if grep -q '^rule \|^localrule ' "$results/.state/reprocess.log"; then fail "$version runs what is done"; fi
done
rm -r "$results" "$results"-*
