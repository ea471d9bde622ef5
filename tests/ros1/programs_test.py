#!/usr/bin/python3
"""The launch files for SLAM programs and planners, beside stubs that require what those programs
require (stub.py; their launch arguments and parameters as read from their sources).

programs_test.py PROGRAM SOURCE_FOLDER [CASE...]
"""

import ast
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
try:
    import rosgraph
    import rospy  # noqa: F401
    import sensor_msgs.point_cloud2  # noqa: F401
    import yaml
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(SKIPPED)
if not os.path.exists("/usr/bin/roslaunch"):
    print("skipped: no roslaunch here")
    sys.exit(SKIPPED)

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
HERE = os.path.dirname(os.path.abspath(__file__))

# ZJU-FAST-Lab/ego-planner-swarm, plan_manage/launch/advanced_param.xml
EGO_ARGUMENTS = """drone_id map_size_x_ map_size_y_ map_size_z_ odometry_topic camera_pose_topic
depth_topic cloud_topic cx cy fx fy max_vel max_acc planning_horizon point_num point0_x point0_y
point0_z point1_x point1_y point1_z point2_x point2_y point2_z point3_x point3_y point3_z point4_x
point4_y point4_z flight_type use_distinctive_trajs obj_num_set""".split()
# HKUST-Aerial-Robotics/FUEL, exploration_manager/launch/algorithm.xml
FUEL_ARGUMENTS = """map_size_x_ map_size_y_ map_size_z_ box_min_x box_min_y box_min_z box_max_x
box_max_y box_max_z odometry_topic sensor_pose_topic depth_topic cloud_topic cx cy fx fy max_vel
max_acc""".split()


def arguments(names):
    return "".join(f'<arg name="{name}"/>' for name in names)  # without a default: required


def parameters(pairs):
    return "".join(f'<param name="{name}" value="{value}"/>' for name, value in pairs)


EGO_XML = f"""<launch>{arguments(EGO_ARGUMENTS)}
<node pkg="ego_planner" name="drone_$(arg drone_id)_ego_planner_node" type="ego_planner_node">
<remap from="odom_world" to="/drone_$(arg drone_id)_$(arg odometry_topic)"/>
<remap from="grid_map/cloud" to="/drone_$(arg drone_id)_$(arg cloud_topic)"/>
{parameters([(f"grid_map/map_size_{a}", f"$(arg map_size_{a}_)") for a in "xyz"])}
{parameters([("grid_map/ground_height", -0.01), ("grid_map/virtual_ceil_height", 2.9),
             ("grid_map/fx", "$(arg fx)"), ("fsm/flight_type", "$(arg flight_type)"),
             ("fsm/planning_horizon", "$(arg planning_horizon)"),
             ("manager/max_vel", "$(arg max_vel)"), ("manager/max_acc", "$(arg max_acc)")])}
</node></launch>"""

FUEL_XML = f"""<launch>{arguments(FUEL_ARGUMENTS)}
<node pkg="exploration_manager" name="exploration_node" type="exploration_node">
<remap from="odom_world" to="$(arg odometry_topic)"/>
<remap from="map_ros/pose" to="$(arg sensor_pose_topic)"/>
<remap from="map_ros/depth" to="$(arg depth_topic)"/>
{parameters([(f"sdf_map/map_size_{a}", f"$(arg map_size_{a}_)") for a in "xyz"])}
{parameters([(f"sdf_map/box_{m}_{a}", f"$(arg box_{m}_{a})") for a in "xyz" for m in ("min", "max")])}
{parameters([("sdf_map/ground_height", -1.0)])}
</node></launch>"""

PACKAGES = {
    "fast_lio": ({"fastlio_mapping"}, {}),
    "point_lio": ({"pointlio_mapping"}, {}),
    "ego_planner": ({"ego_planner_node", "traj_server"}, {"launch/advanced_param.xml": EGO_XML}),
    "exploration_manager": ({"exploration_node"}, {"launch/algorithm.xml": FUEL_XML}),
    "plan_manage": ({"traj_server"}, {}),
    "waypoint_generator": ({"waypoint_generator"}, {}),
}


def make_packages(folder):
    for package, (programs, files) in PACKAGES.items():
        os.makedirs(f"{folder}/{package}/launch")
        with open(f"{folder}/{package}/package.xml", "w") as out:
            out.write(f"<package><name>{package}</name><version>0.0.0</version>"
                      "<description>a stub</description><maintainer email='a@b.c'>a</maintainer>"
                      "<license>none</license></package>")
        for program in programs:
            os.symlink(f"{HERE}/stub.py", f"{folder}/{package}/{program}")
        for name, text in files.items():
            with open(f"{folder}/{package}/{name}", "w") as out:
                out.write(text)


