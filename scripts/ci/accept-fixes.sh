#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Accepts the fixes of a calibration for comparisons in CI: accept-fixes.sh RESULTS ACCEPTED.csv
# Copies RESULTS/check-fixes.csv, and records commit, date and digest in ACCEPTED.csv.origin. The gate in
# ACCEPTED.csv.gates.yaml is missed by a lens with less than 0.85 of the sharpness.
set -euo pipefail
refuse() { echo "accept-fixes.sh: error: $1" >&2; exit 2; }
[ $# = 2 ] || refuse "give RESULTS and ACCEPTED.csv"
fixes=$1/check-fixes.csv
[ -f "$fixes" ] || refuse "$fixes: is missing; run vlp-calibrate on a session with check/"
grep -q '"verdict": "pass"' "$1/session.json" || refuse "$1/session.json: the session did not pass; correct it first"
[ ! "$fixes" -nt "$1/session.json" ] || refuse "$fixes: was changed after the run; run vlp-calibrate again"
cp -- "$fixes" "$2"
awk '/"name": "mtf50"/ { getline; printf "format: vlp-gates/1\ngates: {mtf50: %.4f}\n", 0.85 * $2; exit }' \
  "$1/session.json" >"$2.gates.yaml"
printf 'commit %s\ndate %s\nversion %s\nsha256 %s\n' "$(git rev-parse HEAD 2>/dev/null || echo none)" \
  "$(date -u +%Y-%m-%dT%H:%M:%SZ)" "$(sed -n 's/.*"version": "\([^"]*\)".*/\1/p' "$1/session.json" | head -n 1)" \
  "$(sha256sum <"$2" | cut -d ' ' -f 1)" >"$2.origin"
