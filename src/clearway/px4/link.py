"""PX4 as a link of a mission, and of a guardian: both are one of its flight modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from clearway.base.frames import ned_from_enu
from clearway.live.guard.guard_session import GuardSession
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.px4.topics import Px4Topics
from clearway.ros2.guard_link import GuardLink
from clearway.ros2.ros2_link import Ros2Link


class Px4Link(Px4Topics[Session], Ros2Link):
    """A mission flown as a mode of PX4."""

    def tick(self, wall_s: float) -> TickOutcome:
        self.before_tick(wall_s)
        return self.after_tick(super().tick(wall_s), wall_s)

    def end(self, *, crashed: bool = False) -> None:
        super().end(crashed=crashed)
        self.leave()


class Px4GuardLink(Px4Topics[GuardSession], GuardLink):
    """A guardian as a mode of PX4: somebody's commands, as far as they may be flown."""

    def _take_wish(self, message: Any, wall_s: float, topic: str) -> None:
        offset = self.place.world_from_local_m
        if self.parameters.guard.type == "TrajectorySetpoint" and offset is not None:
            message.position = (message.position + ned_from_enu(offset)).astype(np.float32)
        super()._take_wish(message, wall_s, topic)

    def doubt_of_link(self, outcome: TickOutcome, wall_s: float) -> str:
        if not self.session.tally["wishes"]:
            return f"no command has come on {self.names(self.parameters.guard.topic)}"
        return super().doubt_of_link(outcome, wall_s)

    def tick(self, wall_s: float) -> TickOutcome:
        self.before_tick(wall_s)
        return self.after_tick(super().tick(wall_s), wall_s)

    def end(self, *, crashed: bool = False) -> None:
        super().end(crashed=crashed)
        self.leave()
