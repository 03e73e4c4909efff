#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Debian packages, made and checked by lintian, then installed, used and removed in a bare root of this
# machine's release, as a user of theirs has it. Only the superuser can, and with a network.
#
#   tests/packages.sh [--root DIR] [--made FOLDER RELEASE] [COMPONENT...]
#
#   --root DIR   make the root there and keep it, or use the one that is there (default: a temporary one)
#   --made FOLDER RELEASE
#                take the packages there, which were made on another release, and a root of that
#   COMPONENT    as of scripts/packages.sh
#
# Exit code 75 when there is no root (tests/bare_root.sh).
set -euo pipefail
project=$(cd "$(dirname "$0")/.." && pwd)

root=() made='' release=''
refuse() {
  echo "packages.sh: $1; see packages.sh --help" >&2
  exit 2
}
while [[ ${1:-} == -* ]]; do
  case $1 in
    --root) [ $# -gt 1 ] || refuse "--root wants a folder"
            root=(--root "$(realpath -m "$2")"); shift 2 ;;
    --made) [ $# -gt 2 ] || refuse "--made wants a folder and a release"
            made=$(realpath "$2") release=$3; shift 3 ;;
    -h | --help) sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'; exit ;;
    *) refuse "unknown option $1" ;;
  esac
done
cd "$project"
# The requested packages must exist; python3-vlp is built only if pybind11 is installed.
declare -A package_of=([positioning]=libvlp-positioning0 [development]=libvlp-positioning-dev [tools]=vlp-tools
                       [python]=python3-vlp)
asked=()
for component in "$@"; do
  [ -n "${package_of[$component]:-}" ] || refuse "unknown component $component"
  asked+=("${package_of[$component]}")
