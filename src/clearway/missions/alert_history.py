"""A recording looked at through volumes: the alerts and bands of one aircraft, every second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clearway.avoidance.long_range.bands import Bands, bands
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.traffic import Intruder
from clearway.traffic.recorded import Aircraft
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.playing import CLIMB_WINDOW_S
from clearway.traffic.recorded.samples import Samples, sample
from clearway.traffic.volumes import AlertLevel, Alerts, VolumeSet, alerts_after
from clearway.vehicle.performance import Performance

FARTHEST_M = 100_000.0
"""Aircraft farther away are not looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class AlertSecond:
    """One second of the ownship."""

    time_s: float
    alerts: Alerts
    bands: Bands | None
    """Where there is an alert."""


@dataclass(frozen=True, slots=True, eq=False)
class AlertHistory:
    """What was alerted when."""

    own: str
    volumes: VolumeSet
    seconds: tuple[AlertSecond, ...]

    def changes(self) -> list[tuple[float, str, AlertLevel]]:
        """(time, intruder, level) whenever the level of an intruder changes."""
        level: dict[str, AlertLevel] = {}
        found = []
        for second in self.seconds:
            for alert in second.alerts.alerts:
                if alert.level is not level.get(alert.name, AlertLevel.NONE):
                    found.append((second.time_s, alert.name, alert.level))
                level[alert.name] = alert.level
        return found

    def as_dict(self) -> dict[str, Any]:
        """For machines: changes of level, and every second that has an alert."""
        return {
            "own": self.own,
            "volumes": self.volumes.name,
            "changes": [
                {"time_s": time_s, "intruder": name, "level": level.name.lower()}
                for time_s, name, level in self.changes()
            ],
            "seconds": [
                {
                    "time_s": second.time_s,
                    "alerts": [alert.as_dict() for alert in second.alerts.alerts],
                    "bands": None if second.bands is None else second.bands.as_dict(),
                }
                for second in self.seconds
                if second.alerts.level
            ],
        }


def alert_history(
    aircraft: Sequence[Aircraft], own: str, volumes: VolumeSet, performance: Performance
) -> AlertHistory:
    """Alerts of the aircraft of an address or callsign about all others of a recording.

    Positions are interpolated to whole seconds, heights are barometric where both are known so,
    else geometric. Raises ClearwayError for an address that is not in it.
    """
    names = [one.address for one in aircraft]
    wanted = own.strip().lower()
    mine = [
        n for n, one in enumerate(aircraft) if wanted in (one.address.lower(), one.callsign.lower())
    ]
    if not mine:
        some = ", ".join(names[:8])
        raise ClearwayError(f"own aircraft {own!r}: is not in the recording; valid: {some}")
    samples = sample(aircraft, slowest_mps=0.0)
    climb = _climbs(samples)
    now, seconds = Alerts(), []
    begins = np.flatnonzero(np.diff(samples.second, prepend=-1))
    for rows in np.split(np.arange(len(samples)), begins[1:]):
        here = rows[samples.aircraft[rows] == mine[0]]
        if not len(here) or np.isnan(samples.east_mps[here[0]]):
            continue
        at = int(here[0])
        time_s = float(samples.second[at])
        others = _others(samples, climb, at, rows, names, time_s)
        velocity = np.array([samples.east_mps[at], samples.north_mps[at], climb[at]])
        place = np.zeros(3)
        first = alerts_after(now, volumes, place, velocity, others, time_s)
        shown = None
        if first.level:
            shown = bands(volumes, performance, place, velocity, others, time_s)
            if shown.saturated:
                first = alerts_after(now, volumes, place, velocity, others, time_s, saturated=True)
        now = first
        seconds.append(AlertSecond(time_s, now, shown))
    return AlertHistory(names[mine[0]], volumes, tuple(seconds))


def _others(
    samples: Samples,
    climb: FloatArray,
    at: int,
    rows: np.ndarray[Any, np.dtype[np.int64]],
    names: Sequence[str],
    time_s: float,
) -> list[Intruder]:
    """Everybody else at the second of a row, as seen from there: east, north, above."""
    found = []
    for row in rows:
        if row == at or np.isnan(samples.east_mps[row]):
            continue
        east, north = planar_offset_m(
            samples.latitude_deg[at], samples.longitude_deg[at],
            samples.latitude_deg[row], samples.longitude_deg[row],
        )  # fmt: skip
        above = samples.barometric_m[row] - samples.barometric_m[at]
        if np.isnan(above):
            above = samples.geometric_m[row] - samples.geometric_m[at]
        if np.isnan(above) or np.hypot(east, north) > FARTHEST_M:
            continue
        place = np.array([float(east), float(north), above])
        velocity = np.array([samples.east_mps[row], samples.north_mps[row], climb[row]])
        name = names[int(samples.aircraft[row])]
        found.append(Intruder(place, velocity, name=name, time_s=time_s))
    return found


def _climbs(samples: Samples) -> FloatArray:
    """[n] climb of each row, m/s: the mean over the last 20 s, since altitudes come in steps."""
    climb = np.zeros(len(samples))
    height = np.where(np.isnan(samples.barometric_m), samples.geometric_m, samples.barometric_m)
    for one in np.unique(samples.aircraft):
        mine = np.flatnonzero(samples.aircraft == one)
        second = samples.second[mine].astype(np.float64)
        then = np.searchsorted(second, second - CLIMB_WINDOW_S)
        elapsed = second - second[then]
        changed = height[mine] - height[mine[then]]
        climb[mine] = np.where(elapsed > 0.0, changed / np.maximum(elapsed, 1.0), 0.0)
    return np.nan_to_num(climb)
