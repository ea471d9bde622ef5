#!/bin/sh
# Installs a build tree, builds the example of a library user against it, and runs both.
# usage: check_install.sh BUILD_FOLDER
set -eu
source=$(cd "$(dirname "$0")/.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$1" --prefix "$folder/usr" >"$folder/log"
"$folder/usr/bin/pointflight" lidar list | grep -q mid360
cmake -S "$source/examples" -B "$folder/build" -G Ninja \
      -DCMAKE_PREFIX_PATH="$folder/usr" -DCMAKE_BUILD_TYPE=RelWithDebInfo >"$folder/log" 2>&1 ||
  { cat "$folder/log"; exit 1; }
cmake --build "$folder/build" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
cd "$folder"
POINTFLIGHT_DATA="$folder/usr/share/pointflight" "$folder/build/scan_a_room"
POINTFLIGHT_DATA="$folder/usr/share/pointflight" "$folder/build/step_a_flight"
"$folder/usr/bin/pointflight" map forest --size-x 24 --size-y 16 --trees 800 -o forest.pcd 2>/dev/null
"$folder/usr/bin/pointflight" map import forest.pcd -o forest.pfmap --resolution 0.1 >/dev/null 2>&1
POINTFLIGHT_DATA="$folder/usr/share/pointflight" "$folder/build/fly_with_planner" forest.pfmap \
    -o planned --seed 1 --obstacles 8
"$folder/usr/bin/pointflight" picture planned --map forest.pfmap
