"""Which topics a command listens on: of ROS, of DDS, or of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli.report import say

if TYPE_CHECKING:
    from clearway.ros2.bus import TopicBus
    from clearway.ros2.node import NodeKind, NodeRun

BACKENDS = ("auto", "dds", "rclpy")
Check = Annotated[
    bool,
    typer.Option("--check", help="Listen for a while, tell what comes and what is missing, end."),
]
Bag = Annotated[
    Path | None, typer.Option(help="Play a ROS 2 bag or MCAP file in place of live topics.")
]
Backend = Annotated[
    str, typer.Option(help="auto (rclpy where ROS is there, else dds), dds, or rclpy.")
]
Domain = Annotated[
    int | None, typer.Option(min=0, max=232, help="DDS domain; default: ROS_DOMAIN_ID, or 0.")
]
Namespace = Annotated[str, typer.Option(help="Namespace of the node.")]
Remap = Annotated[list[str] | None, typer.Option(help="FROM:=TO, as often as needed.")]
"""Options of all commands on topics."""
BUS_CHECK_S = 5.0
"""For so long --check listens."""


def refuse_unusable(backend: str, bag: Path | None) -> None:
    """Raise InputError for a backend that is none, and a recording that is not there."""
    from clearway.base.errors import InputError
    from clearway.io.what_file import require_file

    if bag is not None:
        require_file(bag)
    if backend not in BACKENDS:
        raise InputError("--backend", f"{backend!r} is none of {', '.join(BACKENDS)}")


@dataclass(frozen=True, slots=True)
class BusOptions:
    """What the options of a command ask for."""

    bag: Path | None = None
    backend: str = "auto"
    domain: int | None = None
    namespace: str = ""
    remap: Sequence[str] = ()

    @property
    def is_ros(self) -> bool:
        """Whether topics are those of rclpy."""
        from clearway.ros2.rclpy_bus import rclpy_is_there

        if self.bag is not None or self.backend == "dds":
            return False
        return self.backend == "rclpy" or (self.domain is None and rclpy_is_there())

    def open(self) -> TopicBus:
        """Open the bus; raises InputError where it cannot be opened."""
        from clearway.ros2.bag_bus import BagBus
        from clearway.ros2.dds import DdsBus, domain_id
        from clearway.ros2.parameters import NODE
        from clearway.ros2.rclpy_bus import RclpyBus

        if self.bag is not None:
            return BagBus(self.bag)
        if self.is_ros:
            return RclpyBus.on_own_node(NODE, self.namespace)
        return DdsBus(domain_id() if self.domain is None else self.domain)

    def ros_args(self, file: Path) -> list[str]:
        """The same as arguments of ROS."""
        rules = [f"__ns:=/{self.namespace.strip('/')}"] if self.namespace.strip("/") else []
        words = ["--ros-args", "--params-file", str(file)]
        return words + [word for rule in (*rules, *self.remap) for word in ("-r", rule)]


def open_node(
    kind: NodeKind, file: Path, options: BusOptions, *, check: bool, hand: bool
) -> NodeRun:
    """A node of a parameter file; check: without set-points, whatever the file says."""
    from clearway.ros2.managed_node import ManagedNode, ManagedStart
    from clearway.ros2.node import PlainNode
    from clearway.ros2.parameter_file import read_parameters
    from clearway.ros2.parameters import Names

    given = read_parameters(file, namespace=options.namespace)
    if options.is_ros:
        start = ManagedStart(options.ros_args(file), file.parent, acts=not check, hand=hand)
        return ManagedNode(kind, start, say)
    changed: dict[str, object] = {
        name: value for name, value in kind.defaults.items() if name not in given.model_fields_set
    }
    changed |= {"act": False} if check else {}
    changed |= {} if options.bag is None else {"use_sim_time": True}
    names = Names(options.namespace, remap=options.remap)
    loop, link = kind.set_up(given.model_copy(update=changed), names, options.open, say)
    return PlainNode(loop, link, hand, say)
