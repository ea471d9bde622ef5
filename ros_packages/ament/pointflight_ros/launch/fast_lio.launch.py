"""FAST-LIO2 (hku-mars/FAST_LIO, branch ROS2) beside pointflight.

ros2 launch pointflight_ros fast_lio.launch.py map:=s.yaml lidar:=mid360
lidar: mid360, avia, velodyne (vlp32c) or ouster (os1_128): what the scenario carries.
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


PROFILES = {"mid360": "livox", "avia": "livox", "velodyne": "velodyne", "ouster": "ouster"}


def start(context):
    share = get_package_share_directory("pointflight_ros")
    lidar = LaunchConfiguration("lidar").perform(context)
    simulated = LaunchConfiguration("sim_time").perform(context).lower() == "true"
    return [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(os.path.join(share, "launch", "fly.launch.py")),
            launch_arguments={
                "map": LaunchConfiguration("map"),
                "flags": LaunchConfiguration("flags"),
                "program": LaunchConfiguration("program"),
                "sim_time": LaunchConfiguration("sim_time"),
                "profile": PROFILES[lidar],
                "rviz": "false",
            }.items(),
        ),
        Node(
            package="fast_lio",
            executable="fastlio_mapping",
            parameters=[
                os.path.join(share, "config", f"fast_lio_{lidar}.yaml"),
                {"use_sim_time": simulated},
            ],
            output="screen",
        ),
    ]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="a scenario .yaml with a mission"),
            DeclareLaunchArgument("lidar", default_value="mid360", choices=list(PROFILES)),
            DeclareLaunchArgument("flags", default_value=""),
            DeclareLaunchArgument("sim_time", default_value="false", description="live on the run's clock"),
            DeclareLaunchArgument("program", default_value="pointflight"),
            OpaqueFunction(function=start),
        ]
    )
