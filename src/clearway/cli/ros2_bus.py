"""Which topics a command listens on: of ROS, of DDS, or of a recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from clearway.ros2.bus import TopicBus

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


def bus_for(bag: Path | None, backend: str, domain: int | None, namespace: str) -> TopicBus:
    """The bus that the options ask for; raises InputError where it cannot be opened."""
    from clearway.ros2.bag_bus import BagBus
    from clearway.ros2.dds import DdsBus, domain_id
    from clearway.ros2.parameters import NODE
    from clearway.ros2.rclpy_bus import RclpyBus, rclpy_is_there

    if bag is not None:
        return BagBus(bag)
    if backend == "rclpy" or (backend == "auto" and domain is None and rclpy_is_there()):
        return RclpyBus(NODE, namespace)
    return DdsBus(domain_id() if domain is None else domain)
