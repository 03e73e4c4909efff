#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the project, then builds the example of a robot's loop in lib/README.md against the installed
# tree: with its CMake package, and with pkg-config for this very processor (-march=native), which
# changes the layout of Eigen's own types. Both programs run.
set -euo pipefail
source_dir=$1 build_dir=$2 scratch=$3 flags=${4:-}

rm -rf "$scratch"
mkdir -p "$scratch/robot"
cmake --install "$build_dir" --prefix "$scratch/installed" >"$scratch/install.log"

cp "$source_dir"/tests/consumer/robot/* "$scratch/robot"
# Its one C++ block.
sed -n '/^```cpp$/,/^```$/{/^```/!p}' "$source_dir/lib/README.md" >"$scratch/robot/robot.cpp"
grep -q 'int main' "$scratch/robot/robot.cpp"

cmake -G Ninja -S "$scratch/robot" -B "$scratch/with-cmake" -DCMAKE_PREFIX_PATH="$scratch/installed" \
  -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release
cmake --build "$scratch/with-cmake"

export PKG_CONFIG_PATH=$scratch/installed/lib/pkgconfig
mkdir "$scratch/with-pkg-config"
# shellcheck disable=SC2046,SC2086 # several words each
c++ -std=c++20 -O2 -march=native $flags "$scratch"/robot/*.cpp -o "$scratch/with-pkg-config/robot" \
  $(pkg-config --cflags --libs vlp-positioning) -Wl,-rpath,"$scratch/installed/lib"

cd "$source_dir/datasets/example"
for how in with-cmake with-pkg-config; do
  output=$("$scratch/$how/robot")
  echo "$how: $output"
  [ "$(grep -c 'x ' <<<"$output")" = 1 ]
  [ "$(grep -c 'no fix: fewer than two lamps' <<<"$output")" = 1 ]
done
[ "$("$scratch/with-cmake/robot")" = "$("$scratch/with-pkg-config/robot")" ]
