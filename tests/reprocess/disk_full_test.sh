#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# A disk that is full, sooner or later in a run: it says so, what stands there is whole, and with more room the same
# command gives the same bytes. On a file system in memory, which takes namespaces; skipped where there are none.
if [ -z "${VLP_OWN_MOUNTS:-}" ]; then
  unshare --user --map-root-user --mount true 2>/dev/null || { echo "no namespaces here"; exit 77; }
  VLP_OWN_MOUNTS=1 exec unshare --user --map-root-user --mount bash "$0" "$@"
fi
source "$(dirname "$0")/common.sh"
results=$scratch/full
sessions=(camera-00001/session-01 camera-00002/session-01)
take "$scratch/full-archive" "${sessions[@]}"
mkdir -p "$results"
full=0
for kilobytes in 40 120 250 400 600; do
  mount -t tmpfs -o "size=${kilobytes}k" tmpfs "$results"
  code=0
  reprocess "$results" --shard-size 3 --cores 1 >"$said" 2>&1 || code=$?
  if [ $code != 0 ] || grep -q 'and [1-9][0-9]* that crashed' "$said"; then
    full=$((full + 1))
    [ $code = 0 ] || [ $code = 2 ] || [ $code = 3 ] || fail "exit code $code of $kilobytes kB: $(cat "$said")"
    grep -q -i 'no space left\|disk full\|disk is full\|cannot be written to' "$said" "$results"/failed/*/*/row.json ||
      fail "nothing is said of the disk, of $kilobytes kB: $(cat "$said")"
  fi
  for session in "$results"/sessions/*/*; do
    [ ! -e "$session" ] || [ -s "$session/row.json" ] || fail "$session is not whole, of $kilobytes kB"
  done
  mount -o remount,size=50m "$results"
  reprocess "$results" --shard-size 3 --cores 1 >"$said" || fail "it does not go on, of $kilobytes kB: $(cat "$said")"
  expect_baseline "$results" "${sessions[@]}"
  umount "$results"
done
[ $full -ge 3 ] || fail "the disk was full $full times only"
rm -r "$results" "$scratch/full-archive"
