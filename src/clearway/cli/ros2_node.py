"""Nodes as `ros2 run` and `ros2 launch` start them: with arguments of ROS in place of options."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.cli.guard import guard_kind
from clearway.cli.guard_words import GuardWatch
from clearway.cli.live_ends import stop_rule
from clearway.cli.report import NOT_REACHED, leave, run_guarded, say
from clearway.cli.ros2 import NodeWatch, route_kind

if TYPE_CHECKING:
    from clearway.ros2.node import NodeKind

FILE = "--params-file"


def run_route() -> None:
    """Run the node that flies a mission, by the arguments of this process."""
    run_guarded(_run)(route_kind, NodeWatch, sys.argv[1:])


def run_guard() -> None:
    """Run the guardian, by the arguments of this process."""
    run_guarded(_run)(guard_kind, GuardWatch, sys.argv[1:])


def _run(kind: Callable[[], NodeKind], watch: Callable[[], Any], words: Sequence[str]) -> None:
    from clearway.ros2.managed_node import ManagedNode, ManagedStart

    files = [Path(after) for word, after in pairwise(words) if word == FILE]
    folder = files[0].parent if files else Path()
    node = ManagedNode(kind(), ManagedStart(words, folder), say)
    with closing(node), stop_rule(None) as stop:
        node.run(stop, watch().show)
        if node.link is not None and node.link.is_relieved:
            leave(NOT_REACHED)
