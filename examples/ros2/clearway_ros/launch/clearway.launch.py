"""ros2 launch clearway_ros clearway.launch.py params:=FILE.

`node:=guard` starts the guardian. A life-cycle manager, such as nav2's, takes the node over with
`autostart: false` in the parameters.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode

BAD_INPUT = 2
"""The exit status of clearway for parameters or a mission that cannot be used."""
ESCAPE_S = 10.0
"""For so long the second process may still fly the escape of a node that died."""
MOST_STARTS = 5


def generate_launch_description() -> LaunchDescription:
    """Return the node; it is started again if it dies, but not where its input is wrong."""
    config = Path(get_package_share_directory("clearway_ros")) / "config"
    node = LifecycleNode(
        package="clearway_ros",
        executable=LaunchConfiguration("node"),
        name="clearway",
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("params")],
        output="screen",
        respawn=True,
        respawn_delay=ESCAPE_S,
        respawn_max_retries=MOST_STARTS,
    )

    def give_up(event: object, _context: object) -> list[EmitEvent]:
        if getattr(event, "returncode", 0) != BAD_INPUT:
            return []
        return [EmitEvent(event=Shutdown(reason="clearway cannot use its input"))]

    return LaunchDescription(
        [
            DeclareLaunchArgument("node", default_value="clearway", choices=["clearway", "guard"]),
            DeclareLaunchArgument("params", default_value=str(config / "params.yaml")),
            DeclareLaunchArgument("namespace", default_value=""),
            node,
            RegisterEventHandler(OnProcessExit(target_action=node, on_exit=give_up)),
        ]
    )
