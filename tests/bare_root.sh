#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs a command in a bare root of a Debian release, made by debootstrap: what a user with nothing but
# git and a network sees. What is committed is cloned to /vlp there, which is where the command starts.
# Only the superuser can. Nothing stays but the folders that are named, and no process.
#
#   tests/bare_root.sh [--root DIR] [--ccache DIR] [--bind DIR PLACE] RELEASE COMMAND
#
#   tests/bare_root.sh bookworm scripts/demo.sh
#   tests/bare_root.sh trixie 'scripts/setup.sh --batch && scripts/test.sh'
#
#   --root DIR     make the root there, and keep it; one that is there already is used as it is, with
#                  the clone brought to what is committed now (default: a temporary one)
#   --ccache DIR   compile with this cache (default: without one)
#   --bind DIR PLACE
#                  have this folder there, too, at PLACE
#
# Exit code: the command's; 75 when there is no root: no debootstrap, not the superuser, no mirror.
set -euo pipefail
project=$(cd "$(dirname "$0")/.." && pwd)
readonly no_root=75

usage() {
  sed -n '5,/^set/p' "$0" | sed '$d; s/^# \{0,1\}//'
}
refuse() {  # CODE MESSAGE
  echo "bare_root.sh: $2" >&2
  exit "$1"
}
root='' ccache='' bind='' place=''
while [[ ${1:-} == -* ]]; do
  case $1 in
    --root | --ccache) [ $# -gt 1 ] || refuse 2 "$1 wants a folder" ;;&
    --root) root=$2; shift 2 ;;
    --ccache) ccache=$2; shift 2 ;;
    --bind) [ $# -gt 2 ] || refuse 2 "--bind wants a folder and its place"
            bind=$(realpath "$2") place=$3; shift 3 ;;
    -h | --help) usage; exit ;;
    *) refuse 2 "unknown option $1; see bare_root.sh --help" ;;
  esac
done
[ $# = 2 ] || { usage >&2; exit 2; }
release=$1 command=$2
[ "$(id -u)" = 0 ] || refuse $no_root "only the superuser can make a root"
for tool in debootstrap unshare; do
  [ -n "$(command -v $tool)" ] || refuse $no_root "$tool is missing; scripts/setup.sh installs it"
done
unshare --mount true 2>/dev/null || refuse $no_root "this machine lets nobody mount: no root can be made"

seconds_since() { echo $(((${EPOCHREALTIME//[!0-9]/} - $1) / 1000000)); }

child='' temporary=''
log=$(mktemp)  # of debootstrap
clean_up() {
  [ -z "$child" ] || kill -9 "$child" 2>/dev/null || true
  wait
  rm -f "$log"
  [ -z "$temporary" ] || rm -rf --one-file-system "$root"
}
trap clean_up EXIT
trap 'exit 143' TERM INT
if [ -z "$root" ]; then
  root=$(mktemp --directory --tmpdir "bare-$release-XXXXXX") temporary=yes
  chmod 755 "$root"  # apt and PostgreSQL are not the superuser's there
fi
mkdir -p "$root" ${ccache:+"$ccache"}
root=$(realpath "$root")
if [ -e "$root/made" ]; then
  [ "$(<"$root/made")" = "$release" ] || refuse 2 "$root: is of another release than $release"
else
  begin=${EPOCHREALTIME//[!0-9]/}
  if ! debootstrap --include=git,ca-certificates "$release" "$root" >"$log" 2>&1; then
    tail -n 5 "$log" >&2
    refuse $no_root "no root of $release could be made; see above"
  fi
  echo "$release" >"$root/made"
  echo "bare_root.sh: $release, made in $(seconds_since "$begin") s"
fi
rm -rf "$root/vlp.git"
git clone --quiet --bare --no-hardlinks "$project" "$root/vlp.git"
begin=${EPOCHREALTIME//[!0-9]/} code=0
unshare --mount --pid --fork --kill-child "$BASH" -euo pipefail -s \
  "$root" "${ccache:+$(realpath "$ccache")}" "$command" "${CI:-}" "$bind" "$place" <<'INSIDE' &
# Mounts and processes are of a namespace that ends with the command.
root=$1 ccache=$2 command=$3 ci=$4 bind=$5 place=$6
mount --make-rprivate /
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
mount --rbind /dev "$root/dev"
settings=(${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"}
          HOME=/root LANG=C.UTF-8 TERM=dumb ${ci:+CI="$ci"}
          PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin)
if [ -n "$ccache" ]; then
  mkdir -p "$root/ccache"
  mount --bind "$ccache" "$root/ccache"
  settings+=(CCACHE_DIR=/ccache)
else
  settings+=(CCACHE_DISABLE=1)
fi
if [ -n "$bind" ]; then
  mkdir -p "$root/$place"
  mount --bind "$bind" "$root/$place"
fi
exec chroot "$root" /usr/bin/env -i "${settings[@]}" /bin/bash -euo pipefail -c '
  if [ -d /vlp ]; then
    cd /vlp
    git fetch --quiet origin HEAD
    git reset --quiet --hard FETCH_HEAD
  else
    git clone --quiet /vlp.git /vlp
    cd /vlp
  fi
  eval "$1"' bash "$command" </dev/null
INSIDE
child=$!
wait "$child" || code=$?
child=''
echo "bare_root.sh: $release, '$command' ended with exit code $code after $(seconds_since "$begin") s"
exit "$code"
