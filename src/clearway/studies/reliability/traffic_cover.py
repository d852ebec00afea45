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
    AHEAD_S,
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
PARTS = 10
"""Of aircraft that are judged by factors of the others: few hover."""
Ratios = dict[Key, list[tuple[float, float]]]
"""By motion and time ahead: errors as shares of what is claimed, of the circle and the height."""
NO_FACTORS = (0.0, 0.0)
"""Logarithms for the circle and the height, where nobody moved so."""


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


def ratios_of(track: Track) -> Ratios:
    """How far a track's own predictions were off, as a share of the circle and of the height."""
    found: Ratios = defaultdict(list)
    later = {moment.time_s: moment for moment in track}
    plain = Covering(NO_STARTS, step=0.0)
    for moment in track:
        plain.take(moment)
        for region in plain.regions:
            then = later.get(moment.time_s + region.ahead_s)
            if then is not None:
                off = then.position_m - moment.position_m - moment.velocity_mps * region.ahead_s
                level = math.hypot(*off[:2].tolist()) / region.level_m
                found[region.motion, region.ahead_s].append(
                    (level, abs(float(off[2])) / region.height_m)
                )
    return found


def starts_of(ratios: Iterable[Ratios]) -> Starts:
    """The factors that 95 % of errors need, by motion and time ahead; 1 where nobody moved so."""
    needed: Ratios = defaultdict(list)
    for one in ratios:
        for key, each in one.items():
            needed[key] += each
    of_key = {
        key: np.round(np.log(np.quantile(np.array(each), SHARE, axis=0)), 2).tolist()
        for key, each in needed.items()
    }
    level, height = (
        tuple(
            tuple(float(of_key.get((motion, ahead_s), NO_FACTORS)[kind]) for ahead_s in AHEAD_S)
            for motion in MovesAs
        )
        for kind in range(2)
    )
    return Starts(level, height)


def judge_by_parts(tracks: Sequence[Track]) -> dict[Key, list[Covered]]:
    """What came of predictions, by factors that the aircraft of all other parts began with."""
    ratios = [ratios_of(track) for track in tracks]
    found: dict[Key, list[Covered]] = defaultdict(list)
    for part in range(PARTS):
        others = [one for number, one in enumerate(ratios) if number % PARTS != part]
        for key, verdicts in verdicts_of(tracks[part::PARTS], starts_of(others)).items():
            found[key] += verdicts
    return {key: found[key] for key in sorted(found)}
