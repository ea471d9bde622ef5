"""FAST-LIO2 (hku-mars/FAST_LIO, branch ROS2) beside pointflight.

ros2 launch pointflight_ros fast_lio.launch.py map:=s.yaml
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    share = get_package_share_directory("pointflight_ros")
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="a scenario .yaml with a mission"),
            DeclareLaunchArgument("flags", default_value=""),
            DeclareLaunchArgument("program", default_value="pointflight"),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(os.path.join(share, "launch", "fly.launch.py")),
                launch_arguments={
                    "map": LaunchConfiguration("map"),
                    "flags": LaunchConfiguration("flags"),
                    "program": LaunchConfiguration("program"),
                    "profile": "livox",
                    "rviz": "false",
                }.items(),
            ),
            Node(
                package="fast_lio",
                executable="fastlio_mapping",
                parameters=[os.path.join(share, "config", "fast_lio_mid360.yaml")],
                output="screen",
            ),
        ]
    )