def write_wood(path):
    """A wood with a clearing: what lies above its crowns is larger than what lies below, as in scans
    of real ones, and masts reach up to 30 m."""
    points = []
    steps = [0.15 * i - 15.0 for i in range(201)]
    for x in steps:
        for y in steps:
            points.append((x, y, 0.0))
            if max(abs(x), abs(y)) > 4.0:
                points.append((x, y, 5.0))  # crowns
    for i in range(-18, 19):
        for j in range(-18, 19):
            x, y = 0.8 * i, 0.8 * j
            if max(abs(x), abs(y)) > 4.0:  # trunks, too close for a drone
                points += [(x + 0.03, y, 0.1 * k) for k in range(50)]
    for i in range(40):
        for x, y in ((-15, 0.75 * i - 15), (15, 0.75 * i - 15), (0.75 * i - 15, -15),
                     (0.75 * i - 15, 15)):
            points += [(x, y, 5.0 + 0.15 * k) for k in range(170)]
    with open(path, "w") as out:
        out.writelines(f"{x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in points)


class Launch:
    """roslaunch with a master of its own; ends with all it started."""

    def __init__(self, folder, words):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        self.results = tempfile.mkdtemp(dir=folder)
        self.log = open(f"{self.results}.log", "w+")
        environment = dict(
            os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1",
            ROS_HOME=f"{folder}/home", ROS_PACKAGE_PATH=f"{SOURCE}/ros_packages/catkin:{folder}/packages",
            STUB_RESULTS=self.results, STUB_HELPERS=HERE, PATH="/usr/bin:/bin",
            STUB_SIM_TIME=str("sim_time:=true" in words))
        # roslaunch gives up on a master of its own after ten seconds, which a busy machine needs
        self.master = subprocess.Popen(["/usr/bin/rosmaster", "--core", "-p", str(port)],
                                       env=environment, stdout=self.log, stderr=self.log)
        end = time.monotonic() + 120.0
        while not rosgraph.is_master_online(environment["ROS_MASTER_URI"]):
            assert self.master.poll() is None and time.monotonic() < end, "rosmaster does not start"
            time.sleep(0.1)
        self.process = subprocess.Popen(
            ["/usr/bin/roslaunch", "-p", str(port), "pointflight_ros", *words,
             f"program:={PROGRAM}", "rviz:=false"],
            env=environment, stdout=self.log, stderr=self.log)

    def wait_for(self, stubs, seconds=120.0):
        """Waits for what the stubs say; {name: fault}."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.process.poll() is None:
            if all(os.path.exists(f"{self.results}/{name}") for name in stubs):
                break
            time.sleep(0.1)
        faults = {}
        for name in stubs:
            path = f"{self.results}/{name}"
            text = open(path).read() if os.path.exists(path) else "it said nothing"
            if text != "ok":
                faults[name] = text
        return faults

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)
        self.master.kill()
        self.master.wait()
        self.log.seek(0)
        return self.log.read()


def check_ros2_files():
    """Types of the ROS 2 configurations (a double is never written as an integer, lists are of one
    type), and that the launch files name files that there are."""
    folder = f"{SOURCE}/ros_packages/ament/pointflight_ros"
    integers = {"point_filter_num", "max_iteration", "lidar_type", "scan_line", "scan_rate",
                "timestamp_unit", "interval"}

    def check(name, key, value):
        if isinstance(value, dict):
            for k, v in value.items():
                check(name, k, v)
        elif isinstance(value, list):
            assert all(isinstance(v, float) for v in value), f"{name}: {key} mixes types"
        elif isinstance(value, bool) or isinstance(value, str):
            pass
        else:
            wanted = int if key in integers else float
            assert isinstance(value, wanted), f"{name}: {key} is no {wanted.__name__}"

    for lidar in ("mid360", "avia", "velodyne", "ouster"):
        name = f"{folder}/config/fast_lio_{lidar}.yaml"
        own = yaml.safe_load(open(name))["/**"]["ros__parameters"]
        check(name, "", own)
        # what ROS 1 is told, ROS 2 is told
        ros1 = yaml.safe_load(open(f"{SOURCE}/ros_packages/catkin/pointflight_ros/config/fast_lio_{lidar}.yaml"))
        assert own == ros1, f"{name} differs from the one for ROS 1"
    launch = open(f"{folder}/launch/fast_lio.launch.py").read()
    tree = ast.parse(launch)
    profiles = next(ast.literal_eval(n.value) for n in tree.body
                    if isinstance(n, ast.Assign) and n.targets[0].id == "PROFILES")
    assert set(profiles) == {"mid360", "avia", "velodyne", "ouster"}
    for profile in profiles.values():
        assert os.path.exists(f"{SOURCE}/data/ros_profiles/{profile}.yaml"), profile


def main():
    folder = tempfile.mkdtemp()
    run = lambda *a: subprocess.run([PROGRAM, *a], check=True, capture_output=True)
    try:
        os.makedirs(f"{folder}/packages")
        make_packages(f"{folder}/packages")
        write_wood(f"{folder}/f.xyz")
        run("map", "import", f"{folder}/f.xyz", "-o", f"{folder}/f.pfmap", "--resolution", "0.2",
            "--keep-outliers")
        map_file = f"map:={folder}/f.pfmap"
        free = f"{folder}/free.yaml"
        run("scenario", "new", f"{folder}/f.pfmap", "-o", free, "--start-in=-10,-10,0.8,10,10,1.6")
        start = yaml.safe_load(open(free))["vehicles"][0]["start"]
        where = [f"init_{a}:={v}" for a, v in zip("xyz", start)]
        with_camera = f"{folder}/camera.yaml"
        run("scenario", "new", f"{folder}/f.pfmap", "-o", with_camera, "--start-in=-10,-10,0.8,10,10,1.6",
            "--lidar", f"{SOURCE}/ros_packages/catkin/pointflight_ros/config/fuel_camera.yaml")
        lio = lambda lidar, sensor: (
            ["fast_lio.launch", map_file, f"lidar:={lidar}", f"flags:=--lidar {sensor}"],
            ["fastlio_mapping"])
        cases = {
            "fast_lio_mid360": lio("mid360", "mid360"),
            "fast_lio_avia": lio("avia", "avia"),
            "fast_lio_velodyne": lio("velodyne", "vlp32c"),
            "fast_lio_ouster": lio("ouster", "os1_128"),
            "point_lio": (["point_lio.launch", map_file], ["pointlio_mapping"]),
            "ego_planner": (["ego_planner.launch", map_file], ["ego_planner_node", "traj_server"]),
            "ego_planner at half the speed": (
                ["ego_planner.launch", map_file, "sim_time:=true", "flags:=--rate 0.5"],
                ["ego_planner_node", "traj_server"]),
            "fuel": (["fuel.launch", map_file, *where],
                     ["exploration_node", "traj_server", "waypoint_generator"]),
            "fuel with the scenario's camera": (
                ["fuel.launch", f"map:={with_camera}", "lidar:=scenario", *where],
                ["exploration_node", "traj_server", "waypoint_generator"]),
        }
        failed = []
        for name, (words, stubs) in cases.items():
            if len(sys.argv) > 3 and name not in sys.argv[3:]:
                continue
            launch = Launch(folder, words)
            faults = launch.wait_for(stubs)
            said = launch.end()
            if faults:
                failed.append(name)
                print(f"{name}: {faults}\n{said}")
            else:
                print(f"{name}: {', '.join(stubs)} have what they require", flush=True)
        if len(sys.argv) <= 3 or "outside" in sys.argv[3:]:
            # a scenario that starts outside of the grid is warned of; a map without a place in it
            # ends the launch with a line
            launch = Launch(folder, ["ego_planner.launch", f"map:={free}", "map_size_x:=1.0",
                                     "map_size_y:=1.0", "start_in:=-0.5,-0.5,0.5,0.5,0.5,1.5"])
            launch.wait_for(["ego_planner_node"])
            said = launch.end()
            if "warning: drone0 starts at" not in said:
                failed.append("outside")
                print(f"no warning of a start outside:\n{said}")
            launch = Launch(folder, ["ego_planner.launch", map_file,
                                     "start_in:=100,100,0.5,110,110,1.5"])
            launch.process.wait(timeout=60)
            said = launch.end()
            if "no free place" not in said or "map import --shift" not in said:
                failed.append("elsewhere")
                print(f"a map without a start was not refused:\n{said}")
        check_ros2_files()
        print("failed: " + ", ".join(failed) if failed else "passed")
        return 1 if failed else 0
    finally:
        shutil.rmtree(folder, ignore_errors=True)


sys.exit(main())
