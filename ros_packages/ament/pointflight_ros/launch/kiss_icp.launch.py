"""KISS-ICP (PRBonn/kiss-icp) beside pointflight; the scenario's LiDAR is an os1_128.

ros2 launch pointflight_ros kiss_icp.launch.py map:=s.yaml
"""

import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    share = get_package_share_directory("pointflight_ros")
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="a scenario .yaml with a mission"),
            DeclareLaunchArgument("flags", default_value=""),
            DeclareLaunchArgument("sim_time", default_value="false", description="live on the run's clock"),
            DeclareLaunchArgument("program", default_value="pointflight"),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(os.path.join(share, "launch", "fly.launch.py")),
                launch_arguments={
                    "map": LaunchConfiguration("map"),
                    "flags": LaunchConfiguration("flags"),
                    "program": LaunchConfiguration("program"),
                    "sim_time": LaunchConfiguration("sim_time"),
                    "profile": "ouster",
                    "rviz": "false",
                }.items(),
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(
                    os.path.join(
                        get_package_share_directory("kiss_icp"), "launch", "odometry.launch.py"
                    )
                ),
                launch_arguments={
                    "topic": "/os_cloud_node/points",
                    "use_sim_time": LaunchConfiguration("sim_time"),
                    "visualize": "true",
                }.items(),
            ),
        ]
    )
