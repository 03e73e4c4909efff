#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Up-to-date results are not computed again, outdated ones are, and a killed run continues.
source "$(dirname "$0")/common.sh"
results=$scratch/interrupted
rm -rf "$results" "$results-bin" "$results-mark"
good=camera-00001/session-01 broken=$(cd "$baseline/failed" && echo */* | cut -d' ' -f1)
sessions=("$good" camera-00002/session-01 "$broken")
take "$results-archive" "${sessions[@]}"

# Killed in a step, between steps, and when the first session is done and the next at work, the whole of it; then to its
# end.
count() { { find "$results" -path "$1" 2>/dev/null || true; } | wc -l; }
another() { [ "$(count "$1")" -gt "$before" ]; }
for moment in '*/work/*/steps/corners/*.txt' '*/work/*/rotated.yaml' '*/sessions/*/row.json'; do
  before=$(count "$moment")
  start_reprocess "$results" --shard-size 3 --cores 1
  patiently 180 another "$moment"
  kill -9 -- -$!
  wait $! 2>/dev/null || true
  patiently 5 flock --nonblock "$results/.state/lock" true  # killed processes may end a moment later
  [ ! -e "$results/summary.csv" ] || fail "killed too late"
  # Every session that exists is complete.
  for session in "$results"/sessions/*/* "$results"/failed/*/*; do
    [ ! -e "$session" ] || [ -s "$session/row.json" ] || fail "$session is not whole"
  done
done
names_in() { (cd "$1" && ls -d */*); }
[ -n "$(comm -23 <(names_in "$results"/.state/work/*) <(names_in "$results/sessions"))" ] || fail "no other was at work"
run() { reprocess "$results" --shard-size 3 --cores 2 >"$said"; }
run
expect_baseline "$results" "${sessions[@]:0:2}"
cmp "$baseline/failed/$broken/session.json" "$results/failed/$broken/session.json"
[ -z "$(ls "$results/.state/work")" ] || fail "something is left of the work"
redone() {  # since the last time
  find "$results/sessions" "$results/failed" -name row.json -newer "$results-mark" -printf '%P\n' | sort
  touch "$results-mark"
}
redone >/dev/null 2>&1 || true

# A signal to the script alone ends all that it started, and the same command goes on.
gone() { ! pgrep --session "$run"; }
for signal in TERM HUP; do
  start_reprocess "$results-signal" --shard-size 3 --cores 1
  run=$!
  patiently 180 pgrep --session "$run" --full 'shard\.py'
  kill -$signal "$run"
  code=0
  wait "$run" || code=$?
  [ $code = 3 ] && grep -q 'interrupted; the same command continues' "$said" || fail "$signal: $code: $(cat "$said")"
  patiently 5 flock --nonblock "$results-signal/.state/lock" true
  patiently 5 gone
done
reprocess "$results-signal" --shard-size 3 --cores 2 >"$said"
expect_baseline "$results-signal" "${sessions[@]:0:2}"

# A worker that is lost, as for want of memory, is replaced by the run itself; here with a session at work.
start_reprocess "$results-lost" --shard-size 3 --cores 1
worker() { pgrep --session "$run" --full 'shard\.py'; }
run=$!
patiently 180 test -e "$results-lost/sessions/$good/row.json"
kill -9 $(worker)
wait "$run" || fail "the run ended with its worker: $(cat "$said")"
expect_baseline "$results-lost" "${sessions[@]:0:2}"
grep -q 'Trying to restart job' "$results-lost/.state/reprocess.log" || fail "no worker was lost"

# Nothing is done twice; a file that is only touched is looked at and found to be the same.
touch "$archive/$good/lamps.yaml"
run
[ -z "$(redone)" ] || fail "done twice"

# Another content is reprocessed, it alone. A session that is repaired moves from failed/ to sessions/.
sed -i '1a # changed' "$archive/$good/lamps.yaml"
mv "$archive/$broken" "$results-broken"
cp -r "$scratch/archive/camera-00004/session-01" "$archive/$broken"
run
[ "$(redone)" = "$(printf '%s/row.json\n' "$good" "$broken" | sort)" ] || fail "another content is not seen, or too much"
[ -e "$results/sessions/$broken" ] && [ ! -e "$results/failed/$broken" ] || fail "$broken is repaired"

# And back. In the meantime another version of a program has come, which crashes with one session: it is
# kept aside and tried again the next time, it alone.
rm -r "$archive/$broken"
mv "$results-broken" "$archive/$broken"
sed -i 2d "$archive/$good/lamps.yaml"
mkdir "$results-bin"
ln -s "$bin"/vlp-* "$results-bin"
rm "$results-bin/vlp-calibrate"
cat >"$results-bin/vlp-calibrate" <<PROGRAM
#!/bin/bash
[ "\$1" = --batch-stdin ] || exec "$bin/vlp-calibrate" "\$@"
while read -r line; do
  if [ -e "$results-crash" ] && [[ \$line == *$good* ]]; then
    kill -9 \$\$
  fi
  "$bin/vlp-calibrate" --batch-stdin <<<"\$line"
done
PROGRAM
chmod +x "$results-bin/vlp-calibrate"
touch "$results-crash"
VLP_PROGRAMS_DIR=$results-bin run
[ "$(redone | wc -l)" = 3 ] || fail "another program makes all stale"
grep -q '^no result   1, and 1 that crashed' "$said" || fail "$(cat "$said")"
grep -q '"reason": "vlp-calibrate ended with exit code -9"' "$results/failed/$good/row.json" || fail "no reason"
rm "$results-crash"
VLP_PROGRAMS_DIR=$results-bin run
grep -q '^no result   1, and 0 that crashed' "$said" || fail "$(cat "$said")"
[ "$(redone)" = "$good/row.json" ] && [ ! -e "$results/failed/$good" ] || fail "it has a result now"

# With .state gone what it knew is found out again, but for the costs.
rm -r "$results/.state" "$results/.snakemake"
VLP_PROGRAMS_DIR=$results-bin run
[ -z "$(redone)" ] || fail "done twice"
rm -r "$results" "$results"-*
