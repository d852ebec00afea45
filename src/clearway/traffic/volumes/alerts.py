"""Alerts about other aircraft, look after look: given soon, taken back late."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.intruder import Intruder
from clearway.traffic.volumes.volume import AlertLevel, VolumeSet


@dataclass(frozen=True, slots=True)
class Alert:
    """What there is to say of one intruder now."""

    name: str
    level: AlertLevel
    """As given, over the last looks."""
    asked: AlertLevel
    """As the volumes have it at this moment."""
    time_to_volume_s: Mapping[AlertLevel, float]
    """By the level of its rule: how soon both share its volume if both fly straight on; inf for
    never."""
    closest_s: float
    """When they are closest horizontally."""
    miss_m: float
    """How far apart, horizontally, then."""
    miss_height_m: float
    """And vertically."""

    def as_dict(self) -> dict[str, Any]:
        """For machines; what never happens is null."""
        times = {level.name.lower(): at for level, at in self.time_to_volume_s.items()}
        return {
            "intruder": self.name,
            "level": self.level.name.lower(),
            "asked": self.asked.name.lower(),
            "time_to_volume_s": {
                level: round(at, 2) if math.isfinite(at) else None for level, at in times.items()
            },
            "closest_s": round(self.closest_s, 2),
            "miss_m": round(self.miss_m, 1),
            "miss_height_m": round(self.miss_height_m, 1),
        }


@dataclass(frozen=True, slots=True)
class Alerts:
    """All alerts at a time, and what earlier times asked for."""

    time_s: float = -math.inf
    alerts: tuple[Alert, ...] = ()
    """The worst first."""
    asked: Mapping[str, tuple[tuple[float, AlertLevel], ...]] = field(
        default_factory=lambda: MappingProxyType({})
    )
    """By intruder: times and levels that still count."""

    @property
    def level(self) -> AlertLevel:
        """The worst one."""
        return max((alert.level for alert in self.alerts), default=AlertLevel.NONE)


def alerts_after(
    before: Alerts,
    volumes: VolumeSet,
    own_m: FloatArray,
    own_mps: FloatArray,
    intruders: Sequence[Intruder],
    time_s: float,
    *,
    saturated: bool = False,
) -> Alerts:
    """Alerts at a time, for an own position [3] and velocity [3] in the intruders' frame.

    saturated: no manoeuvre stays outside of the volumes, so that warnings become recoveries. An
    alert is given where enough of the last looks ask for it, by the set's window. A time before the
    last one begins anew.
    """
    earlier = before.asked if time_s >= before.time_s else {}
    found, asked = [], {}
    for intruder in intruders:
        there = intruder.at(time_s)
        apart, change = there.position_m - own_m, there.velocity_mps - own_mps
        times = {rule.level: rule.volume.find_shared(apart, change)[0] for rule in volumes.rules}
        now = max(
            (rule.level for rule in volumes.rules if times[rule.level] <= rule.within_s),
            default=AlertLevel.NONE,
        )
        if saturated and now is AlertLevel.WARNING:
            now = AlertLevel.RECOVERY
        still = [
            (then, level)
            for then, level in earlier.get(there.name, ())
            if then > time_s - volumes.window_s
        ]
        kept = (*still, (time_s, now))
        asked[there.name] = kept
        closest_s, miss, height = predict_closest(apart, change)
        looks = sorted((level for _, level in kept), reverse=True)
        given = looks[volumes.needed - 1] if len(looks) >= volumes.needed else AlertLevel.NONE
        found.append(Alert(there.name, given, now, times, closest_s, miss, height))
    found.sort(key=lambda alert: (-alert.level, min(alert.time_to_volume_s.values(), default=0.0)))
    return Alerts(time_s, tuple(found), MappingProxyType(asked))


def predict_closest(apart_m: FloatArray, change_mps: FloatArray) -> tuple[float, float, float]:
    """When two that fly straight on are closest horizontally, from now on, and how far apart then:
    horizontally and vertically."""
    level2 = float(change_mps[:2] @ change_mps[:2])
    when = max(0.0, -float(apart_m[:2] @ change_mps[:2]) / level2) if level2 > 0.0 else 0.0
    there = apart_m + when * change_mps
    return when, float(np.hypot(there[0], there[1])), abs(float(there[2]))
