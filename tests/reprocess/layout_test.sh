#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# A folder of another level, and sessions that lack inputs: exit code 3 and a line that says how to mend it.
source "$(dirname "$0")/common.sh"
results=$scratch/layout-results gates=$scratch/layout-gates.yaml errors=$scratch/layout-errors
rm -rf "$results"
take "$scratch/layout" camera-00001/session-01 camera-00002/session-01
incomplete() {  # EXIT_CODE MESSAGE ARGUMENT...
  local code=0
  "$source_dir/scripts/reprocess.sh" "${@:3}" "${options[@]}" >"$said" 2>"$errors" || code=$?
  [ "$code" = "$1" ] || fail "exit code $code in place of $1: $(cat "$said" "$errors")"
  grep -q -- "$2" "$errors" && [ "$(grep -c 'error: ' "$errors")" = 1 ] || fail "$(cat "$errors")"
}
incomplete 3 "in place of cameras, one level too deep: give $archive\$" "$archive/camera-00001" "$results"
incomplete 2 "is a session, two levels too deep: give $archive\$" "$archive/camera-00001/session-01" "$results"
mkdir "$scratch/layout-above"
mv "$archive" "$scratch/layout-above/archive"
incomplete 3 "is one level too high: give $scratch/layout-above/archive\$" "$scratch/layout-above" "$results"
mv "$scratch/layout-above/archive" "$archive"
mkdir -p "$scratch/layout-empty/camera/session"
incomplete 3 'none of its 1 sessions has any input; the layout is ARCHIVE/CAMERA/SESSION/' "$scratch/layout-empty" "$results"
[ ! -e "$results" ] || fail "something is left of an archive that has no session"

# Files of another program in the folder are neither changed nor deleted.
mkdir -p "$results/.state"
echo precious >"$results/.state/notes"
before=$(find "$results" | sort)
for folder in "$scratch/layout-empty" "$archive"; do
  incomplete 2 'contains a .state that is not of reprocess.sh; give the results a folder of their own' "$folder" "$results"
  [ "$(find "$results" | sort)" = "$before" ] || fail "another program's .state was changed"
done
rm -r "$results"

# A run that was killed before it had its owner goes on, here as far as to the archive without input. Nobody's link is
# followed.
message='none of its 1 sessions has any input'
for left in '' lock; do
  mkdir -p "$results/.state"
  [ -z "$left" ] || touch "$results/.state/$left"
  incomplete 3 "$message" "$scratch/layout-empty" "$results"
  [ ! -e "$results" ] || fail "something is left of an archive that has no session"
done
for name in lock owner; do
  mkdir -p "$results/.state"
  ln -s "$scratch/layout-target" "$results/.state/$name"
  incomplete 2 "$results/.state/$name: is a symbolic link, which is not followed: remove it" "$archive" "$results"
  [ ! -e "$scratch/layout-target" ] || fail "the target of a link was made"
  rm -r "$results"
done
# Two starts at once: the first has the lock and no owner yet.
mkdir -p "$results/.state"
exec 8>>"$results/.state/lock"
flock 8
incomplete 2 'another run is at work there' "$archive" "$results"
exec 8>&-
rm -r "$results"

# One of two has no rotation: that passes unless a fraction is given. With both, nothing could be done.
rm -r "$archive/camera-00002/session-01/rotation"
reprocess "$results" >"$said"
printf 'format: vlp-archive-gates/1\ngates: {no_result_fraction: 0.4}\n' >"$gates"
missing='1 of 2 sessions have no result; 1 of them: rotation: is missing; rotation is missing in 1 session; the layout'
incomplete 3 "$missing" "$archive" "$results" --gates "$gates"
grep -q '>INCOMPLETE<' "$results/overview.html" || fail "the overview has another verdict"
printf 'format: vlp-archive-gates/1\ngates: {no_result_fraction: 0.5}\n' >"$gates"
reprocess "$results" --gates "$gates" >"$said"
rm -r "$archive/camera-00001/session-01/rotation"
incomplete 3 '2 of 2 sessions have no result; 2 of them: rotation: is missing' "$archive" "$results"
as_its_schema_says changes "$results/changes.json"
rm -rf "$archive" "$results" "$scratch"/layout*
