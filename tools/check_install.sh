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
