#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Sets up, builds and runs every test. In CI (the variable CI is set) warnings are errors, and a
# process runs a share of a folder's tests.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh --tests
cmake --preset release -DVLP_TOOLBOX=ON -DBUILD_TESTING=ON \
  -DVLP_WARNINGS_AS_ERRORS="${CI:+ON}" -DVLP_TESTS_IN_SHARDS="${CI:+ON}"
cmake --build --preset release
ctest --preset release --parallel $(($(nproc) + 1)) || code=$?  # some wait for others
grep --no-filename --after-context=1 ': Skipped$' build/Testing/Temporary/LastTest.log || true
exit "${code:-0}"
