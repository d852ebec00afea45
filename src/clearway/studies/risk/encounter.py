"""Encounters as the model has them: aircraft on any course enter a cylinder round the ownship.

Uncorrelated traffic is spread evenly and its course has nothing to do with ours, so aircraft enter
in proportion to the volume that the cylinder sweeps a second along the relative velocity. Those
that straight flight would meet are drawn more often, and weigh less.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M
from clearway.studies.encounter_model import EncounterModel, SampledTracks, sample_tracks
from clearway.studies.risk.candidates import WantedKinds, find_entered, take_candidate
from clearway.studies.risk.entry import Entries
from clearway.studies.risk.settings import RiskSettings

MOST_TRIES = 200
"""Draws of candidates before a kind of encounter counts as impossible."""
STEPS_PER_S = 4
"""Samples of a track in a second; it is straight between them."""


@dataclass(frozen=True, eq=False)
class ModelEncounter:
    """One encounter in the true world: the ownship starts at the origin and flies along x."""

    number: int
    weight: float
    """In proportion to how many such encounters there are for one that is drawn."""
    time_s: FloatArray
    """[n] evenly, from 0."""
    position_m: FloatArray
    """[n, 3] of the intruder."""
    velocity_mps: FloatArray
    """[n, 3] as it reports it: over the last step."""
    lasts_s: float
    """How long it is flown."""
    layer: int
    """Altitude layer that the intruder begins in, from 0."""
    own_height_m: float = math.inf
    """Of the ownship's straight flight above ground."""

    def at(self, time_s: float) -> tuple[FloatArray, FloatArray]:
        """Position and reported velocity [3] of the intruder at a time."""
        place = time_s * STEPS_PER_S
        before = min(max(int(place + 1e-9), 0), len(self.time_s) - 2)
        share = place - before
        position = (1.0 - share) * self.position_m[before] + share * self.position_m[before + 1]
        return position, self.velocity_mps[before]

    def at_all(self, time_s: FloatArray) -> FloatArray:
        """[n, 3] positions of the intruder at times [n]."""
        return np.stack(
            [np.interp(time_s, self.time_s, self.position_m[:, axis]) for axis in range(3)], axis=1
        )


def sample_encounter(
    model: EncounterModel, number: int, settings: RiskSettings, seed: int = 0
) -> ModelEncounter:
    """Draw the encounter of a number: it depends on that, seed, model and settings alone.

    Raises ClearwayError where no aircraft of the model meets an ownship between floor and ceiling.
    """
    rng = np.random.default_rng([seed, number, 70])
    for _ in range(MOST_TRIES):
        candidates = [
            candidate for _ in range(settings.tracks) for candidate in _draw(model, settings, rng)
        ]
        # What does not enter has no weight in any sum, so it need not be flown.
        weights = np.array([each.weight for each in candidates])
        if len(candidates) == 1:
            if candidates[0].weight > 0.0:
                return candidates[0].encounter(number, settings)
            continue
        of = settings.wanted
        found = take_candidate(weights, of.want[[each.kind(of) for each in candidates]], rng)
        if found is not None:
            chosen, weight = found
            return replace(candidates[chosen], weight=weight).encounter(number, settings)
    raise ClearwayError(
        f"{model.source}: no aircraft meets an ownship between {settings.floor_ft:g} and "
        f"{settings.ceiling_ft:g} ft; choose other altitude layers or another ceiling"
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    """A track and where it enters."""

    tracks: SampledTracks
    layer: int
    path_m: FloatArray
    """[n, 3] from the entry on, turned to its course."""
    velocity_mps: FloatArray
    """[n, 3]"""
    drift_m: FloatArray
    """[n, 3] relative to the ownship that flies straight on."""
    entry_m: FloatArray
    weight: float
    """0 for what does not enter, or must not."""
    nearest: int
    """Sample at which it comes nearest to straight flight."""
    last: int
    """Sample until which it is flown."""
    landed: int
    """Sample at which it lands, which ends the encounter; that of the last one if it does not."""

    def kind(self, of: WantedKinds) -> int:
        """Which cylinder straight flight enters first of all, the smallest first."""
        return find_entered(
            self.entry_m, self.drift_m, self.last + 1, of.radius_m, of.half_height_m
        )

    def encounter(self, number: int, settings: RiskSettings) -> ModelEncounter:
        velocity, tracks = self.velocity_mps, self.tracks
        return ModelEncounter(
            number,
            self.weight,
            time_s=tracks.time_s,
            position_m=self.path_m + self.entry_m,
            velocity_mps=np.concatenate([velocity[:1], velocity[:-1]]),
            lasts_s=min(
                self.nearest / STEPS_PER_S + settings.afterwards_s, self.landed / STEPS_PER_S
            ),
            layer=self.layer,
            own_height_m=_own_height_m(tracks, self.entry_m),
        )


def _draw(
    model: EncounterModel, settings: RiskSettings, rng: np.random.Generator
) -> Iterator[_Candidate]:
    """Ways in which one track enters."""
    seconds = int(np.ceil(settings.within_s + settings.afterwards_s))
    tracks = sample_tracks(model, 1, seconds, rng, settings.layers, STEPS_PER_S)
    course = 2.0 * np.pi * rng.random()
    cos, sin = np.cos(course), np.sin(course)
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    path = (tracks.position_m[0] - tracks.position_m[0, 0]) @ turned.T
    velocity = tracks.velocity_mps[0] @ turned.T
    own = np.array([settings.own_mps, 0.0, 0.0])
    drift = path - tracks.time_s[:, None] * own
    layer = int(tracks.bins[0, 0, model.index("L")])
    landed = _find_landing(model, tracks)
    met = drift[: min(int(settings.within_s * STEPS_PER_S), landed) + 1]
    entries = Entries(settings.shells, velocity[0] - own, met)
    upwards = np.array([1.0, 1.0, settings.stretch])
    for _ in range(settings.entries):
        entry, weight = entries.draw(rng)
        if settings.vehicle and not _flies(model, settings, _own_height_m(tracks, entry)):
            weight = 0.0
        nearest = int(np.argmin(np.linalg.norm((entry + met) * upwards, axis=1)))
        last = min(nearest + int(settings.afterwards_s * STEPS_PER_S), landed)
        yield _Candidate(tracks, layer, path, velocity, drift, entry, weight, nearest, last, landed)


def _find_landing(model: EncounterModel, tracks: SampledTracks) -> int:
    """Return the sample at which a track reaches the ground, where its model's scale begins."""
    last = len(tracks.time_s) - 1
    if model.span("L")[0] > 0.0:
        return last
    down = np.flatnonzero(tracks.position_m[0, 1:, 2] <= 0.0)
    return int(down[0]) + 1 if len(down) else last


def _flies(model: EncounterModel, settings: RiskSettings, own_height_m: float) -> bool:
    """Return whether an ownship may be at a height: above its floor, and below its ceiling.

    Only models that reach beyond the ceiling have encounters far above it.
    """
    ceiling_m = settings.ceiling_ft * FOOT_M
    beyond = model.span("L")[1] * FOOT_M > ceiling_m
    return own_height_m >= settings.floor_ft * FOOT_M and not (beyond and own_height_m > ceiling_m)


def _own_height_m(tracks: SampledTracks, entry_m: FloatArray) -> float:
    """Of the ownship's straight flight above ground."""
    return float(tracks.position_m[0, 0, 2] - entry_m[2])
