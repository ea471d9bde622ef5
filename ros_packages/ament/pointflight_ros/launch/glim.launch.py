"""GLIM (koide3/glim) beside pointflight; the scenario's LiDAR is an os1_128.

config: GLIM's own folder of configurations with config/glim of this package copied over it.
ros2 launch pointflight_ros glim.launch.py map:=s.yaml config:=$PWD/glim_config
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
            DeclareLaunchArgument("config", description="folder of GLIM's configurations"),
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
            Node(
                package="glim_ros",
                executable="glim_rosnode",
                parameters=[
                    {
                        "config_path": LaunchConfiguration("config"),
                        "use_sim_time": LaunchConfiguration("sim_time"),
                    }
                ],
                output="screen",
            ),
        ]
    )
