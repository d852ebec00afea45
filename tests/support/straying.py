"""How far aircraft stray from straight flight, in models and in recordings, and how well that is
covered by `traffic.growth`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import BoolArray
from clearway.studies.encounter_model import EncounterModel, sample_tracks
from clearway.traffic.growth import Growth, TwoKinds
from clearway.traffic.recorded import Aircraft
from clearway.traffic.recorded.geodesy import planar_offset_m
from clearway.traffic.recorded.samples import sample_aircraft
from clearway.traffic.tracking.smooth import CLIMBS_MPS, TURNS_RPS

BEFORE_S = 20
"""Of a model's track before it is looked at."""
TURN_WINDOW_S = 4
CLIMB_WINDOW_S = 10
"""Over which turns and climbs are told."""
EVERY_S = 20
"""Between the moments at which a recorded track is looked at."""


@dataclass(frozen=True, eq=False)
class Strays:
    """Errors of straight prediction, from n moments."""

    ahead_s: tuple[int, ...]
    speed_mps: FloatArray
    """[n]"""
    turns: BoolArray
    """[n]"""
    climbs: BoolArray
    """[n]"""
    level_m: FloatArray
    """[n, ahead] distance, NaN where unknown."""
    height_m: FloatArray
    """[n, ahead] absolute."""
    of: tuple[str, ...] = ()
    """[n] which aircraft, where there are several."""


def strays_of_model(model: EncounterModel, count: int, ahead_s: Sequence[int], seed: int) -> Strays:
    """Of sampled tracks, one moment each."""
    rng = np.random.default_rng([seed, 73])
    tracks = sample_tracks(model, count, BEFORE_S + max(ahead_s) + 1, rng)
    place = tracks.position_m
    velocity = place[:, BEFORE_S] - place[:, BEFORE_S - 1]
    then = BEFORE_S - TURN_WINDOW_S
    before = place[:, then] - place[:, then - 1]
    now_rad, then_rad = (np.arctan2(v[:, 1], v[:, 0]) for v in (velocity, before))
    turn = np.abs(wrap_angle(now_rad - then_rad)) / TURN_WINDOW_S
    off = np.stack(
        [place[:, BEFORE_S + s] - place[:, BEFORE_S] - s * velocity for s in ahead_s], axis=1
    )
    return Strays(
        tuple(ahead_s),
        np.hypot(velocity[:, 0], velocity[:, 1]),
        turn > float(TURNS_RPS),
        np.abs(velocity[:, 2]) > CLIMBS_MPS,
        np.hypot(off[..., 0], off[..., 1]),
        np.abs(off[..., 2]),
    )


def strays_of_recording(aircraft: Sequence[Aircraft], ahead_s: Sequence[int]) -> Strays:
    """Of recorded tracks by the velocities that they report, every 20 s; heights barometric where
    known, climbs the mean of the last 10 s."""
    samples = sample_aircraft(aircraft)
    rows: list[tuple[float, bool, bool, list[float], list[float], str]] = []
    height = np.where(np.isnan(samples.barometric_m), samples.geometric_m, samples.barometric_m)
    for number, one in enumerate(aircraft):
        mine = np.flatnonzero(samples.aircraft == number)
        at = {int(second): int(row) for second, row in zip(samples.second[mine], mine, strict=True)}
        for second, row in at.items():
            east, north = float(samples.east_mps[row]), float(samples.north_mps[row])
            turn_row, climb_row = at.get(second - TURN_WINDOW_S), at.get(second - CLIMB_WINDOW_S)
            if second % EVERY_S or turn_row is None or climb_row is None or math.isnan(east):
                continue
            was = math.atan2(float(samples.north_mps[turn_row]), float(samples.east_mps[turn_row]))
            turned = float(wrap_angle(math.atan2(north, east) - was)) / TURN_WINDOW_S
            climb = float(height[row] - height[climb_row]) / CLIMB_WINDOW_S
            level, up = [], []
            for ahead in ahead_s:
                later = at.get(second + ahead)
                if later is None:
                    level.append(math.nan)
                    up.append(math.nan)
                    continue
                x, y = planar_offset_m(
                    samples.latitude_deg[row], samples.longitude_deg[row],
                    samples.latitude_deg[later], samples.longitude_deg[later],
                )  # fmt: skip
                level.append(math.hypot(float(x) - ahead * east, float(y) - ahead * north))
                up.append(abs(float(height[later] - height[row]) - ahead * climb))
            rows.append(
                (math.hypot(east, north), abs(turned) > float(TURNS_RPS), abs(climb) > CLIMBS_MPS,
                 level, up, one.address)
            )  # fmt: skip
    count = len(ahead_s)
    return Strays(
        tuple(ahead_s),
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows], dtype=np.bool_),
        np.array([row[2] for row in rows], dtype=np.bool_),
        np.array([row[3] for row in rows]).reshape(-1, count),
        np.array([row[4] for row in rows]).reshape(-1, count),
        tuple(row[5] for row in rows),
    )


def covered(
    strays: Strays, growth: Growth, claim: float = 0.95, position_m: float = 0.0,
    velocity_mps: float = 0.0,
) -> list[tuple[float, float, int]]:  # fmt: skip
    """By time ahead: share of places within the radius that claims to hold a share, of heights
    likewise, and of how many.

    position_m, velocity_mps: deviations of what the prediction began with.
    """
    found = []
    for column, ahead in enumerate(strays.ahead_s):
        level, height = strays.level_m[:, column], strays.height_m[:, column]
        known = ~(np.isnan(level) | np.isnan(height))
        unsure = math.hypot(position_m, velocity_mps * ahead)
        inside = np.zeros((2, len(level)), dtype=np.bool_)
        for turns in (False, True):
            these = strays.turns == turns
            kinds = growth.of(turns=turns, climbs=False)[0]
            inside[0, these] = (
                _chance(level[these], kinds, ahead, strays.speed_mps[these], unsure, plane=True)
                <= claim
            )
        for climbs in (False, True):
            these = strays.climbs == climbs
            kinds = growth.of(turns=False, climbs=climbs)[1]
            inside[1, these] = (
                _chance(height[these], kinds, ahead, np.ones(int(these.sum())), unsure, plane=False)
                <= claim
            )
        count = int(known.sum())
        shares = inside[:, known].mean(axis=1) if count else np.full(2, np.nan)
        found.append((float(shares[0]), float(shares[1]), count))
    return found


def _chance(
    error: FloatArray,
    kinds: TwoKinds,
    ahead_s: float,
    scale: FloatArray,
    unsure: float,
    *,
    plane: bool,
) -> FloatArray:
    """[n] chance that an error is smaller than these."""
    from scipy.special import erf

    share, steady, strays = (float(one[0]) for one in kinds.at(np.array([float(ahead_s)])))
    chance = np.zeros(len(error))
    for weight, deviation in ((1.0 - share, steady), (share, strays)):
        std = np.maximum(np.hypot(scale * deviation, unsure), 1e-6)
        ratio = error / std
        chance += weight * (1.0 - np.exp(-0.5 * ratio**2) if plane else erf(ratio / math.sqrt(2.0)))
    found: FloatArray = chance
    return found
