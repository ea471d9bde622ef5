#!/usr/bin/python3
"""Stands for a program that reads pointflight: requires what that program requires, as read from its
sources, and says what is missing. Which one it is, its own name tells (programs_test.py links it)."""

import math
import os
import sys
import time

import rosgraph
import rospy

NAME = os.path.basename(sys.argv[0])
FAULTS = []


def need(condition, words):
    if not condition:
        FAULTS.append(words)
    return condition


def collect(topic, kind, count, seconds=40.0):
    got = []
    subscriber = rospy.Subscriber(topic, kind, got.append, queue_size=100)
    end = time.monotonic() + seconds
    while len(got) < count and time.monotonic() < end:
        time.sleep(0.02)
    subscriber.unregister()
    need(len(got) >= count, f"{len(got)} of {count} messages on {topic}")
    return got[:count]


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


KINDS = {
    "bool": lambda v: isinstance(v, bool),
    "int": lambda v: isinstance(v, int) and not isinstance(v, bool),
    "number": is_number,
    "text": lambda v: isinstance(v, str),
    "vector": lambda v: isinstance(v, list) and len(v) == 3 and all(map(is_number, v)),
    "rotation": lambda v: isinstance(v, list) and len(v) == 9 and all(map(is_number, v)),
}


def parameters(prefix, kinds, required):
    """Those that the program reads, by name; what is of a wrong type it would not take."""
    values = {}
    for name, kind in kinds.items():
        value = rospy.get_param(prefix + name, None)
        if value is None:
            need(name not in required, f"parameter {prefix}{name} is missing")
            continue
        need(KINDS[kind](value), f"parameter {prefix}{name}: {value!r} is no {kind}")
        values[name] = value
    return values


def check_extrinsics(values):
    need(values.get("mapping/extrinsic_T") == [0.0, 0.0, 0.1], "extrinsic_T is not the LiDAR's place")
    rotation = values.get("mapping/extrinsic_R", [0] * 9)
    need([float(v) for v in rotation] == [1, 0, 0, 0, 1, 0, 0, 0, 1], "extrinsic_R")


F32, U8, U16, U32 = 7, 2, 4, 6  # of sensor_msgs/PointField
FIELDS = {
    2: {"x": F32, "y": F32, "z": F32, "intensity": F32, "time": F32, "ring": U16},
    3: {"x": F32, "y": F32, "z": F32, "intensity": F32, "t": U32, "reflectivity": U16, "ring": U8,
        "ambient": U16, "range": U32},
}
UNITS = {0: 1.0, 1: 1e-3, 2: 1e-6, 3: 1e-9}


