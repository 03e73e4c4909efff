#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds and tests.
#
#   scripts/test.sh                      sets up, builds and runs every test
#   scripts/test.sh FOLDER...            builds and runs the tests of these folders of tests/
#   scripts/test.sh --quick [FOLDER...]  skips slow tests; without folders: only the tests of lib/
#
# FOLDER is, for example, positioning. With --quick or folders, the variable PRESET chooses a preset
# (dev: compiles each file separately). In CI (the variable CI is set) warnings are errors, and a
# process runs a part of the tests of a folder.
set -euo pipefail
cd "$(dirname "$0")/.."

quick=
folders=()
for argument; do
  case "$argument" in
    -h | --help)
      sed -n '5,/^set /{/^set /d; s/^# \?//p}' "$0"
      exit 0
      ;;
    --quick) quick=yes ;;
    *)
      if [ ! -f "tests/$argument/CMakeLists.txt" ]; then
        echo "test.sh: tests/$argument is not a folder of tests; choose one of:" tests/*/CMakeLists.txt |
          sed 's#tests/\([a-z]*\)/CMakeLists.txt#\1#g' >&2
        exit 2
      fi
      folders+=("$argument")
      ;;
  esac
done

# Configures with tests; further arguments are options of CMake. A new build uses Clang, which compiles
# in three quarters of the time of GCC, unless CXX in the environment chooses another compiler.
configure() {
  CXX=${CXX:-clang++} cmake --preset "$preset" -DVLP_TOOLBOX=ON -DBUILD_TESTING=ON "$@"
}
# Runs the tests below a folder of the build, then names those that were skipped.
run_tests() {
  local code=0
  ctest --test-dir "$1" --output-on-failure --no-tests=error \
    --parallel $(($(nproc) + 1)) "${@:2}" || code=$?  # some tests wait for other processes
  grep --no-filename --after-context=1 ': Skipped$' "$1/Testing/Temporary/LastTest.log" || true
  return "$code"
}

if [ -z "$quick" ] && [ ${#folders[@]} = 0 ]; then
  preset=release
  scripts/setup.sh --tests
  configure -DVLP_WARNINGS_AS_ERRORS="${CI:+ON}" -DVLP_TESTS_IN_SHARDS="${CI:+ON}"
  cmake --build --preset release
  run_tests build
  exit
fi

preset=${PRESET:-release}
build=build
[ "$preset" = release ] || build=build-$preset
# Each test runs in its own process, so that slow ones can be skipped. Ninja configures again if required.
if ! grep -qs '^VLP_TESTS_IN_SHARDS:BOOL=OFF' "$build/CMakeCache.txt" || [ ! -f "$build/tests/CTestTestfile.cmake" ]; then
  configure -DVLP_TESTS_IN_SHARDS=OFF
fi
choice=()
[ -z "$quick" ] || choice=(--label-exclude '^slow$')
if [ ${#folders[@]} = 0 ]; then
  cmake --build "$build" --target vlp_library_tests
  run_tests "$build" --label-regex '^unit$' "${choice[@]}"
else
  cmake --build "$build" --target $(printf "tests/%s/all " "${folders[@]}")
  for folder in "${folders[@]}"; do
    run_tests "$build/tests/$folder" "${choice[@]}"
  done
fi
