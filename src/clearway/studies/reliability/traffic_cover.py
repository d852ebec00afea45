"""Predicted places of recorded aircraft: how often the aircraft was there, by how it moved."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from clearway.base.conformal import SHARE
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.traffic.covering import (
    NO_STARTS,
    STARTS,
    STEP,
    Covered,
    Covering,
    Key,
    MovesAs,
    PlaceReport,
    Starts,
)
from clearway.traffic.recorded import Aircraft
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.samples import Samples, sample_aircraft

Track = list[PlaceReport]
"""Of one aircraft, times ascending."""
EVERY_S = 2
"""Between the moments of a track."""
CLIMB_S = 10
"""Over which climbs are told."""
SLOWEST_MPS = 0.5
"""Slower ones stand."""


def moments_of(aircraft: Sequence[Aircraft]) -> Iterator[Track]:
    """The moments of each recorded aircraft, by what it reports: barometric heights where known."""
    samples = sample_aircraft(aircraft, SLOWEST_MPS)
    known = ~np.isnan(samples.barometric_m)
    height_m = np.where(known, samples.barometric_m, samples.geometric_m)
    for number in range(len(aircraft)):
        rows = np.flatnonzero(samples.aircraft == number)
        if len(rows):
            yield _moments(samples, rows, height_m)


def _moments(samples: Samples, rows: IntArray, height_m: FloatArray) -> Track:
    at = {int(samples.second[row]): int(row) for row in rows}
    latitude, longitude = samples.latitude_deg[rows], samples.longitude_deg[rows]
    east_m, north_m = planar_offset_m(latitude[0], longitude[0], latitude, longitude)
    place = dict(zip(at, zip(east_m.tolist(), north_m.tolist(), strict=True), strict=True))
    found = []
    for second, row in at.items():
        lower = at.get(second - CLIMB_S)
        if second % EVERY_S or lower is None:
            continue
        climb = float(height_m[row] - height_m[lower]) / CLIMB_S
        position = np.array([*place[second], height_m[row]])
        velocity = np.array([samples.east_mps[row], samples.north_mps[row], climb])
        if np.isfinite(position).all() and np.isfinite(velocity).all():
            found.append(PlaceReport(float(second), position, velocity))
    return found


def verdicts_of(
    tracks: Iterable[Track], starts: Starts = STARTS, step: float = STEP
) -> dict[Key, list[Covered]]:
    """What came of all predictions, by how the aircraft moved and the time ahead."""
    found: dict[Key, list[Covered]] = defaultdict(list)
    for track in tracks:
        covering = Covering(starts, step)
        for moment in track:
            for verdict in covering.take(moment):
                found[verdict.motion, verdict.ahead_s].append(verdict)
    return {key: found[key] for key in sorted(found)}


def starts_of(tracks: Iterable[Track]) -> Starts:
    """The factors that 95 % of errors need, by motion; none where nobody moved so."""
    needed: dict[MovesAs, list[tuple[float, float]]] = defaultdict(list)
    for track in tracks:
        later = {moment.time_s: moment for moment in track}
        plain = Covering(NO_STARTS, step=0.0)
        for moment in track:
            plain.take(moment)
            for region in plain.regions:
                then = later.get(moment.time_s + region.ahead_s)
                if then is not None:
                    off = then.position_m - moment.position_m - moment.velocity_mps * region.ahead_s
                    level = math.hypot(*off[:2].tolist()) / region.level_m
                    needed[region.motion].append((level, abs(float(off[2])) / region.height_m))
    of_motion = [
        np.log(np.quantile(np.array(needed.get(motion, [(1.0, 1.0)])), SHARE, axis=0))
        for motion in MovesAs
    ]
    level, height = np.round(np.stack(of_motion, axis=1), 2).tolist()
    return Starts(tuple(level), tuple(height))


def judge_by_halves(tracks: Sequence[Track]) -> dict[Key, list[Covered]]:
    """What came of predictions by factors that the other half of the aircraft began with."""
    halves = tracks[::2], tracks[1::2]
    found: dict[Key, list[Covered]] = defaultdict(list)
    for mine, others in (halves, halves[::-1]):
        for key, verdicts in verdicts_of(mine, starts_of(others)).items():
            found[key] += verdicts
    return {key: found[key] for key in sorted(found)}
