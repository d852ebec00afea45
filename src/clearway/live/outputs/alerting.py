"""Alerts and bands about traffic, at every decision of a flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from clearway.avoidance.long_range.bands import Bands, bands
from clearway.avoidance.plan.situation import Situation
from clearway.traffic import Intruder
from clearway.traffic.covering import Covering, PlaceReport, Region
from clearway.traffic.volumes import AlertLevel, Alerts, VolumeSet, alerts_after
from clearway.vehicle.performance import Performance


@dataclass(frozen=True, slots=True, eq=False)
class TrafficPicture:
    """What there is to say of traffic now."""

    alerts: Alerts
    bands: Bands | None
    """Where there is an alert."""
    regions: Mapping[str, tuple[Region, ...]] = field(default_factory=dict)
    """By intruder that an alert is about: within how far of straight flight it stays with 95 %."""

    @property
    def in_words(self) -> str:
        """The alerts in a line; empty without any."""
        said = [
            f"{alert.level.name.lower()} alert: {alert.name or 'an intruder'}, "
            f"{alert.miss_m:.0f} m and {alert.miss_height_m:.0f} m of height apart "
            f"in {alert.closest_s:.0f} s{self._strays(alert.name)}"
            for alert in self.alerts.alerts
            if alert.level
        ]
        return "; ".join(said)

    def _strays(self, name: str) -> str:
        """How far it may be from where it would be straight on."""
        if name not in self.regions:
            return ""
        first = self.regions[name][0]
        return (
            f" if it flies straight on; in {first.ahead_s:.0f} s at most {first.level_m:.0f} m and "
            f"{first.height_m:.0f} m of height off that way (95 % sure)"
        )

    def as_dict(self) -> dict[str, Any]:
        """For machines."""
        return {
            "level": self.alerts.level.name.lower(),
            "alerts": [alert.as_dict() for alert in self.alerts.alerts if alert.level],
            "bands": None if self.bands is None else self.bands.as_dict(),
            "strays": {name: _strays(regions) for name, regions in self.regions.items()},
        }


def _strays(regions: tuple[Region, ...]) -> dict[str, Any]:
    return {
        "moves_as": regions[0].motion.name.lower(),
        "ahead_s": [region.ahead_s for region in regions],
        "level_m": [round(region.level_m, 1) for region in regions],
        "height_m": [round(region.height_m, 1) for region in regions],
    }


def coverings_after(
    before: Mapping[str, Covering], intruders: Sequence[Intruder]
) -> dict[str, Covering]:
    """What is learned of how far each intruder strays; of one that is gone nothing is kept."""
    after = {}
    for intruder in intruders:
        covering = after[intruder.name] = before.get(intruder.name) or Covering()
        covering.take(PlaceReport(intruder.time_s, intruder.position_m, intruder.velocity_mps))
    return after


def traffic_picture(
    before: Alerts,
    volumes: VolumeSet,
    performance: Performance,
    situation: Situation,
    coverings: Mapping[str, Covering] | None = None,
) -> TrafficPicture:
    """The alerts of a situation after those before it, and bands where there are any.

    coverings: what was learned of the intruders, by `coverings_after`.
    """
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
    regions = {
        alert.name: coverings[alert.name].regions
        for alert in alerts.alerts
        if alert.level and coverings and alert.name in coverings
    }
    return TrafficPicture(alerts, shown, regions)
