#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Tests stations that share a PostgreSQL database and run concurrently, each with one unit after
# another and a hook per run. Requires a build in the project's folder and an installed PostgreSQL server:
#   tests/benchmarks/station_database.sh [RUNS [STATIONS]]     by default 500 runs of 8 stations
# The units have no images and are INVALID immediately, because only the records are tested. Starts
# its own server in its own folder. Exit code 1 if a run is lost or duplicated, if one had to wait in
# a spool, if the trail has an error, or if the server reports a deadlock.
set -euo pipefail
cd "$(dirname "$0")/../.."
programs=$(ls -d /usr/lib/postgresql/*/bin | tail -1)
PATH=$PWD/build/bin:$programs:$PATH
runs=${1:-500} stations=${2:-8}
work=$(mktemp -d)
owner=()
if [ "$(id -u)" = 0 ]; then
  chmod 711 "$work"
  owner=(setpriv --reuid=postgres --regid=postgres --clear-groups)
fi
mkdir "$work/server"
[ "$(id -u)" != 0 ] || chown postgres "$work/server"
server() { (cd / && "${owner[@]}" "$@" >>"$work/log" 2>&1); }
trap 'kill $(jobs -p) 2>/dev/null; wait; server pg_ctl -D "$work/server/data" -m immediate stop; rm -rf "$work"' EXIT
server initdb -D "$work/server/data" --auth=trust --username=vlp --encoding=UTF8
server pg_ctl -D "$work/server/data" -w -l "$work/server/log" \
  -o "-c listen_addresses= -k $work/server" start
records="postgresql://vlp@/postgres?host=$work/server"

for ((station = 1; station <= stations; ++station)); do
  cp -rT datasets/station "$work/station-$station"
  sed -i -e "s/^station: .*/station: station-$station/" -e "s|^records: .*|records: \"$records\"|" \
    -e '$ahook: {command: ["true"]}' "$work/station-$station/station.yaml"
done
begun=$EPOCHREALTIME
for ((station = 1; station <= stations; ++station)); do
  for ((unit = station; unit <= runs; unit += stations)); do
    code=0
    vlp-station run -q --station "$work/station-$station/station.yaml" --camera-id "unit-$unit" \
      --idle-s 0.001 >>"$work/said-$station" 2>&1 || code=$?
    [ "$code" = 3 ] || echo "unit-$unit ended with $code" >>"$work/wrong"
  done &
done
wait $(jobs -p)
seconds=$(awk -v a="$begun" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.1f", b - a }')

here=$(vlp-station list --records "$records" | grep -c '^20')
units=$(vlp-station list --records "$records" | awk '/^20/ { print $6 }' | sort -u | wc -l)
waited=$(grep -l 'delivered automatically' "$work"/said-* | wc -l || true)
deadlocks=$(grep -c deadlock "$work/server/log" || true)
trail=$(vlp-station verify-records --records "$records" 2>&1) || echo "the trail" >>"$work/wrong"
echo "$stations stations, $runs runs in $seconds s: $here kept, of $units units;" \
  "$waited stations with a run that had to wait, $deadlocks deadlocks"
echo "$trail"
cat "$work/wrong" 2>/dev/null || true
[ "$here $units $waited $deadlocks" = "$runs $runs 0 0" ] && [ ! -e "$work/wrong" ]
