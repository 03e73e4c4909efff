#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Fetches public recordings of real cameras from their repositories on GitHub, at fixed commits, and checks
# their digests. Existing folders are checked only.
#
#   scripts/fetch_recordings.sh [FOLDER]     default: out/recordings; relative to the source folder
#
#   aprilgrid-mocap     30 images of a board by a hand-held camera under motion capture (images/, body.csv)
#                       chutsu/yac, Chris Choi, MIT
#   chessboard-fisheye  26 images of a chessboard through a lens of more than 180 degrees
#                       lessthanoptimal/BoofCV-Data, Peter Abeles, CC BY 4.0
#   led-1khz-frame      photograph filled by an LED of 1000 Hz, by a camera with a rolling shutter
#                       gyroflow/rollingshutter, MIT
#
# Needs git. Downloads 4 MB and the histories of the repositories, without their files.
set -euo pipefail
export LC_ALL=C  # order of names, on which digests depend
cd "$(dirname "$0")/.."
case ${1:-} in
  -h | --help) sed -n '5,/^set/p' scripts/fetch_recordings.sh | sed '$d; s/^# \{0,1\}//'; exit ;;
  -*) echo "fetch_recordings.sh: unknown option $1" >&2; exit 2 ;;
esac
folder=${1:-out/recordings}
mkdir -p "$folder"
scratch=$(mktemp --directory)
trap 'rm -rf "$scratch"' EXIT

# Checks out PATH... of a commit of a repository in $scratch/NAME.
check_out() {  # NAME REPOSITORY COMMIT PATH...
  echo "Fetching $2 ..."
  git clone --quiet --no-checkout --filter=tree:0 "https://github.com/$2" "$scratch/$1"
  git -C "$scratch/$1" checkout --quiet "$3" -- "${@:4}"
}
# Compares the digest of stdin.
check() {  # NAME SHA256
  local digest
  read -r digest _ < <(sha256sum)
  if [ "$digest" != "$2" ]; then
    echo "fetch_recordings.sh: $folder/$1: has other content than expected; remove it and fetch it again" >&2
    exit 1
  fi
}

if [ ! -d "$folder/aprilgrid-mocap" ]; then
  source=yac/tests/test_data/mocap_data
  check_out yac chutsu/yac 3f326b5 LICENSE $source/cam0/data $source/body0/data.csv
  mkdir "$scratch/mocap" "$scratch/mocap/images"
  cp "$scratch/yac/$source/cam0/data/"16061*.jpg "$scratch/mocap/images"
  cp "$scratch/yac/LICENSE" "$scratch/mocap"
  printf '%s\n' 'target_type: aprilgrid' 'tagCols: 6' 'tagRows: 6' 'tagSize: 0.088' 'tagSpacing: 0.3' >"$scratch/mocap/board.yaml"
  # Keeps the poses of the body within 0.4 s of an image; names of images are times in ns.
  (cd "$scratch/mocap/images" && printf '%s\n' *.jpg) |
    awk -F, 'NR == FNR { image[++images] = $1 + 0; next }
             FNR == 1 { print; next }
             { for (i = 1; i <= images; ++i) if (($1 - image[i]) ^ 2 < 0.4e9 ^ 2) { print; next } }' \
      - "$scratch/yac/$source/body0/data.csv" >"$scratch/mocap/body.csv"
  mv "$scratch/mocap" "$folder/aprilgrid-mocap"
fi
cat "$folder"/aprilgrid-mocap/images/*.jpg |
  check aprilgrid-mocap/images 4e3cded8d8edfcc992e8ec34016c855f9a36e38aeb735d7a33b301e8e3bfab06
tail -n +2 "$folder/aprilgrid-mocap/body.csv" |
  check aprilgrid-mocap/body.csv 8e3aad5661d89c753c91ffac8582c21bd4060e40f3ef56e8fe7624d82e1c84a3

if [ ! -d "$folder/chessboard-fisheye" ]; then
  source=example/calibration/fisheye/chessboard
  check_out boofcv lessthanoptimal/BoofCV-Data cc6d8ad $source
  mkdir "$scratch/chessboard"
  cp "$scratch/boofcv/$source/"*.jpg "$scratch/chessboard"
  printf '%s\n' 'format: vlp-board/1' 'kind: chessboard' 'cols: 5' 'rows: 7' 'square_size_m: 0.03' >"$scratch/chessboard/board.yaml"
  mv "$scratch/chessboard" "$folder/chessboard-fisheye"
fi
cat "$folder"/chessboard-fisheye/*.jpg |
  check chessboard-fisheye a27fdd12f6fbc594e17d45b43e531123393737a4ce9d0b62a678460fb807030c

if [ ! -d "$folder/led-1khz-frame" ]; then
  check_out rollingshutter gyroflow/rollingshutter 92a6459 images/frame_example.png
  mkdir "$scratch/led"
  cp "$scratch/rollingshutter/images/frame_example.png" "$scratch/led"
  printf '%s\n' 'format: vlp-lamps/1' 'lamps:' '  - {id: 1, position_m: [0, 0, 1], frequency_hz: 1000}' >"$scratch/led/lamps.yaml"
  mv "$scratch/led" "$folder/led-1khz-frame"
fi
check led-1khz-frame/frame_example.png 2ab4efe174e3e9bd96857626823632e24e6bdb8aad0684a3d9a01aefb4c7b9be <"$folder/led-1khz-frame/frame_example.png"
echo "Recordings are in $folder"
