#!/bin/sh
# Rules that no compiler checks. Prints each breach; exit status 1 if there is any.
cd "$(dirname "$0")/.." || exit 2
failed=0
breach() {
  printf '%s\n' "$1" | sed 's/^/  /'
  failed=1
}

# Includes go down the floors only: a folder may use what stands after the colon, and itself.
ground="core geometry io"
step="$ground map map/import render lidar vehicle world scenes sim"
allowed() {
  case $1 in
    core) ;;
    geometry) echo "core" ;;
    io) echo "core geometry" ;;
    map) echo "$ground" ;;
    map/import | map/edit) echo "$ground map" ;;
    render) echo "core geometry map" ;;
    gpu) echo "$ground map map/import render gpu/kernel gpu/kernels" ;;
    lidar) echo "$ground map render" ;;
    vehicle) echo "$ground" ;;
    world) echo "$ground map map/import" ;;
    survey) echo "$ground map map/import map/edit render lidar" ;;
    scenes) echo "$ground map/import map" ;;
    fidelity) echo "$ground map render lidar survey scenes" ;;
    sim) echo "$step" ;;
    learn) echo "$step run" ;;
    sitl) echo "$step run" ;;
    flight_log) echo "$step" ;;
    run) echo "$step" ;;
    picture) echo "$step run flight_log survey fidelity" ;;
    ros/common) echo "$step run" ;;
    ros/ros1) echo "ros/common" ;;
    ros/ros2) echo "core ros/common" ;;
    recording) echo "$ground survey ros/common" ;;
    campaign) echo "$ground map sim" ;;
    campaign/mpi) echo "campaign" ;;
    view) echo "$ground map lidar vehicle sim run ros/common" ;;
    share) echo "$ground vehicle world sim run ros/common" ;;
    share/dds) echo "ros/common ros/ros2 share" ;;
    *) echo "a folder without a floor" ;;
  esac
}
# room FOLDER: of which floor it is a part
room() { sed -E 's#/(internal|patterns|controllers|messages|parts|worlds)$##; s#/(internal|patterns|controllers|messages|parts|worlds)/#/#'; }
for folder in $(git ls-files 'pointflight/*.hpp' 'pointflight/*.cpp' | sed -E 's#^pointflight/(.*)/[^/]*$#\1#' | room | sort -u); do
  for used in $(for part in "" /internal /patterns /controllers /messages /parts /worlds; do
                  cat pointflight/"$folder$part"/*.[ch]pp 2>/dev/null
                done | sed -nE 's#^ *\#include "(pointflight/)?([a-z_0-9/]+)/[^/]*"#\2#p' | room | sort -u); do
    case " $folder $(allowed "$folder") " in
      *" $used "*) ;;
      *) breach "pointflight/$folder includes $used: an arrow that goes up (docs/architecture.md)" ;;
    esac
  done
done

# ROS 1's headers do not compile as C++20: its library sees bytes and names only.
found=$(grep -rhoE '#include "pointflight/ros/common/[a-z_.]+' pointflight/ros/ros1 | sort -u | grep -v 'pointflight/ros/common/wire.hpp')
[ -z "$found" ] || { echo "ros1 includes more than pointflight/ros/common/wire.hpp:"; breach "$found"; }

# The path from seed to output must give the same bits on every CPU: no libm transcendentals there.
found=$(grep -rnE '(std::|[^a-zA-Z_:.>])(sin|cos|tan|asin|acos|atan|atan2|exp|exp2|log|log2|log10|pow|sinh|cosh|tanh)f?\(' \
        pointflight --include='*.cpp' --include='*.hpp' | grep -vE '^pointflight/(view|picture|ros/ros1)/' | sed 's,//.*,,' | grep -E '(sin|cos|tan|exp|exp2|log|log2|log10|pow|atan|atan2)f?\(' | grep -vE 'math::|core/math.hpp')
[ -z "$found" ] || { echo "libm instead of core/math.hpp:"; breach "$found"; }
found=$(grep -rnE 'AngleAxis|slerp|computeDirect\(|<random>' pointflight --include='*.cpp' --include='*.hpp' |
        grep -vE '^pointflight/(view|picture)/|:[0-9]*: *//|//.*(slerp|computeDirect|AngleAxis)')
[ -z "$found" ] || { echo "calls libm or <random>:"; breach "$found"; }

# The core reads no wall clock (runs and firmwares do: their waits are around the steps) and prints nothing.
found=$(grep -rnE 'system_clock|steady_clock|time\(nullptr|std::(cout|cerr)|fmt::print|printf\(' \
        pointflight --include='*.cpp' --include='*.hpp' |
        grep -vE '^pointflight/(run|sitl)/.*steady_clock|^pointflight/(view|campaign|share/dds|ros/ros[12])/')
[ -z "$found" ] || { echo "wall clock or printing in the library:"; breach "$found"; }

# What is removed or renamed goes through core/folder (by a list, never through a link); core/locked_file takes away
# and names what it holds open. Empty folders that we made ourselves may go by rmdir.
found=$(grep -rnE 'remove_all|(fs|filesystem)::(remove|rename)\(|std::(remove|rename)\(|\bunlink(at)?\(|renameat2?\(' \
        apps pointflight --include='*.cpp' --include='*.hpp' |
        grep -vE '^pointflight/(core/(folder|locked_file|scratch)|ros/ros1/bag)\.cpp:|::(remove|rename)\([a-z_]+\.(begin|rbegin)')
[ -z "$found" ] || { echo "removes or renames files beside core/folder and core/locked_file:"; breach "$found"; }

# Public headers: std and Eigen only, so that a user needs no other headers.
found=$(grep -rnE '#include <(fmt|yaml-cpp|nlohmann|tbb|oneapi|nanoflann|xxhash|lzf|liblzf|assimp|Random123|hwy|lzma|boost|zip\.h|sqlite3|tinyxml2)' \
        pointflight --include='*.hpp' | grep -vE 'io/byte_cursor.hpp|-inl.hpp|share/dds/|ros/ros[12]/')
[ -z "$found" ] || { echo "third-party headers in public headers:"; breach "$found"; }

# Pages for users say what is; what was before is in CHANGELOG.md.
found=$(grep -nE '(an|the) other day|on another day|stood then|used to (be|cost|take)|before this change' README.md docs/*.md |
        grep -v '^docs/architecture.md:')
[ -z "$found" ] || { echo "a page for users tells of changes:"; breach "$found"; }

# Each source includes its own header first, so that headers compile alone.
for source in $(git ls-files 'pointflight/*.cpp' 'apps/*.cpp'); do
  [ -f "${source%.cpp}.hpp" ] || continue
  case $(grep -m1 '^#include' "$source") in
    "#include \"${source%.cpp}.hpp\"") ;;
    *) breach "$source does not include its own header first" ;;
  esac
done

exit $failed
