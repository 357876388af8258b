"""Reads four feet on a CAN bus, and publishes their state: ros2 launch footfall_hardware feet.launch.py can_interface:=can0"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import Command, LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    package = FindPackageShare("footfall_hardware")
    model = PathJoinSubstitution([package, "urdf", "feet.urdf.xacro"])
    controllers = PathJoinSubstitution([package, "config", "feet.yaml"])
    description = Command(["xacro ", model, " can_interface:=", LaunchConfiguration("can_interface")])
    return LaunchDescription(
        [
            DeclareLaunchArgument("can_interface", default_value="can0", description="interface of SocketCAN"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[{"robot_description": ParameterValue(description, value_type=str)}],
            ),
            Node(package="controller_manager", executable="ros2_control_node", parameters=[controllers]),
            Node(package="controller_manager", executable="spawner", arguments=["feet_broadcaster"]),
        ]
    )
