#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds the Debian packages vlp-tools, libvlp-positioning0 and libvlp-positioning-dev, and python3-vlp where
# pybind11 is there, for the release of Debian that it runs on.
#
#   scripts/packages.sh [-o FOLDER] [COMPONENT...]
#
#   -o FOLDER   where to write them (default: build/packages)
#   COMPONENT   positioning, development, tools or python (default: all)
set -euo pipefail
cd "$(dirname "$0")/.."

folder=$PWD/build/packages
if [ "${1:-}" = -o ]; then
  mkdir -p "$2"
  folder=$(realpath "$2")
  shift 2
fi
case ${1:-} in -*) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit 2 ;; esac

# Where Debian has its libraries and zsh looks; nothing has to be compiled anew for it.
cmake --preset release -DCMAKE_INSTALL_PREFIX=/usr \
  -DCMAKE_INSTALL_LIBDIR="lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)"
targets=("${@/#/vlp_package_}")
[ $# -gt 0 ] || targets=(vlp_packages)
cmake --build build --target "${targets[@]}"
components=$(IFS=';' && echo "$*")
mkdir -p "$folder"
cd build
cpack -B "$folder" ${components:+-D "CPACK_COMPONENTS_ALL=$components"} >"$folder/cpack.log" ||
  { tail -n 20 "$folder/cpack.log" >&2; exit 1; }
rm -rf "$folder/_CPack_Packages" "$folder/cpack.log"
ls "$folder"/*.deb
