#!/bin/sh
# Installs a build tree, moves it, builds the examples of a library user against it, runs all of it from
# elsewhere, and uninstalls. usage: check_install.sh BUILD_FOLDER
set -eu
source=$(cd "$(dirname "$0")/.." && pwd)
build=$(cd "$1" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
unset POINTFLIGHT_DATA
fail() {
  echo "check_install: $*" >&2
  exit 1
}

cmake --install "$build" --prefix "$folder/first" >"$folder/log"
for file in bin/pointflight share/man/man1/pointflight.1 share/bash-completion/completions/pointflight \
            share/pointflight/lidars/mid360.yaml; do
  [ -f "$folder/first/$file" ] || fail "$file was not installed"
done
[ "$(ls "$folder/first/include")" = pointflight ] || fail "headers lie outside of include/pointflight"
mv "$folder/first" "$folder/usr"  # a prefix that no build has heard of
cd "$folder"
usr/bin/pointflight lidar list | grep -q mid360

# a program with nothing but what README and docs/planner.md say: the compiler's own standard, no paths
mkdir user
cat >user/CMakeLists.txt <<'END'
cmake_minimum_required(VERSION 3.21)
project(mine LANGUAGES CXX)
find_package(pointflight REQUIRED)
add_executable(mine mine.cpp)
target_link_libraries(mine PRIVATE pointflight::sim)
add_executable(draws draws.cpp)
target_link_libraries(draws PRIVATE pointflight::picture)
END
cat >user/mine.cpp <<'END'
#include <cstdio>

#include "pointflight/core/resources.hpp"
#include "pointflight/sim/scenario.hpp"

int main() { std::printf("%s\n", pointflight::data_folder().c_str()); }
END
cat >user/draws.cpp <<'END'
#include "pointflight/picture/canvas.hpp"

int main() {
  using namespace pointflight::picture;
  Canvas canvas(40, 30, kPaper);
  canvas.dot(20.0, 15.0, 5.0, kInk);
  canvas.save("dot.png");
}
END
for of in user "$source/examples"; do
  { cmake -S "$of" -B "$folder/build" -G Ninja -DCMAKE_PREFIX_PATH="$folder/usr" \
          -DCMAKE_BUILD_TYPE=RelWithDebInfo && cmake --build "$folder/build"; } >"$folder/log" 2>&1 ||
    { cat "$folder/log"; exit 1; }
  [ "$of" = user ] || continue
  found=$(build/mine)
  build/draws && [ -s dot.png ] || fail "a program that links pointflight::picture draws nothing"
  [ "$found" = "$folder/usr/share/pointflight" ] || fail "a program found its data in $found"
  rm -r build
done
build/scan_a_room
build/step_a_flight
# as somebody builds for his own processor
if grep -qs avx2 /proc/cpuinfo; then
  { cmake -S "$source/examples" -B "$folder/newer" -G Ninja -DCMAKE_PREFIX_PATH="$folder/usr" \
          -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS=-march=x86-64-v3 &&
    cmake --build "$folder/newer" --target step_a_flight scan_a_room; } >"$folder/log" 2>&1 ||
    { cat "$folder/log"; exit 1; }
  newer/step_a_flight && newer/scan_a_room || fail "a program for newer processors fails"
fi
build/own_parts
usr/bin/pointflight bag info own_parts.mcap | grep -q /drone0/pressure ||
  fail "a message that a program has added was not recorded"
usr/bin/pointflight map forest --size-x 24 --size-y 16 --trees 800 -o forest.pcd 2>/dev/null
usr/bin/pointflight map import forest.pcd -o forest.pfmap --resolution 0.1 >/dev/null 2>&1
build/fly_with_planner forest.pfmap -o planned --seed 1 --obstacles 8
usr/bin/pointflight picture planned

# everything goes again, but what others have put there
cmake --install "$build" --prefix "$folder/gone" >"$folder/log"
uninstall() {
  cmake -D MANIFEST="$build/installed.txt" -P "$source/cmake/uninstall.cmake" >"$folder/log" 2>&1
}
touch gone/bin/precious
uninstall || fail "the uninstaller failed: $(cat log)"
left=$(find gone -type f)
[ "$left" = gone/bin/precious ] || fail "the uninstaller left: $left"
[ ! -e gone/share/pointflight ] && [ ! -e gone/include/pointflight ] || fail "folders were left"
[ -d gone/share ] || fail "a folder went that others use"

# a file in the place of ours, a folder behind a link, names that globs miss
cmake --install "$build" --prefix "$folder/again" >"$folder/log"
mkdir mine
echo mine >mine/mid360.yaml
cp again/share/pointflight/lidars/avia.yaml mine/
mv again/share/pointflight/lidars elsewhere
ln -s "$folder/mine" again/share/pointflight/lidars
echo mine >again/share/pointflight/vehicles/quad_330.yaml
touch "again/include/pointflight/core/$(printf 'a;b\nc[')" again/include/pointflight/.hidden
uninstall || fail "the uninstaller failed: $(cat log)"
[ "$(cat mine/mid360.yaml)" = mine ] && [ -f mine/avia.yaml ] || fail "a folder behind a link was emptied"
[ -L again/share/pointflight/lidars ] || fail "somebody's link went"
[ "$(cat again/share/pointflight/vehicles/quad_330.yaml)" = mine ] || fail "somebody's file went"
[ "$(find again -type f -print0 | tr -dc '\000' | wc -c)" = 3 ] || fail "it left: $(find again -type f)"
