"""What an intruder's reports show of its manoeuvres: turns and changes of speed between them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Container
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from clearway.traffic.intruder import Intruder

REMEMBERED_S = 30.0
"""Who has turned once turns again: a pursuer flies straight until its prey turns."""
SIGMAS = 3.0
"""Deviations of both velocities that no change of velocity is inferred from."""
LEAST_S = 0.2
LONGEST_S = 5.0
"""Between two reports that a manoeuvre is inferred from."""
LEAST_SHARE = 0.02
"""Changes of a smaller share of the speed in a second are none: velocities are reported rounded."""


class _Told(NamedTuple):
    """A velocity at a time."""

    time_s: float
    velocity_mps: list[float]
    std_mps: float


@dataclass(slots=True)
class _Heard:
    """One intruder's last velocities, and the accelerations that were seen."""

    told: deque[_Told] = field(default_factory=deque)
    seen: deque[tuple[float, float]] = field(default_factory=deque)
    """Time and acceleration."""


class Manoeuvres:
    """The hardest manoeuvre of each intruder in the last while, by its successive reports."""

    def __init__(self) -> None:
        self._heard: dict[str, _Heard] = {}

    def take(self, name: str, report: Intruder) -> None:
        """Learn from a report, or from a track's state at the time of one."""
        heard = self._heard.setdefault(name, _Heard())
        now = _Told(report.time_s, report.velocity_mps.tolist(), report.velocity_std_mps)
        if heard.told and now.time_s - heard.told[-1].time_s < LEAST_S:
            return
        while heard.told and heard.told[0].time_s < now.time_s - LONGEST_S:
            heard.told.popleft()
        while heard.seen and heard.seen[0][0] < now.time_s - REMEMBERED_S:
            heard.seen.popleft()
        hardest = 0.0
        for before in heard.told:
            if before.velocity_mps != now.velocity_mps:  # Most fly on as they did.
                hardest = max(hardest, _acceleration(before, now))
        if hardest > LEAST_SHARE * report.speed_mps:
            heard.seen.append((now.time_s, hardest))
        heard.told.append(now)

    def forget(self, name: str) -> None:
        """Nothing is known of it any more."""
        self._heard.pop(name, None)

    def keep(self, names: Container[str]) -> None:
        """Forget all others."""
        self._heard = {name: heard for name, heard in self._heard.items() if name in names}

    def with_manoeuvre(self, name: str, intruder: Intruder) -> Intruder:
        """The intruder with the manoeuvre that it has shown."""
        heard = self._heard.get(name)
        if heard is None or not heard.seen:
            return intruder
        return replace(intruder, manoeuvre_mps2=max(hardest for _, hardest in heard.seen))


def _acceleration(before: _Told, now: _Told) -> float:
    """What a change of velocity proves, at the least."""
    changed = math.dist(now.velocity_mps, before.velocity_mps)
    unsure = SIGMAS * math.hypot(before.std_mps, now.std_mps)
    return max(0.0, changed - unsure) / (now.time_s - before.time_s)
