#!/bin/sh
# Rules that no compiler checks. Prints each breach; exit status 1 if there is any.
cd "$(dirname "$0")/.." || exit 2
failed=0
breach() {
  printf '%s\n' "$1" | sed 's/^/  /'
  failed=1
}

# Includes go down the floors only: a folder may use what stands after the colon.
allowed() {
  case $1 in
    core) echo "core" ;;
    geometry) echo "core geometry" ;;
    io) echo "core geometry io" ;;
    map) echo "core geometry io map" ;;
    render) echo "core geometry map render" ;;
    lidar) echo "core geometry io map render lidar" ;;
    vehicle) echo "core geometry io vehicle" ;;
    fit) echo "core geometry io map render lidar fit" ;;
    fidelity) echo "core geometry io map render lidar fit fidelity" ;;
    world) echo "core geometry io map world" ;;
    sim) echo "core geometry io map render lidar vehicle world sim" ;;
    run) echo "core geometry io map render lidar vehicle world sim run" ;;
    ros_common) echo "core geometry io map render lidar vehicle world sim run ros_common" ;;
    ros1) echo "ros_common ros1" ;;
    ros2) echo "core ros_common ros2" ;;
    recording) echo "core geometry io fit ros_common recording" ;;
    campaign) echo "core geometry io map sim campaign" ;;
    mpi) echo "campaign mpi" ;;
    view) echo "core geometry io map lidar vehicle sim run ros_common view" ;;
    share) echo "core geometry io vehicle world sim run ros_common share" ;;
    dds) echo "ros_common ros2 share dds" ;;
  esac
}
for folder in core geometry io map render lidar vehicle world fit fidelity sim run ros_common recording campaign mpi view share dds ros1 ros2; do
  where=pointflight/$folder
  [ -d "$where" ] || where=$folder
  for used in $(grep -rhoE '#include "(pointflight/[a-z_]+|apps|tests|examples|ros_common|recording|campaign|mpi|view|share|dds|ros1|ros2)/' "$where" |
                sed 's/.*"//; s/^pointflight\///; s/\/$//' | sort -u); do
    case " $(allowed "$folder") " in
      *" $used "*) ;;
      *) breach "$where includes $used: an arrow that goes up (docs/architecture.md)" ;;
    esac
  done
done

# ROS 1's headers do not compile as C++20: its library sees bytes and names only.
found=$(grep -rhoE '#include "ros_common/[a-z_.]+' ros1 | sort -u | grep -v 'ros_common/wire.hpp')
[ -z "$found" ] || { echo "ros1 includes more than ros_common/wire.hpp:"; breach "$found"; }

# The path from seed to output must give the same bits on every CPU: no libm transcendentals there.
found=$(grep -rnE '(std::|[^a-zA-Z_:.>])(sin|cos|tan|asin|acos|atan|atan2|exp|exp2|log|log2|log10|pow|sinh|cosh|tanh)f?\(' \
        pointflight ros_common recording campaign share --include='*.cpp' --include='*.hpp' | sed 's,//.*,,' | grep -E '(sin|cos|tan|exp|exp2|log|log2|log10|pow|atan|atan2)f?\(' | grep -vE 'math::|core/math.hpp')
[ -z "$found" ] || { echo "libm instead of core/math.hpp:"; breach "$found"; }
found=$(grep -rnE 'AngleAxis|slerp|computeDirect\(|<random>' pointflight ros_common recording share --include='*.cpp' --include='*.hpp' |
        grep -vE ':[0-9]*: *//|//.*(slerp|computeDirect|AngleAxis)')
[ -z "$found" ] || { echo "calls libm or <random>:"; breach "$found"; }

# The core reads no wall clock (runs do: their pace is a wait around the steps) and prints nothing.
found=$(grep -rnE 'system_clock|steady_clock|time\(nullptr|std::(cout|cerr)|fmt::print|printf\(' \
        pointflight ros_common recording share --include='*.cpp' --include='*.hpp' |
        grep -vE '^pointflight/run/.*steady_clock')
[ -z "$found" ] || { echo "wall clock or printing in the library:"; breach "$found"; }

# What is removed or renamed goes through core/folder (by a list, never through a link); core/locked_file takes away
# and names what it holds open. Empty folders that we made ourselves may go by rmdir.
found=$(grep -rnE 'remove_all|(fs|filesystem)::(remove|rename)\(|std::(remove|rename)\(|\bunlink(at)?\(|renameat2?\(' \
        apps pointflight campaign recording view share ros_common ros1 ros2 dds mpi --include='*.cpp' --include='*.hpp' |
        grep -vE '^(pointflight/core/(folder|locked_file|scratch)|ros1/bag)\.cpp:|::(remove|rename)\([a-z_]+\.(begin|rbegin)')
[ -z "$found" ] || { echo "removes or renames files beside core/folder and core/locked_file:"; breach "$found"; }

# Public headers: std and Eigen only, so that a user needs no other headers.
found=$(grep -rnE '#include <(fmt|yaml-cpp|nlohmann|tbb|oneapi|nanoflann|xxhash|lzf|liblzf|assimp|Random123|hwy|lzma|boost)' \
        pointflight ros_common recording campaign view share --include='*.hpp' | grep -vE 'io/byte_cursor.hpp|-inl.hpp')
[ -z "$found" ] || { echo "third-party headers in public headers:"; breach "$found"; }

# Each source includes its own header first, so that headers compile alone.
for source in $(git ls-files 'pointflight/*.cpp' 'apps/*.cpp' 'ros_common/*.cpp' 'recording/*.cpp' 'campaign/*.cpp' 'view/*.cpp' 'share/*.cpp' 'dds/*.cpp' 'ros1/*.cpp' 'ros2/*.cpp'); do
  [ -f "${source%.cpp}.hpp" ] || continue
  case $(grep -m1 '^#include' "$source") in
    "#include \"${source%.cpp}.hpp\"") ;;
    *) breach "$source does not include its own header first" ;;
  esac
done

exit $failed
