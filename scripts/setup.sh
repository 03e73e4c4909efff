#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the Debian packages that the toolbox needs, as root or through sudo. Prints nothing if no
# package is missing.
#
#   scripts/setup.sh --build    to build the programs and run them
#   scripts/setup.sh [--tests]  also for tests, benchmarks and code checks
#   scripts/setup.sh --batch    also for scripts/reprocess.sh and its tests
#   scripts/setup.sh --root     only for tests/bare_root.sh
set -euo pipefail

build=(
  clang cmake ninja-build ccache git pkg-config
  libeigen3-dev libyaml-cpp-dev libcsv-dev libcli11-dev libspdlog-dev libfmt-dev
  libopencv-dev libpng-dev libapriltag-dev libceres-dev libssl-dev
  nlohmann-json3-dev libpugixml-dev
  libmrcal-dev libsuitesparse-dev libcairo2-dev
  libsoci-dev libsqlite3-dev libpq-dev
  libboost-dev  # Boost.Math; SOCI's headers include Boost's since Debian 13
  gnuplot-nox fonts-dejavu-core
  dpkg-dev file  # of scripts/packages.sh
)
tests=(
  g++  # of the tests of the installed library and its ABI
  libclang-rt-dev clang-format clang-tidy
  libgtest-dev libgmock-dev libbenchmark-dev mrcal python3-mrcal poppler-utils unzip
  postgresql postgresql-client tmux util-linux  # of the station
  pybind11-dev python3-dev python3-numpy python3-pil  # of the Python module
  chromium-headless-shell python3  # to open the report in a browser
  lintian  # of tests/packages.sh
  groff zsh  # to check manual pages and completions
  abigail-tools  # to check the ABI of the library
  python3-jsonschema  # to validate JSON documents against datasets/schemas
  python3-yaml  # tests/ci/run_action.py
)
root=(debootstrap)
# Snakemake, and a Slurm on one machine for the tests of its profile.
batch=(snakemake slurmctld slurmd slurm-client munge procps)
case ${1:---tests} in
  --build) packages=("${build[@]}") ;;
  --tests) packages=("${build[@]}" "${tests[@]}" "${root[@]}") ;;
  --batch) packages=("${build[@]}" "${tests[@]}" "${root[@]}" "${batch[@]}") ;;
  --root) packages=("${root[@]}") ;;
  *) echo "setup.sh: unknown option $1; use --build, --tests, --batch and --root" >&2; exit 2 ;;
esac

missing=()
for package in "${packages[@]}"; do
  state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$state" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "setup.sh: these packages are missing; install them as root: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo env DEBIAN_FRONTEND=noninteractive)
fi
echo "setup.sh: installing ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
export DEBIAN_FRONTEND=noninteractive
if ! { "${as_root[@]}" apt-get update &&
       "${as_root[@]}" apt-get install --yes --no-install-recommends "${missing[@]}"; } >"$log" 2>&1
then
  tail -n 20 "$log" >&2
  echo "setup.sh: the packages could not be installed; see above" >&2
  exit 1
fi
