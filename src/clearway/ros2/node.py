"""A node that runs: over DDS or a recording at once, in ROS as its life cycle has it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from clearway.live.link.loop import Loop, LoopReport, OnOutcome, Stop
from clearway.missions.setup import Notice
from clearway.ros2.bus import TopicBus
from clearway.ros2.hand import TopicEncoding, begin_ros2_hand
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.topic_link import TopicLink

SetUp = Callable[
    [NodeParameters, Names, Callable[[], TopicBus], Notice], tuple[Loop, TopicLink[Any]]
]


@dataclass(frozen=True, slots=True)
class NodeKind:
    """What a command makes of parameters."""

    set_up: SetUp
    defaults: dict[str, object] = field(default_factory=dict)
    """Of parameters, where they are others than usual."""
    without: tuple[str, ...] = ()
    """Sections of parameters that mean nothing to it."""


class NodeRun(Protocol):
    """A node, as commands run it."""

    @property
    def link(self) -> TopicLink[Any] | None:
        """The link that runs, or ran last; None before any."""
        ...

    def run(self, stop: Stop, on_outcome: OnOutcome) -> LoopReport:
        """Run until `stop` says so, or the node ends by itself."""
        ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True, eq=False)
class PlainNode:
    """A node without a life cycle: it acts from the start to the end."""

    loop: Loop
    link: TopicLink[Any]
    hand: bool
    """Whether a second process is wanted."""
    notice: Notice

    def run(self, stop: Stop, on_outcome: OnOutcome) -> LoopReport:
        begin_ros2_hand(self.loop, TopicEncoding(self.link), wanted=self.hand, notice=self.notice)
        return self.loop.run(stop, on_outcome)

    def close(self) -> None:
        self.link.close()
