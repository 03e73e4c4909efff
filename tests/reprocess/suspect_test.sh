#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Sessions that calibrate without an error, but not with what they should: none passes in silence. The page of a run
# that is interrupted is that of no complete run.
source "$(dirname "$0")/common.sh"
results=$scratch/suspect
rm -rf "$results"
sessions=(camera-00001/session-01 camera-00002/session-0{1,2} camera-00003/session-02 camera-00004/session-0{1,2}
          camera-00005/session-02)
good=$archive
take "$results-archive" "${sessions[@]}"
expect() {  # EXIT-CODE WORDS OPTION...: of a run
  local code=0
  reprocess "$results" --shard-size 2 --cores 2 "${@:3}" >"$said" 2>"$said.errors" || code=$?
  [ "$code" = "$1" ] && grep -q -- "$2" "$said" "$said.errors" || fail "$code, and not '$2': $(cat "$said" "$said.errors")"
}
expect 0 '^no result   0'
cp "$results/overview.html" "$results-page"

# A result that a full disk cut, and one that is lost, are made again. The reader of stdout has ended.
: >"$results/sessions/camera-00001/session-01/calibration.yaml"
rm -r "$results/sessions/camera-00002/session-01"
expect 0 'missing or changed results: camera-00001/session-01; camera-00002/session-01$'
grep -q 'ran 2, of them 0' "$said" && [ -s "$results/sessions/camera-00001/session-01/calibration.yaml" ] || fail "$(cat "$said")"
cmp "$results/overview.html" "$results-page" || fail "another page"
reprocess "$results" --shard-size 2 --cores 2 2>"$said.errors" | head -n 1 >"$said"
[ ! -s "$said.errors" ] && grep -q 'checked all files$' "$said" || fail "$(cat "$said" "$said.errors")"

# Entries that are no cameras or sessions are named in one list, and the others run; so are files and sessions that
# archive.csv expects.
mkdir -p "$archive/.hidden" "$archive/empty" "$archive/camera-00001/"{-dash,$'line\nbreak'}
ln -s loop "$archive/loop"
ln -s / "$archive/camera-00002/root"
ln -s camera-00001 "$archive/again"
mkfifo "$archive/camera-00003/pipe"
printf '%s\n' camera,session,files 'camera-00001,session-01,"boards 20, check 99"' camera-00009,session-09,boards\ 1 >"$archive/archive.csv"
expect 1 'gate suspect: is 9, at most 0 is allowed'
for words in "'.hidden': names are of" "'empty': has no session" "'camera-00001/-dash': names" "'camera-00001/line.nbreak': names" \
  "'loop': leads to a folder that is missing" "'camera-00002/root': leads to '/'" "'again': leads to " "'camera-00003/pipe': is no folder" \
  'camera-00001/session-01: check has [0-9]* of 99 files' 'gate vanished: is 1, .*: camera-00009/session-09'; do
  grep -q -- "$words" "$said.errors" || fail "no '$words' in $(cat "$said.errors")"
done
grep -q 'ran 0, of them' "$said" || fail "run again: $(cat "$said")"
as_its_schema_says plan "$results/.state/compare.json"
archive=$good
take "$results-archive" "${sessions[@]}"

# Another camera's boards; half of a check is gone, and all of another; a session copied; a truth in mm.
rm -r "$archive/camera-00004/session-01/boards" "$archive"/camera-00001/session-01/check/*[13579].png "$archive/camera-00002/session-01/check"
cp -r "$archive/camera-00002/session-02/boards" "$archive/camera-00004/session-01"
awk -F, -v OFS=, 'NR > 1 { $2 *= 1000; $3 *= 1000 } 1' "$archive/camera-00003/session-02/check/truth.csv" >"$results-truth"
mv "$results-truth" "$archive/camera-00003/session-02/check/truth.csv"
cp -r "$archive/camera-00005/session-02" "$archive/camera-00005/session-03"
rm "$archive/camera-00002/session-02/check/0000.png"
ln -s nowhere.png "$archive/camera-00002/session-02/check/0000.png"
expect 1 'gate suspect: is 5, at most 0 is allowed'
for words in 'camera-00004/session-01: boards: the same files as in camera-00002/session-02; boards: of camera-00002? ' 'camera-00002/session-01: check has 0 of [0-9]* files' \
  'camera-00001/session-01: check has [0-9]* of [0-9]* files' 'camera-00005/session-03: is a copy of camera-00005/session-02' \
  'check/truth.csv:2: x_m: the values agree with the fixes if they are in mm'; do
  grep -q "$words" "$said" "$said.errors" || fail "no '$words' in $(cat "$said" "$said.errors")"
done
grep -q '>FAIL<' "$results/overview.html" && grep -q 'boards: of camera-00002?' "$results/overview.html" || fail "the page"
grep -q 'camera-00002,session-02,review,.*check/0000.png: not a file' "$results/summary.csv" || fail "no remark on the link"
as_its_schema_says row "$results"/*/*/*/row.json
as_its_schema_says changes "$results/changes.json"
# They are named as long as they are there, and can be allowed.
expect 1 'gate suspect: is 5'
printf 'format: vlp-archive-gates/1\ngates: {suspect: 5}\n' >"$results-gates.yaml"
expect 0 '^suspect     5: ' --gates "$results-gates.yaml"

# A run that is interrupted.
archive=$scratch/archive
take "$results-archive" "${sessions[@]}"
rm -r "$results/sessions/camera-00005/session-03"
start_reprocess "$results" --shard-size 2 --cores 1
patiently 60 eval '[ "$(cat "$results"/.state/ran/* | wc -l)" -gt 0 ]'
kill -TERM $!
wait $! && fail "the run ended" || [ $? = 3 ] || fail "another exit code"
grep -q '>INCOMPLETE<' "$results/overview.html" && grep -q 'Results of this run: camera-0000' "$results/overview.html" ||
  fail "the page is that of another run: $(head -c 500 "$results/overview.html")"
expect 0 '^no result   0'
cmp "$results/overview.html" "$results-page" || fail "another page"
expect 0 'ran 0, of them'
cmp "$results/overview.html" "$results-page" || fail "no page of a run without changes"
rm -r "$results" "$results"-*
