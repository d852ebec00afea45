"""Entry points: `ros2 run clearway_ros clearway --ros-args --params-file FILE`."""

from clearway.cli.ros2_node import run_guard, run_route

route, guard = run_route, run_guard
