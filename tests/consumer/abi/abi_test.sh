#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Checks that programs linked with an earlier version of the library run with this one. Its symbols must be those of
# libvlp_positioning.symbols. The layouts of its types, which libabigail reads from the debug information of
# shown.cpp, must be those of libvlp_positioning.layouts.
#
#   abi_test.sh [--update] SOURCE_DIR BUILD_DIR SCRATCH
#
#   --update   rewrite the two files: removed or moved entries break programs, new ones do not
#
# Exit code 77 without abidw, or on another processor than that of the files.
set -euo pipefail
update=''
if [ "$1" = --update ]; then update=yes; shift; fi
source_dir=$1 build_dir=$2 scratch=$3
here=$source_dir/tests/consumer/abi

command -v abidw >/dev/null || { echo "abi_test.sh: no abidw; scripts/setup.sh --tests installs it"; exit 77; }
[ "$(uname -m)" = x86_64 ] || { echo "abi_test.sh: the files are of x86_64"; exit 77; }

rm -rf "$scratch"
mkdir -p "$scratch"
for component in positioning development; do
  cmake --install "$build_dir" --prefix "$scratch/installed" --component $component >>"$scratch/install.log"
done
lib=$(dirname "$(find "$scratch/installed" -name libvlp_positioning.so)")
include=$scratch/installed/include

nm -D --defined-only "$lib/libvlp_positioning.so" | cut -d ' ' -f 3- | LC_ALL=C sort \
  >"$scratch/libvlp_positioning.symbols"
# shellcheck disable=SC2046 # several words
c++ -std=c++20 -g -femit-class-debug-always -O0 -fPIC -shared "$here/shown.cpp" -I"$include" $(pkg-config --cflags eigen3) \
  -L"$lib" -lvlp_positioning -o "$scratch/libshown.so"
abidw --no-show-locs --out-file "$scratch/shown.abi" "$scratch/libshown.so"
python3 "$here/layouts.py" "$scratch/shown.abi" >"$scratch/libvlp_positioning.layouts"

# Every type that a header defines is in shown.cpp.
grep -hoE '^(typedef )?(struct|class|enum( class)?) [A-Za-z_]+ [{:]' -r "$include/vlp" |
  grep -oE '[A-Za-z_]+ [{:]$' | cut -d ' ' -f 1 | sort -u >"$scratch/defined"
while read -r type; do
  grep -qE "^(vlp::)?$type: " "$scratch/libvlp_positioning.layouts" ||
    { echo "abi_test.sh: $type is not in shown.cpp"; exit 1; }
done <"$scratch/defined"

for file in libvlp_positioning.symbols libvlp_positioning.layouts; do
  [ -z "$update" ] || cp "$scratch/$file" "$here/$file"
  diff "$here/$file" "$scratch/$file" || {
    echo "abi_test.sh: $file differs: what is lost or moved (<) breaks programs; of what is new, abi_test.sh --update"
    exit 1
  }
done
echo "abi_test.sh: $(wc -l <"$scratch/libvlp_positioning.symbols") symbols, $(wc -l <"$scratch/defined") types as they were"
