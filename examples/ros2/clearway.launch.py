"""ros2 launch examples/ros2/clearway.launch.py params:=examples/ros2/params.yaml"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description() -> LaunchDescription:
    """The node, with its parameters and namespace."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("params", default_value="params.yaml"),
            DeclareLaunchArgument("namespace", default_value=""),
            ExecuteProcess(
                cmd=[
                    "clearway",
                    "ros2",
                    LaunchConfiguration("params"),
                    "--namespace",
                    LaunchConfiguration("namespace"),
                ],
                output="screen",
                respawn=True,
                respawn_delay=1.0,
            ),
        ]
    )