def check_lidar(values):
    """What both FAST-LIO and Point-LIO do with the clouds that they are told to read."""
    import sensor_msgs.point_cloud2 as pc2
    from sensor_msgs.msg import Imu, PointCloud2

    kind = values.get("preprocess/lidar_type")
    lines = values.get("preprocess/scan_line", 0)
    need(1 <= lines <= 128, "scan_line")
    need(values.get("point_filter_num", 0) >= 1, "point_filter_num")
    topic = values.get("common/lid_topic", "")
    if kind == 1:
        message = (collect(topic, rospy.AnyMsg, 3) or [None])[-1]
        if message is None:
            return
        header = message._connection_header
        need(header["type"].endswith("/CustomMsg"), f"{topic} is a {header['type']}")
        need(header["md5sum"] == "e4d6829bdfe657cb6c21a746c86b21a6", "CustomMsg's md5")
        check_custom(message._buff, lines)
    else:
        need(kind in FIELDS, f"lidar_type {kind}")
        clouds = collect(topic, PointCloud2, 3)
        if not clouds:
            return
        cloud = clouds[-1]
        fields = {f.name: f.datatype for f in cloud.fields}
        for name, datatype in FIELDS[kind].items():
            need(fields.get(name) == datatype, f"field {name}: {fields.get(name)}, not {datatype}")
        offset = "time" if kind == 2 else "t"
        # they come in the order of their offsets
        points = [p if kind == 2 else p[::-1] for p in pc2.read_points(cloud, ("ring", offset))]
        need(len(points) > 1000, f"{len(points)} points")
        need(max(p[0] for p in points) < lines, "a ring beyond scan_line")
        need(max(p[0] for p in points) >= lines // 2, "scan_line is far above the rings")
        last = points[-1][1] * UNITS[values.get("preprocess/timestamp_unit")]
        need(0.01 < last < 0.105, f"the last point comes {last} s after the first: timestamp_unit")
    imu = collect(values.get("common/imu_topic", ""), Imu, 100)
    mean = sum(math.hypot(m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z)
               for m in imu) / max(1, len(imu))
    need(abs(mean - 9.81) < 0.3, f"accelerations of {mean} at rest")
    steps = [(b.header.stamp - a.header.stamp).to_sec() for a, b in zip(imu, imu[1:])]
    need(max(steps, default=1.0) < 0.0075, "the IMU comes seldom")


def check_custom(data, lines):
    import struct

    length = struct.unpack_from("<I", data, 12)[0]
    at = 16 + length + 8 + 4 + 1 + 3
    count = struct.unpack_from("<I", data, at)[0]
    points = [struct.unpack_from("<IfffBBB", data, at + 4 + 19 * i) for i in range(count)]
    need(count > 1000, f"{count} points")
    need(max(p[6] for p in points) == lines - 1, "scan_line is not the number of lines")
    kept = [p for p in points if p[6] < lines and (p[5] & 0x30) in (0x00, 0x10)]
    need(len(kept) == count, "points that the filter of tags and lines drops")
    need(any(p[4] > 0 for p in points), "reflectivity is 0")
    need(0.01e9 < points[-1][0] < 0.105e9, "times of points")


def fastlio_mapping():
    """hku-mars/FAST_LIO, src/laserMapping.cpp, src/preprocess.cpp: parameters in the global namespace."""
    kinds = {
        "publish/path_en": "bool", "publish/scan_publish_en": "bool",
        "publish/dense_publish_en": "bool", "publish/scan_bodyframe_pub_en": "bool",
        "max_iteration": "int", "common/lid_topic": "text", "common/imu_topic": "text",
        "common/time_sync_en": "bool", "common/time_offset_lidar_to_imu": "number",
        "filter_size_surf": "number", "filter_size_map": "number", "cube_side_length": "number",
        "mapping/det_range": "number", "mapping/fov_degree": "number", "mapping/gyr_cov": "number",
        "mapping/acc_cov": "number", "mapping/b_gyr_cov": "number", "mapping/b_acc_cov": "number",
        "preprocess/blind": "number", "preprocess/lidar_type": "int", "preprocess/scan_line": "int",
        "preprocess/timestamp_unit": "int", "preprocess/scan_rate": "int",
        "point_filter_num": "int", "feature_extract_enable": "bool",
        "runtime_pos_log_enable": "bool", "mapping/extrinsic_est_en": "bool",
        "pcd_save/pcd_save_en": "bool", "pcd_save/interval": "int",
        "mapping/extrinsic_T": "vector", "mapping/extrinsic_R": "rotation",
    }
    values = parameters("/", kinds, {"common/lid_topic", "common/imu_topic", "preprocess/lidar_type",
                                     "preprocess/scan_line", "preprocess/blind",
                                     "mapping/extrinsic_T", "mapping/extrinsic_R"})
    check_extrinsics(values)
    check_lidar(values)


def pointlio_mapping():
    """hku-mars/Point-LIO, src/parameters.cpp (iVox): parameters in the node's own namespace."""
    kinds = {name: "bool" for name in (
        "prop_at_freq_of_imu", "use_imu_as_input", "check_satu", "space_down_sample",
        "common/con_frame", "common/cut_frame", "mapping/imu_en", "mapping/extrinsic_est_en",
        "odometry/publish_odometry_without_downsample", "publish/path_en",
        "publish/scan_publish_en", "publish/scan_bodyframe_pub_en", "runtime_pos_log_enable",
        "pcd_save/pcd_save_en")}
    kinds.update({name: "int" for name in (
        "init_map_size", "point_filter_num", "common/con_frame_num", "preprocess/lidar_type",
        "preprocess/scan_line", "preprocess/scan_rate", "preprocess/timestamp_unit",
        "ivox_nearby_type", "pcd_save/interval")})
    kinds.update({name: "number" for name in (
        "mapping/satu_acc", "mapping/satu_gyro", "mapping/acc_norm", "mapping/plane_thr",
        "common/cut_frame_time_interval", "common/time_diff_lidar_to_imu", "filter_size_surf",
        "filter_size_map", "mapping/det_range", "mapping/fov_degree", "mapping/imu_time_inte",
        "mapping/lidar_time_inte", "mapping/lidar_meas_cov", "mapping/acc_cov_input",
        "mapping/vel_cov", "mapping/gyr_cov_input", "mapping/gyr_cov_output",
        "mapping/acc_cov_output", "mapping/b_gyr_cov", "mapping/b_acc_cov",
        "mapping/imu_meas_acc_cov", "mapping/imu_meas_omg_cov", "preprocess/blind",
        "mapping/match_s", "mapping/ivox_grid_resolution")})
    kinds.update({"common/lid_topic": "text", "common/imu_topic": "text",
                  "mapping/gravity": "vector", "mapping/gravity_init": "vector",
                  "mapping/extrinsic_T": "vector", "mapping/extrinsic_R": "rotation"})
    own = rospy.get_name() + "/"
    values = parameters(own, kinds, {
        "common/lid_topic", "common/imu_topic", "common/time_diff_lidar_to_imu",
        "mapping/gravity", "mapping/gravity_init", "mapping/extrinsic_T", "mapping/extrinsic_R",
        "mapping/acc_norm", "mapping/satu_acc", "mapping/ivox_grid_resolution", "ivox_nearby_type",
        "preprocess/lidar_type", "preprocess/scan_line"})
    for name in rospy.get_param_names():
        if name.startswith(own):
            need(name[len(own):] in kinds, f"parameter {name} is one that it does not know")
    need(values.get("mapping/ivox_grid_resolution") == 2.0, "ivox_grid_resolution")
    need(values.get("ivox_nearby_type") in (0, 6, 18, 26), "ivox_nearby_type")
    need(abs(values.get("mapping/acc_norm", 0) - 9.81) < 0.01, "acc_norm is not in the IMU's unit")
    need(values.get("mapping/satu_acc", 0) > 15, "satu_acc is below what gravity does")
    check_extrinsics(values)
    check_lidar(values)


def odometry_on(topic):
    from nav_msgs.msg import Odometry

    got = collect(topic, Odometry, 5)
    return got[-1] if got else None


def ego_planner_node():
    """ZJU-FAST-Lab/ego-planner-swarm, plan_env/src/grid_map.cpp, ego_replan_fsm.cpp."""
    from sensor_msgs.msg import PointCloud2

    p = lambda name: rospy.get_param("~" + name)
    size = [p(f"grid_map/map_size_{axis}") for axis in "xyz"]
    ground, ceiling = p("grid_map/ground_height"), p("grid_map/virtual_ceil_height")
    top = min(ground + size[2], ceiling)
    need(p("fsm/flight_type") in (1, 2), "flight_type")
    for name in ("manager/max_vel", "manager/max_acc", "fsm/planning_horizon", "grid_map/fx"):
        need(p(name) > 0, name)
    odometry = odometry_on(rospy.remap_name("odom_world"))
    if odometry:
        at = odometry.pose.pose.position
        need(abs(at.x) < size[0] / 2 and abs(at.y) < size[1] / 2,
             f"it starts at ({at.x:.1f}, {at.y:.1f}), outside of the grid")
        need(ground + 0.3 < at.z < top - 0.3, f"it starts {at.z:.2f} m up: nothing is planned there")
        need(odometry.header.frame_id == "world", "odometry's frame")
    need(ground < 1.0 < top, "goals are 1 m up")
    clouds = collect(rospy.remap_name("grid_map/cloud"), PointCloud2, 2)
    if clouds:
        fields = {f.name: f.datatype for f in clouds[-1].fields}
        need(all(fields.get(axis) == F32 for axis in "xyz"), "the cloud's fields")
        need(clouds[-1].header.frame_id == "world", "the cloud's frame")


def exploration_node():
    """HKUST-Aerial-Robotics/FUEL, plan_env/src/sdf_map.cpp, map_ros.cpp, frontier_finder.cpp."""
    from geometry_msgs.msg import PoseStamped
    from sensor_msgs.msg import Image

    p = lambda name: rospy.get_param("~" + name)
    size = [p(f"sdf_map/map_size_{axis}") for axis in "xyz"]
    low = [-size[0] / 2, -size[1] / 2, p("sdf_map/ground_height")]
    box_low = [p(f"sdf_map/box_min_{axis}") for axis in "xyz"]
    box_high = [p(f"sdf_map/box_max_{axis}") for axis in "xyz"]
    for i in range(3):
        need(low[i] + 0.1 <= box_low[i] < box_high[i] <= low[i] + size[i] - 0.1,
             f"the box leaves the map along {'xyz'[i]}")
    need(box_high[2] > 1.0, "the box is too low for frontiers")
    odometry = odometry_on(rospy.remap_name("odom_world"))
    if odometry:
        at = odometry.pose.pose.position
        for axis, a, lo, hi in zip("xyz", (at.x, at.y, at.z), box_low, box_high):
            need(lo < a < hi, f"it starts outside of the box: {axis} = {a:.2f}")
    depths = collect(rospy.remap_name("map_ros/depth"), Image, 5)
    poses = collect(rospy.remap_name("map_ros/pose"), PoseStamped, 30)
    if depths and poses:
        depth = depths[-1]
        need((depth.width, depth.height) == (640, 480), "the picture's size")
        need(depth.encoding == "32FC1", "the picture's encoding")
        stamps = {m.header.stamp for m in poses}
        need(any(d.header.stamp in stamps for d in depths) or
             min(abs((d.header.stamp - s).to_sec()) for d in depths for s in stamps) < 0.05,
             "no pose has a picture's stamp")


def traj_server():
    """Both planners': flies where it is told by PositionCommand."""
    import genpy.dynamic
    from position_command import VARIANTS

    init = [rospy.get_param(f"~traj_server/init_{axis}", None) for axis in "xyz"]
    topic = "/drone_0_visual_slam/odom" if init[0] is None else "/state_ukf/odom"
    odometry = odometry_on(topic)
    if odometry is None:
        return
    at = odometry.pose.pose.position
    if init[0] is not None:
        need(max(abs(a - b) for a, b in zip((at.x, at.y, at.z), init)) < 0.1,
             f"init_* is {init}, the vehicle is at ({at.x:.2f}, {at.y:.2f}, {at.z:.2f})")
    kind = genpy.dynamic.generate_dynamic("quadrotor_msgs/PositionCommand", VARIANTS["short"][0])
    kind = kind["quadrotor_msgs/PositionCommand"]
    publisher = rospy.Publisher("position_cmd" if init[0] is None else "/position_cmd", kind,
                                queue_size=10)
    command = kind()
    command.header.frame_id = "world"
    command.position.x, command.position.y, command.position.z = at.x, at.y, at.z + 0.3
    end = time.monotonic() + 20.0
    while time.monotonic() < end:
        publisher.publish(command)
        time.sleep(0.01)
        if int(100 * (end - time.monotonic())) % 50 == 0:
            now = odometry_on(topic)
            if now and now.pose.pose.position.z > at.z + 0.25:
                return
    need(False, "the vehicle does not fly where PositionCommand says")


def waypoint_generator():
    need(rospy.get_param("~waypoint_type", None) == "point", "waypoint_type")


def main():
    sys.path.insert(0, os.environ["STUB_HELPERS"])
    rospy.init_node(NAME, disable_signals=True)
    need(rosgraph.is_master_online(), "no master")
    try:
        if rospy.get_param("/use_sim_time", False):
            collect("/clock", rospy.AnyMsg, 3)
        need(os.environ["STUB_SIM_TIME"] == str(rospy.get_param("/use_sim_time", False)), "/use_sim_time")
        globals()[NAME]()
    except Exception as error:  # noqa: BLE001: whatever it is, it is what is wrong
        FAULTS.append(f"{type(error).__name__}: {error}")
    result = os.environ["STUB_RESULTS"] + "/" + NAME
    with open(result + ".partial", "w") as out:
        out.write("\n".join(FAULTS) if FAULTS else "ok")
    os.replace(result + ".partial", result)  # nobody shall read half of it
    while True:  # as the program would
        time.sleep(1)


main()
