#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the library, then builds the robot loop of lib/README.md against the installed tree: with its CMake
# package, and with pkg-config for this processor (-march=native), which changes the layout of Eigen's types. Both
# programs and the example in C compute a fix from the pixels of a rendered image. Then compares fixes by the C API
# (C99, C++17) and by the C++ API, compiled by GCC and, if installed, Clang, without and with full optimization:
# they agree to the last bit.
set -euo pipefail
source_dir=$1 build_dir=$2 scratch=$3 flags=${4:-}

rm -rf "$scratch"
mkdir -p "$scratch/robot"
for component in positioning development; do
  cmake --install "$build_dir" --prefix "$scratch/installed" --component $component >>"$scratch/install.log"
done
lib=$(dirname "$(find "$scratch/installed" -name libvlp_positioning.so)")

cp "$source_dir"/tests/consumer/robot/* "$scratch/robot"
# Its one C++ block.
sed -n '/^```cpp$/,/^```$/{/^```/!p}' "$source_dir/lib/README.md" >"$scratch/robot/robot.cpp"
grep -q 'int main' "$scratch/robot/robot.cpp"

cmake -G Ninja -S "$scratch/robot" -B "$scratch/with-cmake" -DCMAKE_PREFIX_PATH="$scratch/installed" \
  -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_BUILD_TYPE=Release
cmake --build "$scratch/with-cmake"

export PKG_CONFIG_PATH=$lib/pkgconfig
mkdir "$scratch/with-pkg-config"
# shellcheck disable=SC2046,SC2086 # several words each
c++ -std=c++20 -O2 -march=native $flags "$scratch"/robot/*.cpp -o "$scratch/with-pkg-config/robot" \
  $(pkg-config --cflags --libs vlp-positioning) -Wl,-rpath,"$lib"

rendered=$source_dir/datasets/paper-rig/rendered
mkdir "$scratch/rig"
cp "$rendered/lamps.yaml" "$scratch/rig"
cp "$rendered/true_calibration.yaml" "$scratch/rig/calibration.yaml"
pixels=$scratch/rig/pixels
/usr/bin/python3 -c 'import sys, PIL.Image; sys.stdout.buffer.write(PIL.Image.open(sys.argv[1]).tobytes())' \
  "$rendered/sample/0000.png" >"$pixels"

cd "$scratch/rig"
for how in with-cmake with-pkg-config; do
  output=$("$scratch/$how/robot" <"$pixels")
  echo "$how: $output"
  [ "$(grep -c 'x ' <<<"$output")" = 1 ]
  [ "$(grep -c 'no fix: fewer than two lamps' <<<"$output")" = 1 ]
done
[ "$("$scratch/with-cmake/robot" <"$pixels")" = "$("$scratch/with-pkg-config/robot" <"$pixels")" ]

libs="-I$scratch/installed/include -L$lib -lvlp_positioning -Wl,-rpath,$lib"
eigen=$(pkg-config --cflags eigen3)
sed -n '/^```c$/,/^```$/{/^```/!p}' "$source_dir/lib/README.md" >"$scratch/robot.c"
# shellcheck disable=SC2086 # several words each
cc -std=c99 -Wall -Wextra -Wpedantic -Werror $flags "$scratch/robot.c" $libs -o "$scratch/robot-in-c"
grep -F "\`$("$scratch/robot-in-c" <"$pixels")\`" "$source_dir/lib/README.md"  # as it says there
# Two rooms with the same frequencies, the second one higher by 0.1 m.
{
  sed 's/{id: /{room: hall, id: /' lamps.yaml
  sed -n 's/, 1.6\]/, 1.7]/; s/{id: /{room: office, id: 1/p' lamps.yaml
} >rooms.yaml
# shellcheck disable=SC2086 # several words each
cc -std=c99 -Wall -Wextra -Wpedantic -Werror $flags "$source_dir/tests/consumer/rooms/rooms.c" $libs -o "$scratch/rooms"
diff - <("$scratch/rooms" <"$pixels") <<'EOF'
6 lamps, the first is 3
6 lamps, the first is 13
rooms.yaml: has no lamp with 'room: attic': name another room, or correct the map
rooms.yaml: lamps 1 and 11 share a frequency in two rooms: choose a room with the argument room of vlp_open_room(); the map has: hall, office
EOF
sed -n '/^```c++$/,/^```$/{/^```/!p}' "$source_dir/lib/README.md" >"$scratch/ros_node.cpp"
# shellcheck disable=SC2086 # several words each
c++ -std=c++17 -Wall -Wextra -Werror -fsyntax-only $flags $eigen -I"$scratch/installed/include" \
  -I"$source_dir/tests/consumer/ros" "$scratch/ros_node.cpp"
cd "$source_dir/datasets/example"
same=$source_dir/tests/consumer/same_fix/same_fix
first=''
same_fix() {  # COMPILER OPTIONS...
  if ! command -v "$1" >/dev/null; then
    echo "same_fix: no $1"
    return
  fi
  # shellcheck disable=SC2086 # several words each
  "$@" $flags $libs -o "$scratch/same_fix"
  fixes=$("$scratch/same_fix")
  first=${first:-$fixes}
  if [ "$fixes" != "$first" ]; then
    printf 'same_fix: %s:\n%s\nand not\n%s\n' "$*" "$fixes" "$first"
    exit 1
  fi
}
for optimize in -O0 "-O3 -march=native"; do
  # shellcheck disable=SC2086 # several words each
  for compiler in cc clang; do
    same_fix $compiler -std=c99 -Wall -Wextra -Wpedantic -Werror $optimize -x c "$same.c"
    same_fix ${compiler/cc/c}++ -std=c++17 -Wall -Wextra -Werror $optimize -x c++ "$same.c"
  done
  # shellcheck disable=SC2086 # several words each
  same_fix c++ -std=c++20 $eigen $optimize -x c++ "$same.cpp"
done
# shellcheck disable=SC2086 # several words each
same_fix clang++ -std=c++20 $eigen -O3 -march=native -x c++ "$same.cpp"
echo "same_fix: $first"
[ "$(grep -c '^0 ' <<<"$first")" = 2 ]
