#!/usr/bin/env bash
# A bare Debian in which a new user follows the docs and nothing else: the demo, an own cloud to a flight, Python, an own
# sensor, an own vehicle, an own planner from an installed prefix.
# usage: newcomer.sh [12|13 [FOLDER [test]]]   (root; the tree is kept in FOLDER for a next time, else made anew; with
# `test` also ./dev test there)
set -eu
release=${1:-12}
case $release in
  12) suite=bookworm ;;
  13) suite=trixie ;;
  *) echo "newcomer: '$release'; Debian 12 or 13" >&2; exit 2 ;;
esac
source=$(cd "$(dirname "$0")/.." && pwd)
[ "$(id -u)" = 0 ] || { echo "newcomer: needs root, for debootstrap and chroot" >&2; exit 2; }
root=${2:-}
tests=${3:-}
if [ -z "$root" ]; then
  root=$(mktemp -d)
  # the mounts below are gone with their namespace by then
  trap 'rm -rf --one-file-system "$root"' EXIT
fi
sources=/etc/apt
mark=$root/pointflight_newcomer  # a tree of ours: nothing is removed from another
if [ -e "$root" ] && [ ! -e "$mark" ] && [ -n "$(ls -A "$root")" ]; then
  echo "newcomer: '$root' is neither empty nor a tree that newcomer made; give it an empty folder" >&2
  exit 2
fi
if [ -e "$mark" ] && [ "$(cat "$mark")" != "$suite" ]; then
  echo "newcomer: '$root' is a tree of $(cat "$mark"); give another folder for $suite" >&2
  exit 2
fi
if [ ! -e "$mark" ]; then
  echo "== a bare Debian $release in $root" >&2
  mirror=$(sed -n 's/^URIs: *//p; s/^deb \(\[[^]]*\] \)\?\([^ ]*\) .*/\2/p' $sources/sources.list \
           $sources/sources.list.d/* 2>/dev/null | head -1)
  debootstrap --variant=minbase "$suite" "$root" "${mirror:-http://deb.debian.org/debian}" >/dev/null
  # the same sources of packages as here, of that release, and no others
  rm -f "$root/etc/apt/sources.list"
  for file in $sources/apt.conf.d $sources/sources.list $sources/sources.list.d $sources/auth.conf.d; do
    [ ! -e "$file" ] || cp -a "$file" "$root/etc/apt/"
  done
  here=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
  find "$root/etc/apt/sources.list" "$root/etc/apt/sources.list.d" -type f -exec sed -i "s/\b$here\b/$suite/g" {} + \
    2>/dev/null || true
  # whom this machine trusts (a firm's proxy); Debian's ca-certificates picks these up
  ! ls /usr/local/share/ca-certificates/*.crt >/dev/null 2>&1 ||
    install -D -m 644 -t "$root/usr/local/share/ca-certificates" /usr/local/share/ca-certificates/*.crt
  [ -e "$root/etc/hosts" ] || echo "127.0.0.1 localhost" >"$root/etc/hosts"  # as an installer would
  echo "$suite" >"$mark"
fi
rm -rf --one-file-system "$root/home/new"
mkdir -p "$root/home/new"
git clone -q "$source" "$root/home/new/pointflight"
for file in /etc/npmrc "$HOME/.npmrc"; do  # npm's, too
  [ ! -f "$file" ] || cp "$file" "$root${file/#$HOME/\/root}"
done
# what the user brings: a cloud of a place, as text
cat >"$root/home/new/day.sh" <<'END'
set -eux
export DEBIAN_FRONTEND=noninteractive LC_ALL=C
cd /home/new/pointflight
./dev demo
test -s build/demo/run/overview.png
cmake --install build/release >/dev/null           # README, "Install"
cd /home/new
# an own cloud to a flight: README, "Your own map"
awk 'BEGIN{srand(3); for(i=0;i<400000;i++){x=rand()*20;y=rand()*14;z=rand()*4;s=int(rand()*6);
  if(s<2)z=0; else if(s==2)x=0; else if(s==3)x=20; else if(s==4)y=0; else y=14; print x,y,z}}' >hall.xyz
pointflight map import hall.xyz -o hall.pfmap
pointflight map info hall.pfmap --png hall.png
pointflight fly hall.pfmap -o run
pointflight fly run/scenario.yaml -o again
diff -r -x timing.json run again
# from Python, with numpy alone: docs/python.md
PYTHONPATH=pointflight/build/release/python /usr/bin/python3 -c 'import re, sys
page = open("pointflight/docs/python.md").read()
exec(re.search(r"```python\n(.*?)```", page, re.S)[1].replace("forest.pfmap", "hall.pfmap").replace("28, 14", "10, 7"))'
PYTHONPATH=pointflight/build/release/python /usr/bin/python3 pointflight/examples/python/own_map.py hall.xyz hall2.pfmap
# an own sensor and vehicle, a planner outside of the tree: their pages, block by block
cd pointflight
apt-get -qq install -y --no-install-recommends python3 >/dev/null  # runs the blocks
POINTFLIGHT_INSTALLED=/usr/local tools/run_docs.py build/release \
  docs/sensors.md docs/vehicles.md docs/maps.md docs/planner.md
cmake --build build/release --target uninstall >/dev/null
test ! -e /usr/local/bin/pointflight
[ -z "${1:-}" ] || ./dev test
END
echo "== the first day" >&2
# mounts of its own, which go with it
unshare --mount --pid --fork sh -c '
  mount -t proc proc "$1/proc"
  mount --rbind /dev "$1/dev"
  mount --rbind /sys "$1/sys"
  [ ! -e /etc/resolv.conf ] || cp -L /etc/resolv.conf "$1/etc/"
  chroot "$1" bash /home/new/day.sh "$2"' sh "$root" "$tests"
