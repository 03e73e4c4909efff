#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# What is current is not run again, what is stale is, and a run that is killed goes on.
source "$(dirname "$0")/common.sh"
results=$scratch/interrupted
rm -rf "$results" "$scratch/bin"

# Killed at three moments, the whole of it; then to its end.
for wait_s in 4 6 8; do
  setsid "$source_dir/scripts/reprocess.sh" "$archive" "$results" --row-time-s 3e-5 --readout rows \
    --shard-size 3 --cores 2 >/dev/null 2>&1 &
  sleep $wait_s
  kill -9 -- -$! 2>/dev/null || true
  wait $! 2>/dev/null || true
  # What stands there is whole.
  for session in "$results"/sessions/*/* "$results"/failed/*/*; do
    [ ! -e "$session" ] || [ -s "$session/session.json" ] || fail "$session is not whole"
  done
done
reprocess "$results" --cores 2
expect_baseline "$results"
[ ! -e "$results/.state/work/000000" ] || fail "something is left of the work"

# Nothing is done twice.
touch "$scratch/mark"
reprocess "$results" --cores 2 >/dev/null
[ -z "$(find "$results/sessions" "$results/failed" -newer "$scratch/mark")" ] || fail "done twice"

# A touched file is looked at and found to be the same; another content is reprocessed, it alone.
touch "$archive/camera-00001/session-01/lamps.yaml"
reprocess "$results" --cores 2 >/dev/null
[ -z "$(find "$results/sessions" "$results/failed" -newer "$scratch/mark")" ] || fail "touched, and done twice"
sed -i.original 's/^/# changed\n/;:a;n;ba' "$archive/camera-00001/session-01/lamps.yaml"
reprocess "$results" --cores 2 >/dev/null
changed=$(find "$results/sessions" "$results/failed" -name session.json -newer "$scratch/mark")
mv "$archive/camera-00001/session-01/lamps.yaml.original" "$archive/camera-00001/session-01/lamps.yaml"
[ "$changed" = "$results/sessions/camera-00001/session-01/session.json" ] || fail "reprocessed: $changed"

# A session that is repaired moves from failed/ to sessions/, and back.
broken=$(cd "$results/failed" && echo */* | cut -d' ' -f1)
good=$(cd "$results/sessions" && echo */* | cut -d' ' -f1)
mv "$archive/$broken" "$scratch/broken"
cp -r "$archive/$good" "$archive/$broken"
reprocess "$results" --cores 2 >/dev/null
[ -e "$results/sessions/$broken" ] && [ ! -e "$results/failed/$broken" ] || fail "$broken is repaired"
rm -r "$archive/$broken"
mv "$scratch/broken" "$archive/$broken"
reprocess "$results" --cores 2 >/dev/null
expect_baseline "$results"

# A program that crashes: its sessions are counted and kept aside, and tried again the next time.
mkdir "$scratch/bin"
ln -s "$bin"/vlp-* "$scratch/bin"
rm "$scratch/bin/vlp-locate"
cat >"$scratch/bin/vlp-locate" <<PROGRAM
#!/bin/bash
[ ! -e "$scratch/crash" ] || [[ \$1 != *camera-00001/session-01* ]] || kill -9 \$\$
exec "$bin/vlp-locate" "\$@"
PROGRAM
chmod +x "$scratch/bin/vlp-locate"
touch "$scratch/crash"
VLP_PROGRAMS_DIR=$scratch/bin reprocess "$results" --cores 2 >"$scratch/said"
grep -q '^no result   3, and 1 that crashed' "$scratch/said" || fail "$(cat "$scratch/said")"
grep -q '"reason": "locate ended with exit code 137"' "$results/failed/camera-00001/session-01/session.json" ||
  fail "the crash has no reason"
rm "$scratch/crash"
VLP_PROGRAMS_DIR=$scratch/bin reprocess "$results" --cores 2 >"$scratch/said"
grep -q '^no result   3, and 0 that crashed' "$scratch/said" || fail "$(cat "$scratch/said")"
[ ! -e "$results/failed/camera-00001/session-01" ] || fail "it has a result now"
rm -r "$scratch/bin"
touch "$scratch/mark"

# Other options are another key.
"$source_dir/scripts/reprocess.sh" "$archive" "$results" --row-time-s 3e-5 --shard-size 3 --cores 2 >/dev/null
[ "$(find "$results/sessions" -name session.json -newer "$scratch/mark" | wc -l)" = 7 ] || fail "stale results"
