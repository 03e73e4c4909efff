#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds the Debian packages vlp-tools, libvlp-positioning0 and libvlp-positioning-dev, and, if pybind11 is
# installed, python3-vlp, for the Debian release on which it runs.
#
#   scripts/packages.sh [-o FOLDER] [COMPONENT...]
#
#   -o FOLDER   output folder (default: build/packages of the project)
#   COMPONENT   positioning, development, tools or python (default: all)
set -euo pipefail
project=$(cd "$(dirname "$0")/.." && pwd)

folder=$project/build/packages
refuse() {
  echo "packages.sh: $1; see packages.sh --help" >&2
  exit 2
}
while [[ ${1:-} == -* ]]; do
  case $1 in
    -o) [ $# -gt 1 ] || refuse "-o needs a folder"
        folder=$(realpath -m "$2"); shift 2 ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    *) refuse "unknown option $1" ;;
  esac
done
cd "$project"

# Folders of libraries and zsh completions on Debian; nothing is recompiled. The previous settings of the build are
# restored at the end.
before=()
for name in CMAKE_INSTALL_PREFIX CMAKE_INSTALL_LIBDIR; do
  value=$(sed -n "s/^$name:[A-Z]*=//p" build/CMakeCache.txt 2>/dev/null || true)
  if [ -n "$value" ]; then before+=("-D$name=$value"); else before+=("-U$name"); fi
done
trap 'cmake "${before[@]}" "$project/build" >/dev/null' EXIT
installed=(-DCMAKE_INSTALL_PREFIX=/usr
           -DCMAKE_INSTALL_LIBDIR="lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)")
# A new build uses the preset, without tests, because their requirements may be missing. For an existing build the
# preset would overwrite its other settings.
if [ -e build/CMakeCache.txt ]; then
  cmake "${installed[@]}" build
else
  CXX=${CXX:-clang++} cmake --preset release "${installed[@]}" -DBUILD_TESTING=OFF
fi
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
