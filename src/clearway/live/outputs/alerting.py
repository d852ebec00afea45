"""Alerts and bands about traffic, at every decision of a flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from clearway.avoidance.long_range.bands import Bands, bands
from clearway.avoidance.plan.situation import Situation
from clearway.traffic.volumes import AlertLevel, Alerts, VolumeSet, alerts_after
from clearway.vehicle.performance import Performance


@dataclass(frozen=True, slots=True, eq=False)
class TrafficPicture:
    """What there is to say of traffic now."""

    alerts: Alerts
    bands: Bands | None
    """Where there is an alert."""

    @property
    def in_words(self) -> str:
        """The alerts in a line; empty without any."""
        said = [
            f"{alert.level.name.lower()} alert: {alert.name or 'an intruder'}, "
            f"{alert.miss_m:.0f} m and {alert.miss_height_m:.0f} m of height apart "
            f"in {alert.closest_s:.0f} s"
            for alert in self.alerts.alerts
            if alert.level
        ]
        return "; ".join(said)

    def as_dict(self) -> dict[str, Any]:
        """For machines."""
        return {
            "level": self.alerts.level.name.lower(),
            "alerts": [alert.as_dict() for alert in self.alerts.alerts if alert.level],
            "bands": None if self.bands is None else self.bands.as_dict(),
        }


def traffic_picture(
    before: Alerts, volumes: VolumeSet, performance: Performance, situation: Situation
) -> TrafficPicture:
    """The alerts of a situation after those before it, and bands where there are any."""
    state = situation.state
    velocity = performance.speed_mps * state.world_from_body[:, 0]
    now, intruders = state.time_s, situation.intruders
    alerts = alerts_after(before, volumes, state.position_m, velocity, intruders, now)
    if alerts.level is AlertLevel.NONE:
        return TrafficPicture(alerts, None)
    shown = bands(volumes, performance, state.position_m, velocity, intruders, now)
    if shown.saturated:
        alerts = alerts_after(
            before, volumes, state.position_m, velocity, intruders, now, saturated=True
        )
    return TrafficPicture(alerts, shown)
