"""What stays the same from decision to decision: reach sets and their costs, settings, rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, fields, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from clearway.avoidance.clear.loiter import Stops, loiter_circles
from clearway.avoidance.plan.costs import (
    Prices,
    StageCost,
    TerminalCost,
    length_and_prices,
    price_of,
    turning_distance_to_go,
)
from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.time_cost import time_flown_m, time_to_go_m
from clearway.avoidance.rate.fusion import OwnRating, Rating, own_rating, rating_named
from clearway.avoidance.rules import MOST_RULES, Rule
from clearway.base.brief import one_line
from clearway.base.checks import LARGEST, kind_of, number_problem
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.lazily import Lazily
from clearway.base.state import State
from clearway.base.suggest import did_you_mean
from clearway.reach.escapes.braking import stopping_ways
from clearway.reach.escapes.library import EscapeLibrary
from clearway.reach.store import ReachLibrary
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.automaton_performance import derive_performance
from clearway.vehicle.performance import Performance

BRAKING = (
    "unobserved_m: an escape of a vehicle with inertia brakes to rest, and braking later than it "
    "sees is how it would hit; only vehicles without inertia may cross unobserved space. Leave the "
    "key out, and fly more slowly or see farther instead"
)


def look_up_tube(automaton: MovementAutomaton, reach_set: ReachSet) -> FloatArray | None:
    """[nodes] within how far of its prediction the vehicle is on each movement: def. 13."""
    classes = automaton.classes
    if classes is None:
        return None
    if not classes.has_speeds:
        return automaton.tube_m(reach_set.depth)
    ends = classes.class_tube_m[classes.classes_at(reach_set.states[:, 3])]
    return np.maximum(ends, np.where(reach_set.parent >= 0, ends[reach_set.parent], ends))


def suit_prices(
    settings: AvoidanceSettings, automaton: MovementAutomaton, grid: AvoidanceGrid
) -> Prices:
    """Return the cost weights of the settings, as they suit a vehicle and its field of view."""
    lowest, highest = grid.elevation_edges_rad[[0, -1]].tolist()
    return settings.prices.suit_vehicle(
        lopsided=not np.isclose(lowest, -highest),
        can_stop=automaton.can_stop,
        has_inertia=automaton.has_inertia,
        unseen_is_free=settings.escape == Escape.KNOWN,
    )


def _without_turning_back(
    prepared: PreparedReachSet, automaton: MovementAutomaton, previous: int, prices: Prices
) -> PreparedReachSet:
    """Turning back on the spot, after a turn there by the movement flown last, costs as much as
    changing sides: who turns there sees another way at every turn, and would do so for ever."""
    turns = np.array([m.yaw_rate_rps for m in automaton.movements]) * automaton.stands
    back = (turns * turns[previous] < 0.0)[prepared.first_movement]
    price_m = price_of(prices.other_side) * automaton.step_m
    return replace(prepared, path_cost_m=prepared.path_cost_m + price_m * back)


def _by_time(prepared: PreparedReachSet, automaton: MovementAutomaton) -> PreparedReachSet:
    """With what a movement flies at most as the unit of cost weights, and room to brake."""
    classes, reach_set = automaton.classes, prepared.reach_set
    assert classes is not None  # Only vehicles with inertia come here.
    stops = Stops(
        stopping_ways(classes), classes.class_tube_m, classes.classes_at(reach_set.states[:, 3])
    )
    room = loiter_circles(reach_set, 0.0, stops)
    return replace(prepared, step_m=automaton.step_m, may_stay=True, loiter=room)


@dataclass(frozen=True, eq=False)
class Planner:
    """What stays the same from decision to decision: reach sets, costs, settings.

    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> cw.Planner.of(library, cw.AvoidanceSettings(safety_margin_m=1.0))
    Planner(9 movements up to 1 m/s, 5 reach sets to 10 m, margin 1 m, 0 rules)
    """

    automaton: MovementAutomaton
    grid: AvoidanceGrid
    _: KW_ONLY
    prepared_sets: Sequence[tuple[float, PreparedReachSet]]
    """(start pitch, reach set with its costs), ascending; of a vehicle with inertia one for each
    class of motion, prepared when it is first flown from."""
    settings: AvoidanceSettings
    terminal_cost: TerminalCost = turning_distance_to_go
    rules: tuple[Rule, ...] = ()
    """The most important first."""
    rating: OwnRating | None = None
    """The user's own, in place of the one that the settings name."""

    def __post_init__(self) -> None:
        if self.settings.escape == Escape.BUDGETED and self.automaton.has_inertia:
            raise InputError("settings", BRAKING)

    @classmethod
    def of(
        cls,
        library: ReachLibrary,
        settings: AvoidanceSettings | None = None,
        *,
        stage_cost: StageCost = length_and_prices,
        terminal_cost: TerminalCost = turning_distance_to_go,
        rules: Sequence[Rule] = (),
        rating: OwnRating | None = None,
    ) -> Planner:
        """Evaluate the costs of (4.6) that do not change.

        Parameters
        ----------
        library
            Reach sets of the vehicle in its grid.
        settings
            How it senses, remembers and decides; by default those of the static mission.
        stage_cost
            Cost of each movement in metres; the default, or the user's own.
        terminal_cost
            Cost to go from the end of a trajectory in metres; the default, or the user's own.
        rules
            The most important first; see `avoidance.rules`.
        rating
            The user's own, in place of the one that the settings name.

        Returns
        -------
        Planner
            What stays the same from decision to decision.

        Raises
        ------
        ClearwayError
            For too many rules.
        InputError
            For settings that the vehicle cannot fly with.
        """
        kind_of("planner: library", library, ReachLibrary)
        settings = AvoidanceSettings() if settings is None else settings
        kind_of("planner: settings", settings, AvoidanceSettings)
        automaton = library.automaton
        prices = suit_prices(settings, automaton, library.grid)
        if automaton.has_inertia:
            if stage_cost is length_and_prices:
                stage_cost = partial(time_flown_m, automaton=automaton)
            if terminal_cost is turning_distance_to_go:
                terminal_cost = time_to_go_m
        kind_of("planner: rules", rules, Sequence)  # type: ignore[type-abstract]
        if len(rules) > MOST_RULES:
            raise ClearwayError(f"rules: {len(rules)} are too many; at most {MOST_RULES}")

        def prepare(number: int) -> tuple[float, PreparedReachSet]:
            reach_set = library.reach_sets[number]
            prepared = PreparedReachSet.of(
                reach_set,
                prices,
                stage_cost,
                automaton.room_to_turn_m,
                look_up_tube(automaton, reach_set),
            )
            if automaton.has_inertia:
                prepared = _by_time(prepared, automaton)
            elif automaton.classes is not None:
                prepared = _without_turning_back(prepared, automaton, number, prices)
            return reach_set.start_pitch_rad, prepared

        count = len(library.reach_sets)
        prepared_sets: Sequence[tuple[float, PreparedReachSet]] = Lazily(count, prepare)
        if not automaton.has_inertia:
            prepared_sets = tuple(prepared_sets)
        priced = automaton.climbs_ahead or automaton.can_stop
        if terminal_cost is turning_distance_to_go and priced:
            terminal_cost = partial(turning_distance_to_go, prices=prices)
        return cls(
            library.automaton,
            library.grid,
            prepared_sets=prepared_sets,
            settings=settings,
            terminal_cost=terminal_cost,
            rules=tuple(rules),
            rating=rating,
        )

    def with_values(self, **settings: Any) -> Planner:
        """Return the same planner with other values of its settings.

        Parameters
        ----------
        **settings
            Fields of `AvoidanceSettings`, but for `prices`, which are part of the prepared costs
            already.

        Returns
        -------
        Planner
            With the same reach sets, costs and rules.

        Raises
        ------
        InputError
            For values that cannot be used, and keys that are none.
        """
        known = [one.name for one in fields(AvoidanceSettings) if one.init]
        if unknown := [key for key in settings if key not in known]:
            near = did_you_mean(unknown[0], known)
            valid = f"valid keys are {', '.join(known)}"
            raise InputError("settings", f"{unknown[0]}: unknown key{near}; {valid}")
        if "prices" in settings:
            raise InputError("settings.prices", "part of the prepared costs; use Planner.of")
        return replace(self, settings=replace(self.settings, **settings))

    def __repr__(self) -> str:
        return one_line(
            "Planner",
            (
                f"{len(self.automaton.movements)} movements up to {self.speed_mps:g} m/s",
                f"{len(self.prepared_sets)} reach sets to {self.grid.range_m:g} m",
                f"margin {self.settings.safety_margin_m:g} m",
                f"{len(self.rules)} rules",
            ),
        )

    @cached_property
    def cell_rating(self) -> Rating:
        """How evidence becomes a rating."""
        if self.rating is not None:
            return own_rating("planner: rating", self.rating)
        return rating_named(self.settings.rating)

    @cached_property
    def prices(self) -> Prices:
        """Those of the settings, as they suit the vehicle."""
        return suit_prices(self.settings, self.automaton, self.grid)

    @property
    def threshold(self) -> float:
        """P_R that a trajectory must have; none of a vehicle with inertia: its cells are too coarse
        for gaps that it verifies."""
        return 0.0 if self.automaton.has_inertia else self.settings.threshold

    @cached_property
    def speed_mps(self) -> float:
        """Fastest speed of the automaton."""
        return self.automaton.fastest_mps

    @cached_property
    def escapes(self) -> EscapeLibrary | None:
        """Ways to stay safe for ever; None where none is asked for, or the vehicle has none."""
        if self.settings.escape == Escape.OFF or not self.settings.verify:
            return None
        library = EscapeLibrary.of(self.automaton)
        return library if library.exists else None

    @cached_property
    def performance(self) -> Performance:
        """What the automaton can do in the next minute."""
        return derive_performance(self.automaton)

    @cached_property
    def escape_reach_m(self) -> float:
        """How far escapes lead; 0 where none is asked for."""
        return 0.0 if self.escapes is None else self.automaton.step_m + self.escapes.reach_m

    @cached_property
    def horizon_s(self) -> float:
        """How far ahead in time trajectories lead, at least what the range takes."""
        # Those of a vehicle with inertia take equally long.
        sets = self.prepared_sets[:1] if self.automaton.has_inertia else self.prepared_sets
        longest = max(float(one.reach_set.end_time_s.max()) for _, one in sets)
        return max(self.grid.range_m / self.speed_mps, longest)

    def prepare_at(self, state: State) -> PreparedReachSet:
        """Return the reach set whose start pitch is nearest, flown from the true attitude.

        What is verified is then what is flown, from whatever attitude.

        Parameters
        ----------
        state
            Own state estimate, world frame.

        Returns
        -------
        PreparedReachSet
            With its costs, in the grid frame.
        """
        roll, pitch, _ = state.attitude_rad.tolist()
        classes = self.automaton.classes
        if classes is not None:  # Rooted in each class already.
            return self.prepared_sets[classes.class_at(roll)][1]
        return self.prepare(pitch).fly_from(self.automaton, roll, pitch)

    def prepare(self, pitch_rad: float) -> PreparedReachSet:
        """Return the reach set whose start pitch is nearest; the flatter one of two.

        Parameters
        ----------
        pitch_rad
            Nose down positive.

        Returns
        -------
        PreparedReachSet
            With its costs, in the grid frame.
        """
        if problem := number_problem("pitch_rad", pitch_rad, -LARGEST):
            raise ClearwayError(problem)
        return min(
            self.prepared_sets, key=lambda entry: (abs(entry[0] - pitch_rad), abs(entry[0]))
        )[1]


def prepare_next(planner: Planner, at: int | None) -> bool:
    """Prepare one reach set that the next decisions may ask for, before they do.

    Parameters
    ----------
    planner
        Of a vehicle with inertia.
    at
        The class of motion that is flown; None for the first.

    Returns
    -------
    bool
        Whether there was one to prepare.
    """
    sets, classes = planner.prepared_sets, planner.automaton.classes
    if classes is None or not isinstance(sets, Lazily):
        return False
    now = classes.first if at is None else at
    next_ones = [now, *sorted({end for end in classes.following[now].tolist() if end >= 0})]
    missing = next((each for each in next_ones if not sets.has(each)), None)
    if missing is not None:
        sets[missing]
    return missing is not None
