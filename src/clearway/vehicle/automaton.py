"""Movement automaton (def. 12): the few movements that a vehicle is flown with, and their limits.

A movement holds constant inputs for a duration. The automaton says which movement may follow in
which state, and predicts where it ends: exactly by the vehicle's model, or by a measured table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.checks import kind_of, number_problem
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.vehicle.abilities import Abilities
from clearway.vehicle.copter import CopterLimits, build_copter
from clearway.vehicle.inertialess import InertialessModel
from clearway.vehicle.movement import Movement as Movement
from clearway.vehicle.movement import inertialess_movements, plane_movements


class MovementAutomaton(Abilities):
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
