#!/bin/sh
# The packages of ros_packages/ by Debian's catkin and ament: do they build, do the launch files start what they
# say? packages_test.sh PROGRAM SOURCE_FOLDER
set -eu
program=$1
ros=$2/ros_packages
PATH=/usr/bin:/bin
export PATH ROS_VERSION=1
unset ROS_DISTRO CMAKE_PREFIX_PATH
for needed in /usr/bin/catkin_make /usr/share/message_generation /usr/share/geometry_msgs/msg \
    /usr/share/ament_cmake /usr/bin/roslaunch; do
  [ -e "$needed" ] || { echo "skipped: no $needed here"; exit 77; }
done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { echo "$*" >&2; exit 1; }

# ROS 2
cmake -S "$ros/ament/pointflight_ros" -B "$folder/ament" -DCMAKE_INSTALL_PREFIX="$folder/ament_install" \
  >"$folder/log" 2>&1 && cmake --install "$folder/ament" >>"$folder/log" 2>&1 ||
  { cat "$folder/log"; fail "the ament package does not build"; }
for file in launch/fly.launch.py launch/fast_lio.launch.py launch/glim.launch.py \
    launch/kiss_icp.launch.py rviz/pointflight.rviz config/fast_lio_mid360.yaml \
    config/fast_lio_avia.yaml config/fast_lio_velodyne.yaml config/fast_lio_ouster.yaml \
    config/glim/config_ros.json; do
  [ -f "$folder/ament_install/share/pointflight_ros/$file" ] || fail "ament: no $file"
done
for file in "$ros"/ament/pointflight_ros/launch/*.py; do
  python3 -c 'import ast, sys; ast.parse(open(sys.argv[1]).read())' "$file"
done

# ROS 1
mkdir -p "$folder/ws/src"
cp -r "$ros/catkin/pointflight_ros" "$ros"/messages/* "$folder/ws/src"
(cd "$folder/ws" && catkin_make -DPYTHON_EXECUTABLE=/usr/bin/python3 install >"$folder/log" 2>&1) ||
  { cat "$folder/log"; fail "the catkin packages do not build"; }
set +u
. "$folder/ws/install/setup.sh"
set -u
sums=$(PYTHONPATH=$folder/ws/install/lib/python3/dist-packages:${PYTHONPATH:-} python3 -c '
import mars_quadrotor_msgs.msg as m, quadrotor_msgs.msg as q
print(q.PositionCommand._md5sum, q.TakeoffLand._md5sum, m.PositionCommand._md5sum)')
[ "$sums" = "4712f0609ca29a79af79a35ca3e3967a b30b3b93263aae01746755d3b8ff620f \
d008e86de36e11deb1e4033ac2c394a9" ] || fail "the messages have other md5 sums: $sums"

# a flight by its launch file, a topic by its name
"$program" map forest --size-x 12 --size-y 12 -o "$folder/f.pcd" >/dev/null 2>&1
"$program" map import "$folder/f.pcd" -o "$folder/f.pfmap" >/dev/null 2>&1
port=$((20000 + $$ % 12000))  # below those that the kernel gives away
export ROS_MASTER_URI=http://127.0.0.1:$port ROS_IP=127.0.0.1 ROS_HOME="$folder/home"
roslaunch -p "$port" pointflight_ros fly.launch map:="$folder/f.pfmap" rviz:=false \
  program:="$program" >"$folder/launch.log" 2>&1 &
launch=$!
sleep 2  # the master
stamp=$(timeout 30 rostopic echo -n 1 /drone0/odom/header/frame_id 2>/dev/null | head -1) || true
kill -INT $launch
wait $launch || true
[ "$stamp" = '"world"' ] || [ "$stamp" = world ] ||
  { cat "$folder/launch.log"; fail "roslaunch: no odometry but '$stamp'"; }
grep -q "end  *interrupted" "$folder/launch.log" || fail "the flight was not ended by roslaunch"
echo "catkin, ament, roslaunch: as they should be"
