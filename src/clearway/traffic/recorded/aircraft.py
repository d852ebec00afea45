"""Tracks of a recording: the reports of each aircraft as arrays, with their gaps and jumps."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.base.units import FOOT_M
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.report import NOT_ICAO, TrafficRecording, TrafficReport

LONGEST_GAP_S = 12.0
"""Positions are not interpolated over longer silence."""
FASTEST_RECORDED_MPS = 600.0
"""Over ground; two reports that imply more do not belong together."""
AWAY_S = 900.0
"""A longer silence is no gap: the aircraft has been away, and comes back."""
WHOLE_FEET = 25.0
"""Finest step that transponders report in."""


@dataclass(frozen=True, slots=True, eq=False)
class Aircraft:
    """One aircraft of a recording; arrays [n] over its reports, times ascending."""

    address: str
    callsign: str
    source: str
    """The most frequent one."""
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    """Unwrapped: neighbours never differ by more than 180."""
    barometric_m: FloatArray
    """NaN where unknown, like all that follows."""
    geometric_m: FloatArray
    ground_speed_mps: FloatArray
    track_rad: FloatArray
    vertical_rate_mps: FloatArray
    on_ground: BoolArray
    segment_mps: FloatArray
    """[n - 1] speed over ground that neighbouring positions imply."""

    __repr__ = brief

    @property
    def is_icao(self) -> bool:
        return not self.address.startswith(NOT_ICAO)

    @property
    def heard_of(self) -> BoolArray:
        """[n - 1] between which reports positions may be interpolated."""
        near: BoolArray = np.diff(self.time_s) <= LONGEST_GAP_S
        return near & (self.segment_mps <= FASTEST_RECORDED_MPS)

    @property
    def gaps_s(self) -> FloatArray:
        """[m] lengths of the silences over which nothing is interpolated, but for its absences."""
        silence = np.diff(self.time_s)
        return silence[(silence > LONGEST_GAP_S) & (silence <= AWAY_S)]

    @property
    def visits(self) -> int:
        """How often it came; between visits it is silent for more than a quarter of an hour."""
        return 1 + int(np.count_nonzero(np.diff(self.time_s) > AWAY_S))

    @property
    def jumps(self) -> int:
        """Neighbouring positions further apart than anything flies."""
        return int(np.count_nonzero(self.segment_mps > FASTEST_RECORDED_MPS))

    @property
    def altitude_m(self) -> FloatArray:
        """[n] barometric where known, else geometric."""
        return np.where(np.isnan(self.barometric_m), self.geometric_m, self.barometric_m)

    @property
    def altitude_step_m(self) -> float:
        """Step in which the barometric altitude is given: 25 or 100 ft; 0 if finer or unknown."""
        return height_step_m(self.barometric_m)


def height_step_m(height_m: FloatArray) -> float:
    """Step in which heights [n] are given: 25 or 100 ft in metres; 0 if finer or all NaN."""
    feet = height_m[~np.isnan(height_m)] / FOOT_M
    if not len(feet) or np.any(np.abs(feet - np.round(feet)) > 1e-3):
        return 0.0
    step = np.gcd.reduce(np.round(feet).astype(np.int64))
    if step == 0 or step % WHOLE_FEET:
        return 0.0
    return (100.0 if step % 100 == 0 else WHOLE_FEET) * FOOT_M


def collect_aircraft(recording: TrafficRecording) -> list[Aircraft]:
    """Aircraft that report positions, in the order of their addresses."""
    by_address: dict[str, list[TrafficReport]] = defaultdict(list)
    for report in recording.reports:
        by_address[report.address].append(report)
    return [_aircraft(address, by_address[address]) for address in sorted(by_address)]


def _aircraft(address: str, reports: Sequence[TrafficReport]) -> Aircraft:
    """One aircraft, its reports in the order of time."""
    time_s = np.array([report.time_s for report in reports])
    latitude = np.array([report.latitude_deg for report in reports])
    longitude = np.unwrap([report.longitude_deg for report in reports], period=360.0)
    east, north = planar_offset_m(latitude[:-1], longitude[:-1], latitude[1:], longitude[1:])
    with np.errstate(divide="ignore", over="ignore"):
        segment = np.hypot(east, north) / np.diff(time_s)
    callsigns = Counter(report.callsign for report in reports if report.callsign)
    return Aircraft(
        address=address,
        callsign=callsigns.most_common(1)[0][0] if callsigns else "",
        source=Counter(report.source for report in reports).most_common(1)[0][0],
        time_s=time_s,
        latitude_deg=latitude,
        longitude_deg=longitude,
        barometric_m=_list_known([report.barometric_altitude_m for report in reports]),
        geometric_m=_list_known([report.geometric_altitude_m for report in reports]),
        ground_speed_mps=_list_known([report.ground_speed_mps for report in reports]),
        track_rad=_list_known([report.track_rad for report in reports]),
        vertical_rate_mps=_list_known([report.vertical_rate_mps for report in reports]),
        on_ground=np.array([report.altitude_kind == "ground" for report in reports]),
        segment_mps=segment,
    )


def _list_known(values: Sequence[float | None]) -> FloatArray:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
