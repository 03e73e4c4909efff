# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# What the tests of scripts/reprocess.sh have in common: SOURCE BIN SCRATCH are their arguments.
set -euo pipefail
source_dir=$1 bin=$2 scratch=$3
export VLP_PROGRAMS_DIR=$bin
archive=$scratch/archive baseline=$scratch/baseline

/usr/bin/python3 -c 'import snakemake' 2>/dev/null ||
  { echo "snakemake is missing: scripts/setup.sh --batch"; exit 77; }

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
reprocess() {  # RESULTS OPTION...
  "$source_dir/scripts/reprocess.sh" "$archive" "$1" --row-time-s 3e-5 --readout rows --shard-size 3 "${@:2}"
}
# Everything that a run gives but what it costs.
bytes_of() {  # RESULTS
  (cd "$1" && find sessions failed overview.html -type f | sort | xargs sha256sum &&
    sed 's/,[^,]*$//' summary.csv)
}
expect_baseline() {  # RESULTS
  diff <(bytes_of "$baseline") <(bytes_of "$1") || fail "$1 is not as an undisturbed run leaves it"
}
state_of_archive() { find "$archive" -printf '%P %s %T@\n' | sort | sha256sum; }
