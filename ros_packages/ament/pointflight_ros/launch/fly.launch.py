"""pointflight beside RViz. map: a .pfmap or a scenario .yaml; flags: more of `pointflight fly`;
sim_time: nodes live on the run's clock, which may be slower than real time (flags:="--rate 0.3")."""

import os
import shlex

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction
from launch.conditions import IfCondition
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def start(context):
    def value(name):
        return LaunchConfiguration(name).perform(context)

    command = [value("program"), "fly", value("map"), "--ros2", "--profile", value("profile")]
    # the default profile has its own clock; the programs of others live on the wall clock unless told
    simulated = (value("sim_time") or str(value("profile") == "default")).lower() == "true"
    if simulated:
        command.append("--sim-time")
    rviz = os.path.join(get_package_share_directory("pointflight_ros"), "rviz", "pointflight.rviz")
    return [
        ExecuteProcess(
            cmd=command + shlex.split(value("flags")),
            output="screen",
            on_exit=[EmitEvent(event=Shutdown())],
        ),
        Node(
            package="rviz2",
            executable="rviz2",
            arguments=["-d", rviz],
            parameters=[{"use_sim_time": simulated}],
            condition=IfCondition(LaunchConfiguration("rviz")),
        ),
    ]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="a .pfmap or a scenario .yaml"),
            DeclareLaunchArgument("profile", default_value="default"),
            DeclareLaunchArgument("flags", default_value=""),
            DeclareLaunchArgument("sim_time", default_value="", description="true, false; empty: by the profile"),
            DeclareLaunchArgument("rviz", default_value="true"),
            DeclareLaunchArgument("program", default_value="pointflight"),
            OpaqueFunction(function=start),
        ]
    )
