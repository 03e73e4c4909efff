# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs a program of the toolbox as a stage. What it says goes to LOG; its processor time, user and
# system, and its exit code go to LOG.end. A gate that is not met (1) does not end the session; a program
# that hangs does, after an hour. It is stopped with this shell (--foreground).
stage() {  # LOG PROGRAM ARGUMENT...
  local log=$1 code=0 TIMEFORMAT='%U %S'
  shift
  { time timeout --foreground --kill-after=60 3600 "$@" >"$log" 2>&1; } 2>"$log.end" || code=$?
  echo "$code" >>"$log.end"
  [ "$code" -le 1 ]
}

# Sets `unmet` to what tells vlp-evaluate of the gates that stages before it did not meet.
find_unmet() {  # LOG...
  local log
  unmet=()
  for log; do
    [ "$(tail -n 1 "$log.end" 2>/dev/null)" = 1 ] || continue
    unmet+=(--unmet "$(basename "$log" .txt): $(sed -n 's/^vlp-[a-z]*: error: //p' "$log" | paste -sd ' ')")
  done
}
