"""A life-cycle node of rclpy: configured, it decides; active, it sends set-points too."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from clearway.base.errors import ClearwayError, InputError
from clearway.live.handing import Handing
from clearway.live.link.loop import Loop, LoopReport, OnOutcome, Stop
from clearway.live.link.outcome import TickOutcome
from clearway.missions.setup import Notice
from clearway.ros2.hand import TopicEncoding, begin_ros2_hand
from clearway.ros2.node import NodeKind
from clearway.ros2.parameters import NODE, Names, list_problems
from clearway.ros2.rclpy_bus import RclpyBus, begin_rclpy
from clearway.ros2.ros_parameters import RosParameters
from clearway.ros2.topic_link import TopicLink

LISTENS_S = 0.1
"""Between two looks at whether an unconfigured node is to end."""


@dataclass(frozen=True, slots=True)
class ManagedStart:
    """How a node is begun."""

    ros_args: Sequence[str] = ()
    """As `ros2 run` gives them, from --ros-args on."""
    folder: Path = Path()
    """Where relative missions are looked for first."""
    acts: bool = True
    """False: no set-points, whatever the parameters say."""
    hand: bool = True
    """Whether a second process is wanted."""


class ManagedNode:
    """A `node.NodeRun` in ROS."""

    def __init__(self, kind: NodeKind, start: ManagedStart, notice: Notice) -> None:
        """Raises InputError for arguments and parameters that ROS refuses."""
        self._kind, self._start, self._notice = kind, start, notice
        self.link: TopicLink[Any] | None = None
        self._loop: Loop | None = None
        self._leaves = self._ends = False  # The loop is to be left; and the node is to end.
        self._refused: InputError | None = None
        try:
            self._rclpy = begin_rclpy(start.ros_args)
            self._node = _make_node(self)
        except Exception as refused:  # rclpy has several, of which some are private.
            raise InputError("rclpy", str(refused).strip() or type(refused).__name__) from refused
        self._parameters = RosParameters(
            self._node, start.folder, kind.defaults, kind.without, lambda: self._loop is None
        )
        executors: Any = import_module("rclpy.executors")
        self._idle: Any = executors.SingleThreadedExecutor()

    # --- transitions ----------------------------------------------------------------------

    def configure(self) -> bool:
        """Read parameters and mission, open topics; whether that went well."""
        if self._loop is not None:
            return False  # What was cleaned up last has not ended yet.
        try:
            given = self._parameters.read()
            if not self._start.acts:
                given = given.model_copy(update={"act": False})
            namespace, name = self._node.get_namespace(), self._node.get_name()
            names = Names(str(namespace), str(name))
            made = self._kind.set_up(given, names, lambda: RclpyBus(self._node), self._notice)
        except ValidationError as wrong:
            return self._refuse(InputError("parameters", list_problems(wrong)))
        except ClearwayError as wrong:
            return self._refuse(InputError("parameters", str(wrong)))
        self._loop, self.link = made
        self._set_acting(acts=False)
        return True

    def _refuse(self, refused: InputError) -> bool:
        self._refused = refused
        self._node.get_logger().error(f"not configured: {refused}")
        return False

    def activate(self) -> bool:
        """From now on set-points are sent, with `act`."""
        loop, link = self._loop, self.link
        if loop is None or link is None:
            return False
        self._set_acting(acts=link.parameters.act)
        begin_ros2_hand(loop, TopicEncoding(link), wanted=self._start.hand, notice=self._notice)
        return True

    def deactivate(self) -> bool:
        """Tell the vehicle to hold; from now on no set-points are sent."""
        link = self.link
        if self._loop is not None and link is not None:
            self._loop.link.end()
            link.handing = Handing()
            self._set_acting(acts=False)
        return True

    def clean_up(self) -> bool:
        """Close topics and forget what was heard, once the tick has ended."""
        self._leaves = True
        return True

    def shut_down(self) -> bool:
        """End the node, from any state."""
        self.deactivate()
        self._leaves = self._ends = True
        return True

    def _set_acting(self, *, acts: bool) -> None:
        assert self.link is not None
        session = self.link.session
        session.terms = replace(session.terms, act=acts)

    # --- as commands run it ---------------------------------------------------------------

    def run(self, stop: Stop, on_outcome: OnOutcome) -> LoopReport:
        began, report = time.monotonic(), LoopReport()
        self._start_by_itself()

        def over(_elapsed_s: float, outcome: TickOutcome | None) -> bool:
            return self._leaves or stop(time.monotonic() - began, outcome)

        while not self._ends and not stop(time.monotonic() - began, None):
            if self._loop is None:
                self._idle.add_node(self._node)  # From the bus's executor, which it goes back to.
                self._idle.spin_once(timeout_sec=LISTENS_S)
                continue
            report = self._loop.run(over, on_outcome)
            if not self._leaves:
                break
            self._tear_down()
        return report

    def _start_by_itself(self) -> None:
        """Configure and activate, unless somebody else is to; raises InputError."""
        success: Any = import_module("rclpy.lifecycle").TransitionCallbackReturn.SUCCESS
        autostart = self._node.get_parameter("autostart").value
        if not autostart:
            self._notice("waits to be configured: ros2 lifecycle set NODE configure")
        elif self._node.trigger_configure() == success:
            self._node.trigger_activate()
        elif self._refused is not None:
            raise self._refused

    def _tear_down(self) -> None:
        if self.link is not None:
            self.link.close()
        self._loop, self._leaves = None, False

    def close(self) -> None:
        if self._loop is not None:
            self._tear_down()
        self._idle.shutdown()
        self._node.destroy_node()
        self._rclpy.try_shutdown()


def _make_node(managed: ManagedNode) -> Any:
    """A node of rclpy whose transitions are those of ours."""
    lifecycle: Any = import_module("rclpy.lifecycle")
    answers = lifecycle.TransitionCallbackReturn

    def answering(does: Callable[[], bool]) -> Callable[[Any, Any], Any]:
        def transition(_node: Any, _state: Any) -> Any:
            return answers.SUCCESS if does() else answers.FAILURE

        return transition

    kind = type(
        "ClearwayNode",
        (lifecycle.LifecycleNode,),
        {
            "on_configure": answering(managed.configure),
            "on_activate": answering(managed.activate),
            "on_deactivate": answering(managed.deactivate),
            "on_cleanup": answering(managed.clean_up),
            "on_shutdown": answering(managed.shut_down),
        },
    )
    return kind(NODE, automatically_declare_parameters_from_overrides=True)
