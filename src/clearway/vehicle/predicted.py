"""Movements by name: which may follow which, and where each leads: (3.15), (4.16).

Each is predicted exactly by the vehicle's model, or by a measured table.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.checks import kind_of, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import Trajectory
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.model import PlaneModel, Vehicle
from clearway.vehicle.movement import Movement
from clearway.vehicle.table import MovementTable

PITCH_TOLERANCE_RAD = 1e-9
"""Four times Up lands on a limit of four steps in spite of rounding."""


@dataclass(frozen=True)
class PredictedMovements:
    """Movements, what limits them, and their predictor: def. 12."""

    movements: tuple[Movement, ...]
    pitch_limit_rad: float | None = None
    """|pitch| that no movement may exceed; None for no limit."""
    _: KW_ONLY
    vehicle: Vehicle = field(default_factory=PlaneModel)
    table: MovementTable | ClassTable | None = None
    """Where given, it predicts in place of the vehicle's model: (4.14), (4.15)."""
    forbidden: frozenset[tuple[str, str]] = frozenset()
    """Pairs of movement names (first, next) that may not follow each other, the transition map of
    (3.15)."""

    def __post_init__(self) -> None:
        for movement in kind_of("movement automaton: movements", self.movements, tuple):
            kind_of("movement automaton: movements", movement, Movement)
        if self.table is not None and not isinstance(self.table, MovementTable | ClassTable):
            raise ClearwayError(
                f"movement automaton: table must be a MovementTable, got {self.table!r}"
            )
        names = self.names
        if not names:
            raise ClearwayError("movement automaton: at least one movement is needed")
        if len(set(names)) < len(names):
            raise ClearwayError(f"movement automaton: movement names must differ, got {names}")
        limit_rad = self.pitch_limit_rad
        if limit_rad is not None and number_problem("pitch_limit_rad", limit_rad):
            raise ClearwayError("movement automaton: pitch limit must be a number >= 0, or None")
        lacking = set(names) - set(self.table.names if self.table else names)
        if lacking:
            raise ClearwayError(f"movement table lacks {', '.join(sorted(lacking))}")
        kind_of("movement automaton: forbidden", self.forbidden, frozenset)
        unknown = {name for pair in self.forbidden for name in pair} - set(names)
        if unknown:
            raise ClearwayError(f"forbidden transitions name unknown movements {sorted(unknown)}")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the movements, in order."""
        return tuple(movement.name for movement in self.movements)

    @cached_property
    def _by_name(self) -> dict[str, Movement]:
        return {movement.name: movement for movement in self.movements}

    def __getitem__(self, name: str) -> Movement:
        """The movement of that name; raises ClearwayError listing the valid ones."""
        try:
            return self._by_name[name]
        except KeyError:
            raise ClearwayError(
                f"no movement {name!r}; the automaton has {', '.join(self.names)}"
            ) from None

    def chain(self, names: Iterable[str]) -> tuple[Movement, ...]:
        """Return movements by name, in order.

        Parameters
        ----------
        names
            As in `names` of the automaton.

        Returns
        -------
        tuple of Movement
            One per name.

        Raises
        ------
        ClearwayError
            For a name that the automaton does not have.
        """
        by_name = self._by_name
        return tuple([by_name[name] if name in by_name else self[name] for name in names])

    @property
    def classes(self) -> ClassTable | None:
        """What movements do by the class of motion that they begin in; None where it is one."""
        return self.table if isinstance(self.table, ClassTable) else None

    @property
    def has_inertia(self) -> bool:
        """Whether classes of motion are speeds: the vehicle accelerates and brakes."""
        return self.classes is not None and self.classes.has_speeds

    def predict(
        self, state: npt.ArrayLike, movement: Movement, duration_s: float | None = None
    ) -> FloatArray:
        """Predict the state after a movement: (4.16), (3.21).

        Over its times that is the trajectory primitive (3.11), def. 8.

        Parameters
        ----------
        state
            [6] x, y, z, roll, pitch, yaw at the start, in metres and radians.
        movement
            What is flown.
        duration_s
            For how long; by default the whole movement.

        Returns
        -------
        FloatArray
            [6] the state then, in the frame of `state`.
        """
        duration = movement.duration_s if duration_s is None else duration_s
        if self.table is not None:
            return self.table.predict(state, movement.name, duration / movement.duration_s)
        return self.vehicle.advance(state, movement.inputs, duration)

    def predict_each(
        self, state: npt.ArrayLike, movement: Movement, durations_s: npt.ArrayLike
    ) -> FloatArray:
        """Predict the states at several times of a movement, as `predict` does.

        Parameters
        ----------
        state
            [6] x, y, z, roll, pitch, yaw at the start, in metres and radians.
        movement
            What is flown.
        durations_s
            [n] times from its start.

        Returns
        -------
        FloatArray
            [n, 6] the states then, in the frame of `state`.
        """
        if self.table is None and type(self.vehicle) is PlaneModel:
            return self.vehicle.advance_each(state, movement.inputs, durations_s)
        durations = np.asarray(durations_s, dtype=np.float64).tolist()
        each = [self.predict(state, movement, duration) for duration in durations]
        return np.array(each).reshape(-1, 6)

    def measure(self, steps: int = 1) -> MovementTable:
        """Fly each movement once from level flight, as tables 4.1 and 4.2 were made.

        Parameters
        ----------
        steps
            Rows of each movement, at equal times.

        Returns
        -------
        MovementTable
            What may predict in place of the vehicle's model.
        """
        level = np.zeros(6)
        return MovementTable.from_rows(
            {
                movement.name: [
                    self.predict(level, movement, movement.duration_s * step / steps)
                    for step in range(1, steps + 1)
                ]
                for movement in self.movements
            }
        )

    def is_allowed(
        self, state: npt.ArrayLike, movement: Movement, previous: Movement | None = None
    ) -> bool:
        """Return whether a movement may follow another in a state.

        It must end within the pitch limit; beyond the limit, whatever leads back towards it may
        be flown.

        Parameters
        ----------
        state
            [6] x, y, z, roll, pitch, yaw at the start, in metres and radians.
        movement
            What is to be flown.
        previous
            What was flown before it; None for nothing.

        Returns
        -------
        bool
            Whether it may be flown.
        """
        if previous is not None and (previous.name, movement.name) in self.forbidden:
            return False
        if self.has_inertia and self.classes is not None:
            at = self.classes.class_at(float(np.asarray(state)[3]))
            return bool(self.classes.following[at, self.names.index(movement.name)] >= 0)
        if self.pitch_limit_rad is None:
            return True
        start = abs(float(np.asarray(state)[4]))
        end = abs(float(self.predict(state, movement)[4]))
        return end <= self.pitch_limit_rad + PITCH_TOLERANCE_RAD or end < start

    def fly(
        self,
        state: npt.ArrayLike,
        legs: Iterable[tuple[Movement, float]],
        step_s: float = 0.05,
        start_s: float = 0.0,
    ) -> Trajectory:
        """Predict the path of movements, each held for a duration: (4.8), (4.16).

        Parameters
        ----------
        state
            [6] x, y, z, roll, pitch, yaw at the start, in metres and radians.
        legs
            Movements, each with its duration in seconds.
        step_s
            At most between two states (3.3); one is at the end of each leg.
        start_s
            Time of the start.

        Returns
        -------
        Trajectory
            Times and states, in the frame of `state`.
        """
        at = np.array(state, dtype=np.float64)
        time, times, states, names = start_s, [start_s], [at], []
        for movement, duration in legs:
            steps = max(1, int(np.ceil(duration / step_s - 1e-9)))
            for elapsed in duration * np.arange(1, steps + 1) / steps:
                times.append(time + float(elapsed))
                states.append(self.predict(at, movement, float(elapsed)))
            at, time = states[-1], times[-1]
            names.append(movement.name)
        return Trajectory(np.array(times), np.array(states), tuple(names))

    def rollout(
        self, state: npt.ArrayLike, names: Iterable[str], step_s: float = 0.05
    ) -> Trajectory:
        """Predict the path of whole movements by name, from time 0.

        Parameters
        ----------
        state
            [6] x, y, z, roll, pitch, yaw at the start, in metres and radians.
        names
            Of the movements, in order.
        step_s
            At most between two states.

        Returns
        -------
        Trajectory
            Times and states, in the frame of `state`.

        Raises
        ------
        ClearwayError
            For a name that the automaton does not have.
        """
        legs = [(movement, movement.duration_s) for movement in self.chain(names)]
        return self.fly(state, legs, step_s)
