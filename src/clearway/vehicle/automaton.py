"""Movement automaton (def. 12): the few movements that a vehicle is flown with, and their limits.

A movement holds constant inputs for a duration. The automaton says which movement may follow in
which state, and predicts where it ends: exactly by the vehicle's model, or by a measured table.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.checks import kind_of, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State, Trajectory
from clearway.vehicle import abilities
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.copter import CopterLimits, build_copter
from clearway.vehicle.inertialess import InertialessModel
from clearway.vehicle.model import PlaneModel, Vehicle
from clearway.vehicle.movement import Movement as Movement
from clearway.vehicle.movement import inertialess_movements, plane_movements
from clearway.vehicle.table import MovementTable


@dataclass(frozen=True)
class MovementAutomaton:
    """Movements, their limits and their predictor: (3.15), def. 12.

    As a hybrid automaton (3.10), def. 7, its discrete states are the movements, its vector field is
    the vehicle's, `is_allowed` is its transition map, and nothing is reset.

    Raises
    ------
    ClearwayError
        For no movements, names used twice, a table without some movement, or unknown names in
        `forbidden`.

    Examples
    --------
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=5.0, turn_step_deg=15.0)
    >>> len(automaton.names), round(automaton.turning_radius_m, 1)
    (9, 19.1)
    """

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
        if not isinstance(self.movements, tuple):
            raise ClearwayError("movement automaton: movements must be a tuple of Movement")
        for movement in self.movements:
            kind_of("movement automaton: movements", movement, Movement)
        if self.table is not None and not isinstance(self.table, MovementTable | ClassTable):
            kind_of("movement automaton: table", self.table, MovementTable)
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
        if not isinstance(self.forbidden, frozenset):
            kind_of("movement automaton: forbidden", self.forbidden, frozenset)
        unknown = {name for pair in self.forbidden for name in pair} - set(names)
        if unknown:
            raise ClearwayError(f"forbidden transitions name unknown movements {sorted(unknown)}")

    @classmethod
    def plane(
        cls,
        speed_mps: float = 1.0,
        turn_step_deg: float = 15.0,
        *,
        duration_s: float = 1.0,
        pitch_limit_deg: float | None = 30.0,
        diagonals: bool = True,
    ) -> MovementAutomaton:
        """Make the automaton of section 4.3: nine movements, or the five without diagonals.

        Parameters
        ----------
        speed_mps
            Along the path.
        turn_step_deg
            Turn in one movement, of yaw or pitch.
        duration_s
            Of every movement.
        pitch_limit_deg
            Pitch that no movement may exceed, up or down; None for no limit.
        diagonals
            Whether it turns and climbs at once.

        Returns
        -------
        MovementAutomaton
            Of a vehicle that keeps its speed.

        Raises
        ------
        ClearwayError
            For numbers out of range.
        """
        movements = plane_movements(speed_mps, turn_step_deg, duration_s, diagonals=diagonals)
        if pitch_limit_deg is None:
            return cls(movements)
        if problem := number_problem("plane: pitch_limit_deg", pitch_limit_deg):
            raise ClearwayError(problem)
        return cls(movements, float(np.radians(pitch_limit_deg)))

    @classmethod
    def inertialess(
        cls,
        speed_mps: float = 1.0,
        turn_step_deg: float = 15.0,
        *,
        duration_s: float = 1.0,
        steepest_deg: float = 30.0,
        climb_mps: float | None = None,
        spot_turn_deg: float = 45.0,
        slow_mps: Sequence[float] | None = None,
        diagonals: bool = True,
    ) -> MovementAutomaton:
        """Make the automaton of a vehicle that can stop at once.

        It flies ahead, up, down and slower, turns on the spot, and has `Hold`.

        Parameters
        ----------
        speed_mps
            Ahead, and along the way up and down.
        turn_step_deg
            Turn in one movement in flight.
        duration_s
            Of every movement.
        steepest_deg
            Steepest way up and down.
        climb_mps
            Straight up and down, and the most on the way ahead; 0 keeps it level. By default what
            the steepest way ahead climbs.
        spot_turn_deg
            Turn in one movement on the spot.
        slow_mps
            Slower speeds ahead, with the same turns; by default half the speed.
        diagonals
            Whether it turns and climbs at once.

        Returns
        -------
        MovementAutomaton
            Of a vehicle without inertia.

        Raises
        ------
        ClearwayError
            For numbers out of range.

        Examples
        --------
        >>> import clearway as cw
        >>> automaton = cw.MovementAutomaton.inertialess(speed_mps=2.0)
        >>> automaton.can_stop, automaton.predict([0.0] * 6, automaton["Up"])[:3].round(2).tolist()
        (True, [1.73, 0.0, 1.0])
        """
        movements = inertialess_movements(
            speed_mps,
            turn_step_deg,
            duration_s,
            steepest_deg,
            climb_mps,
            spot_turn_deg,
            slow_mps,
            diagonals=diagonals,
        )
        return cls(movements, 0.0, vehicle=InertialessModel())

    @classmethod
    def multirotor(
        cls,
        speed_mps: float = 5.0,
        *,
        acceleration_mps2: float = 3.0,
        climb_mps: float = 2.0,
        sink_mps: float = 1.5,
        yaw_rate_deg_s: float = 90.0,
        lag_s: float = 0.1,
        gusts_mps: float = 1.0,
    ) -> MovementAutomaton:
        """Make the automaton of a copter with inertia.

        It accelerates, keeps its speed, brakes, turns and climbs.

        Parameters
        ----------
        speed_mps
            Greatest speed over the ground.
        acceleration_mps2
            Greatest acceleration.
        climb_mps
            Greatest speed upwards.
        sink_mps
            Greatest speed downwards.
        yaw_rate_deg_s
            Greatest rate of yaw.
        lag_s
            How late it answers, which widens the tube within which it follows its plan.
        gusts_mps
            Gusts that it has to bear, which widen the tube too.

        Returns
        -------
        MovementAutomaton
            With a table of classes of motion.

        Raises
        ------
        InputError
            For numbers out of range.

        Examples
        --------
        >>> import clearway as cw
        >>> automaton = cw.MovementAutomaton.multirotor(speed_mps=10.0)
        >>> automaton.has_inertia, automaton.can_stop, automaton.fastest_mps
        (True, True, 10.0)
        """
        return cls.of_copter(
            CopterLimits(
                speed_mps, acceleration_mps2, climb_mps, sink_mps, yaw_rate_deg_s, lag_s, gusts_mps
            )
        )

    @classmethod
    def of_copter(cls, limits: CopterLimits) -> MovementAutomaton:
        """Make the automaton of a copter, as `multirotor` does.

        Parameters
        ----------
        limits
            What the copter can do.

        Returns
        -------
        MovementAutomaton
            With a table of classes of motion.
        """
        movements, table = build_copter(kind_of("copter: limits", limits, CopterLimits))
        return cls(movements, 0.0, vehicle=InertialessModel(), table=table)

    def __repr__(self) -> str:
        limit = self.pitch_limit_rad
        return one_line(
            "MovementAutomaton",
            (
                f"{len(self.movements)} movements",
                f"up to {self.fastest_mps:g} m/s",
                "no pitch limit" if limit is None else f"pitch within {np.degrees(limit):.3g} deg",
                *([] if self.table is None else ["measured table"]),
                *(["can stop"] if self.can_stop else []),
            ),
        )

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
        return end <= self.pitch_limit_rad + abilities.PITCH_TOLERANCE_RAD or end < start

    @cached_property
    def mirror(self) -> tuple[int, ...] | None:
        """Per movement the index of its mirror image left to right; None if one has none."""
        return abilities.mirror_images(self)

    @property
    def fastest_mps(self) -> float:
        """Fastest speed along the path of any movement."""
        return max(movement.pace_mps for movement in self.movements)

    @property
    def start_mps(self) -> float:
        """Speed that a flight begins with: none for what can stop, else that of the first movement
        that goes straight on."""
        if self.can_stop:
            return 0.0
        straight = (m.speed_mps for m in self.movements if not m.turn_rate_rps and not m.climb_mps)
        return next(straight, self.fastest_mps)

    @property
    def classes(self) -> ClassTable | None:
        """What movements do by the class of motion that they begin in; None where it is one."""
        return self.table if isinstance(self.table, ClassTable) else None

    @property
    def has_inertia(self) -> bool:
        """Whether classes of motion are speeds: the vehicle accelerates and brakes."""
        return self.classes is not None and self.classes.has_speeds

    def in_class(self, state: State, at: int | None) -> State:
        """Return a state as decisions take it: in its class of motion, where there are any.

        Else without roll and pitch where they do not matter, and as it is where they do.

        Parameters
        ----------
        state
            World frame.
        at
            The class; None for the first.

        Returns
        -------
        State
            At the same time and position.
        """
        if self.classes is None:
            return self.upright(state)
        label = self.classes.label_of(self.classes.first if at is None else at)
        return replace(state, attitude_rad=np.array([label, 0.0, state.attitude_rad[2]]))

    def tube_m(self, movements: npt.ArrayLike) -> FloatArray:
        """Return within how far of its prediction the vehicle is: def. 13.

        Parameters
        ----------
        movements
            Numbers of movements flown since the prediction, of any shape.

        Returns
        -------
        FloatArray
            As measured, of that shape, in metres; 0 where nothing was.
        """
        if self.classes is None:
            return np.zeros(np.shape(movements))
        return self.classes.tube_at(movements)

    @cached_property
    def stands(self) -> tuple[bool, ...]:
        """Per movement whether it stays where it is, and may be repeated for ever.

        Holding, and turning on the spot: neither place nor roll and pitch change.
        """
        return abilities.find_standing(self)

    @cached_property
    def can_stop(self) -> bool:
        """Whether some movement stands: the vehicle may stay where it is for as long as it likes.

        It then needs no room to circle.
        """
        return any(self.stands)

    @cached_property
    def hold(self) -> Movement | None:
        """The movement to stay with: the one that stands and turns least; None where none does."""
        standing = [m for m, stands in zip(self.movements, self.stands, strict=True) if stands]
        return min(standing, key=lambda movement: abs(movement.yaw_rate_rps), default=None)

    @cached_property
    def keeps_attitude(self) -> bool:
        """Whether roll and pitch neither change nor matter: tilting is no part of the way."""
        return abilities.keeps_attitude(self)

    def upright(self, state: State) -> State:
        """Return a state without roll and pitch, where they do not matter.

        Parameters
        ----------
        state
            World frame.

        Returns
        -------
        State
            As it is, where roll and pitch do matter.
        """
        if not self.keeps_attitude or not state.attitude_rad[:2].any():
            return state
        return replace(state, attitude_rad=np.array([0.0, 0.0, state.attitude_rad[2]]))

    @cached_property
    def spot_turn_m_per_rad(self) -> float:
        """What it costs to turn on the spot, as way that could have been flown; inf if it can't."""
        return abilities.spot_turn_m_per_rad(self)

    @property
    def room_to_turn_m(self) -> float:
        """Room that it takes to turn away from what is ahead; none for what can stop."""
        return 0.0 if self.can_stop else self.turning_radius_m

    @cached_property
    def stopping_m(self) -> float:
        """Way to a stop from the greatest speed, with the movement before it is decided; of what
        changes its speed at once, or never stops, 0."""
        return abilities.stopping_m(self)

    @cached_property
    def turning_radius_m(self) -> float:
        """Smallest v / omega of the level turns; inf when nothing turns in flight."""
        return abilities.turning_radius_m(self)

    @cached_property
    def level_ends(self) -> FloatArray:
        """[n, 6] where the movements end that may be flown from level flight; as measured, those
        that are flown on and on."""
        return abilities.level_ends(self)

    @cached_property
    def stays_level(self) -> bool:
        """Whether no movement leads out of level flight: its height is not the vehicle's choice."""
        return abilities.stays_level(self)

    @cached_property
    def climbs_ahead(self) -> bool:
        """Whether climbing is a movement, and always one that leads ahead: none goes straight up or
        down, and no pitch is held."""
        return abilities.climbs_ahead(self)

    @cached_property
    def steepest_rad(self) -> float | None:
        """Steepest way up or down: the pitch limit, or a movement that climbs steeper by itself.

        None without a pitch limit.
        """
        return abilities.steepest_rad(self)

    @cached_property
    def step_m(self) -> float:
        """Longest way from start to end of a movement in level flight, whatever came before it."""
        return abilities.step_m(self)

    @cached_property
    def start_pitches_rad(self) -> tuple[float, ...]:
        """Pitches that chains of movements reach from level flight, ascending.

        Reach sets are built for these; without a pitch limit only for level flight. Where turn
        steps make more than 25 of them, that many spread over the limits.
        """
        return abilities.start_pitches_rad(self)

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