done
[ $# -gt 0 ] || asked=(libvlp-positioning0 libvlp-positioning-dev vlp-tools)
[[ " $* " != *" development "* || " $* " == *" positioning "* ]] ||
  refuse "development installs with positioning beside it: name both"
[ -n "$(command -v lintian)" ] || { echo "packages.sh: lintian is missing; scripts/setup.sh installs it" >&2; exit 1; }
scratch=$(mktemp --directory --tmpdir packages-XXXXXX)
trap 'rm -rf "$scratch"' EXIT
chmod 755 "$scratch"
if [ "$made" ]; then cp "$made"/*.deb "$scratch"; else scripts/packages.sh -o "$scratch" "$@"; fi
for package in "${asked[@]}"; do
  compgen -G "$scratch/${package}_*.deb" >/dev/null || { echo "packages.sh: $package was not made" >&2; exit 1; }
done
lintian --fail-on error --allow-root "$scratch"/*.deb

[ "$release" ] || release=$(. /etc/os-release && echo "$VERSION_CODENAME")
# The packages are what is newest in the root, and nothing of the project is built there.
tests/bare_root.sh "${root[@]}" --bind "$scratch" /packages "$release" '
  export DEBIAN_FRONTEND=noninteractive
  begin=$SECONDS
  apt-get update -qq
  apt-get install -qq --no-install-recommends /packages/*.deb >/packages/install.log 2>&1 ||
    { tail /packages/install.log; exit 1; }
  has() { dpkg-query -W "$1" >/dev/null 2>&1; }
  cd datasets/example
  if has vlp-tools; then
    vlp-locate detections.csv --lamps lamps.yaml --calibration calibration.yaml -o /packages/fixes.csv
    vlp-evaluate /packages/fixes.csv --truth truth.csv --gate mean_mm=1 --report /packages/report.html
    grep -q "<strong>PASS</strong>" /packages/report.html
    echo "a first report $((SECONDS - begin)) s after the first command"
    # Runs the first commands of README.md with nothing but the files of the package.
    mkdir /packages/first
    sed -n "/^    mkdir -p out && cp/p; s/^    \(vlp-.*\)/\1/p" ../../README.md >/packages/first/commands
    (cd /packages/first && bash -euo pipefail commands >>/packages/install.log && test -s out/results/report.html)
    echo "a whole calibration and its report $((SECONDS - begin)) s after the first command"
    archive=/packages/archive
    vlp-simulate --quiet ../archive/scene.yaml --archive 2 -o $archive
    apt-get install -qq --no-install-recommends snakemake >>/packages/install.log 2>&1
    /usr/share/vlp-tools/reprocess.sh $archive $archive-results --row-time-s 3e-5 --readout rows
    test -s $archive-results/overview.html
    # The composite action on a machine that has only the package: red, with the cause, within 60 s.
    mkdir /packages/ci
    vlp-simulate --quiet ../archive/scene.yaml -o /packages/ci/session
    vlp-calibrate --quiet /packages/ci/session --row-time-s 3e-5 --readout rows -o /packages/ci/accepted
    vlp-evaluate --quiet /packages/ci/accepted/check-fixes.csv --truth /packages/ci/session/check/truth.csv \
      --propose-gates /packages/ci/gates.yaml
    # The focal lengths are 1 % off.
    awk -F "[[,]" "/^  intrinsics: / {printf \"%s[%.9f,%.9f\", \$1, 1.01 * \$2, 1.01 * \$3; for (i = 4; i <= NF; ++i)
      printf \",%s\", \$i; print \"\"; next} {print}" /packages/ci/accepted/lens.yaml >/packages/ci/session/camera.yaml
    apt-get install -qq --no-install-recommends python3-yaml >>/packages/install.log 2>&1
    apt-get purge -qq vlp-tools >>/packages/install.log 2>&1
    apt-get autopurge -qq >>/packages/install.log 2>&1
    begin=$SECONDS
    (
      cd /packages/ci
      code=0
      python3 "$OLDPWD/../../tests/ci/run_action.py" session=session "options=--row-time-s 3e-5 --readout rows" \
        gates=gates.yaml accepted=accepted/check-fixes.csv packages=/packages >>/packages/install.log 2>&1 || code=$?
      [ "$code" -ne 0 ] || { echo "the job passed with focal lengths that are 1 % off"; exit 1; }
      grep -q "wrong focal length .*height_rms_mm is" results/junit.xml
    )
    echo "a failed job with its cause $((SECONDS - begin)) s after its first command, the package cached"
    [ "$((SECONDS - begin))" -le 60 ]
    for program in /usr/bin/vlp-*; do
      "$program" --version
      test -s "/usr/share/man/man1/${program##*/}.1.gz"
    done
  fi
  if has libvlp-positioning-dev; then
    apt-get install -qq --no-install-recommends g++ pkg-config python3-pil >>/packages/install.log 2>&1
    sed -n "/^\`\`\`c\$/,/^\`\`\`\$/{/^\`\`\`/!p}" ../../lib/README.md >/packages/robot.c
    cc -std=c99 /packages/robot.c -lvlp_positioning -o /packages/robot
    rendered=../paper-rig/rendered
    mkdir /packages/rig
    cp $rendered/lamps.yaml /packages/rig
    cp $rendered/true_calibration.yaml /packages/rig/calibration.yaml
    python3 -c "import sys, PIL.Image; sys.stdout.buffer.write(PIL.Image.open(sys.argv[1]).tobytes())" \
      $rendered/sample/0000.png >/packages/rig/pixels
    position=$(cd /packages/rig && /packages/robot <pixels)
    grep -F "\`$position\`" ../../lib/README.md  # as it says there
    c++ -std=c++20 -x c++ ../../tests/consumer/same_fix/same_fix.cpp -o /packages/robot \
      $(pkg-config --cflags --libs vlp-positioning)
    fixes=$(/packages/robot)
    echo "$fixes"
    [ "$(grep -c "^0 " <<<"$fixes")" = 2 ]
  fi
  if has python3-vlp; then python3 ../../lib/python/example.py .; fi
  installed=$(dpkg-query -W -f "\${Package}\n" | grep vlp)
  apt-get purge -qq $installed >>/packages/install.log 2>&1
  left=$(ls -d /usr/bin/vlp-* /usr/include/vlp /usr/lib/*/libvlp* /usr/lib/python3/dist-packages/vlp* \
    /usr/share/doc/*vlp* 2>/dev/null || true)
  [ -z "$left" ] || { echo "left behind: $left"; exit 1; }'
echo "packages.sh: $(cd "$scratch" && echo *.deb): made, installed, used, removed"
