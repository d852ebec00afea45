"""The ownship in place of an aircraft of a real encounter: recorded, without avoidance, with it.

The three ways share the place, the time and all other aircraft, which fly as recorded whatever the
ownship does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.base.frames import FloatArray
from clearway.missions.encounter_mission import FlownAs, encounter_mission
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, Notice, prepare
from clearway.sim import Run
from clearway.traffic.recorded.approach import Approach, closest_approach
from clearway.traffic.recorded.own_part import OwnPart
from clearway.traffic.recorded.playing import PlayedTrack

SAMPLE_S = 1.0
"""Between the moments at which recorded tracks are compared."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way through the encounter."""

    track: FloatArray
    """[n, 4] time since the start, position."""
    closest: Approach | None
    """To the other aircraft of the encounter; None where both are never reported at once."""
    nearest: tuple[str, Approach] | None
    """The aircraft that came nearest of all."""
    path_length_m: float


@dataclass(frozen=True, eq=False)
class InPlaceFlight:
    """An encounter flown in place of one of its aircraft."""

    part: OwnPart
    file: MissionFile
    setup: FlightSetup
    recorded: Way
    without: Way
    """The same vehicle on the same route, told of nobody."""
    avoiding: Way
    unheard_s: float
    """How much of the recorded route the other aircraft is silent for."""
    run_without: Run
    run: Run
    others: Mapping[str, FloatArray]
    """[m, 4] tracks of the others while reported, during the recorded route, by address."""

    @property
    def keep_m(self) -> float:
        """Distance to keep: the margin, and what the heights may be off."""
        other = self.part.other.address
        step = next((t.radius_m for t in self._tracks if t.name == other), 0.0)
        return self.run.safety_margin_m + step

    @property
    def added_m(self) -> float:
        """Path length that avoidance added."""
        return self.avoiding.path_length_m - self.without.path_length_m

    @property
    def _tracks(self) -> tuple[PlayedTrack, ...]:
        return () if self.setup.recorded is None else self.setup.recorded.tracks


def fly_in_place(
    part: OwnPart, recording: str | Path, flown: FlownAs | None = None, notice: Notice | None = None
) -> InPlaceFlight:
    """Fly the part of one aircraft twice, and hold both flights against the recording.

    Raises InputError for settings that no vehicle can have, and FlightRefusedError where the
    mission cannot be flown.
    """
    file = encounter_mission(part, recording, flown or FlownAs())
    setup = prepare(file, notice)
    without, avoiding = setup.fly_deaf(), setup.fly()
    tracks = setup.recorded.tracks if setup.recorded is not None else ()
    moments = np.arange(part.closest_s % SAMPLE_S, part.until_s + 1e-6, SAMPLE_S)
    others = {track.name: sample_times(track, moments) for track in tracks}
    own = sample_times(part.recorded, moments)
    heard = others.get(part.other.address, np.zeros((0, 4)))
    return InPlaceFlight(
        part=part,
        file=file,
        setup=setup,
        recorded=_way(own, others, part.other.address),
        without=_find_flown(without, part.other.address),
        avoiding=_find_flown(avoiding, part.other.address),
        unheard_s=SAMPLE_S * (len(moments) - len(heard)),
        run_without=without,
        run=avoiding,
        others={name: track for name, track in others.items() if len(track)},
    )


def sample_times(track: PlayedTrack, moments_s: FloatArray) -> FloatArray:
    """[m, 4] times and positions at those moments at which an aircraft is reported."""
    rows = [
        (moment, *place)
        for moment, place in ((moment, track.at(float(moment))) for moment in moments_s)
        if place is not None
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _find_flown(run: Run, other: str) -> Way:
    return _way(np.column_stack([run.time_s, run.states[:, :3]]), run.intruder_tracks, other)


def _way(own: FloatArray, others: Mapping[str, FloatArray], other: str) -> Way:
    approaches = [(name, closest_approach(own, track)) for name, track in others.items()]
    met = [(name, approach) for name, approach in approaches if approach is not None]
    steps = np.linalg.norm(np.diff(own[:, 1:], axis=0), axis=1)
    return Way(
        track=own,
        closest=next((approach for name, approach in met if name == other), None),
        nearest=min(met, key=lambda entry: entry[1].slant_m, default=None),
        path_length_m=float(steps.sum()),
    )
