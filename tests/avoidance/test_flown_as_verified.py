"""What is verified is what is flown, from any attitude, and it keeps the pitch limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.model import PlaneModel
from worlds_for_tests import AUTOMATON, GRID, planner

PLANNER = planner()
PITCHES_DEG = (0.0, 15.0, -30.0, 7.4, -7.6, 22.0, 31.0, 45.0, -45.0, -2.0, 1e-8)


def plans(
    planner_: Planner, count: int, seed: int, pitches_deg: tuple[float, ...]
) -> list[Decision]:
    """Decisions among balls, from any place and attitude."""
    rng = np.random.default_rng(seed)
    made = []
    for n in range(count):
        pitch = np.radians(pitches_deg[n] if n < len(pitches_deg) else rng.uniform(-50.0, 50.0))
        attitude = np.array([rng.uniform(-0.5, 0.5), pitch, rng.uniform(-np.pi, np.pi)])
        state = State(rng.uniform(-50.0, 50.0, 3), attitude)
        balls = [
            Obstacle.ball(state.position_m + rng.normal(0.0, 6.0, 3), rng.uniform(0.1, 0.8))
            for _ in range(8)
        ]
        target = state.position_m + rng.uniform(-30.0, 30.0, 3)
        made.append(decide(planner_, Situation(state, target, obstacle_map=ObstacleMap(balls))))
    return made


def flown(planner_: Planner, decision: Decision) -> FloatArray:
    """[n, 6] states as the automaton predicts them, many to a movement."""
    return planner_.automaton.rollout(decision.state.vector, decision.movements, 0.01).states


def verified_off_m(planner_: Planner, decision: Decision) -> float:
    """How far the verified path lies from the one that the movements lead along."""
    at = decision.state.vector
    samples = decision.prepared.reach_set.samples_m.shape[1]
    places = [at[:3]]
    for movement in planner_.automaton.chain(decision.movements):
        places += [
            planner_.automaton.predict(at, movement, movement.duration_s * (s + 1) / samples)[:3]
            for s in range(samples)
        ]
        at = planner_.automaton.predict(at, movement)
    return float(np.abs(decision.path_m - places).max())


def breaches(planner_: Planner, decision: Decision) -> int:
    """Movements that may not be flown where they are to begin."""
    automaton, at, count = planner_.automaton, decision.state.vector, 0
    for movement in automaton.chain(decision.movements):
        count += not automaton.is_allowed(at, movement)
        at = automaton.predict(at, movement)
    return count


def test_plans_from_any_attitude_are_flown_as_verified() -> None:
    for decision in plans(PLANNER, 60, 9, PITCHES_DEG):
        assert verified_off_m(PLANNER, decision) < 1e-6
        assert breaches(PLANNER, decision) == 0


@pytest.mark.nightly
def test_many_plans_from_any_attitude_are_flown_as_verified() -> None:
    for decision in plans(PLANNER, 2000, 10, PITCHES_DEG):
        assert verified_off_m(PLANNER, decision) < 1e-6
        assert breaches(PLANNER, decision) == 0


def test_the_flown_path_keeps_the_clearance_that_was_claimed() -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        state = State(np.zeros(3), [0.0, np.radians(rng.uniform(-40.0, 40.0)), 0.0])
        centers, radii = rng.normal(0.0, 5.0, (10, 3)), rng.uniform(0.1, 0.6, 10)
        balls = [Obstacle.ball(c, r) for c, r in zip(centers, radii, strict=True)]
        decision = decide(
            PLANNER, Situation(state, np.array([30.0, 0, 0]), obstacle_map=ObstacleMap(balls))
        )
        path = flown(PLANNER, decision)[:, :3]
        gaps = np.linalg.norm(path[:, None] - centers, axis=2) - radii
        assert decision.choice.clearance_m <= gaps.min() + 1e-9


def test_start_pitches_of_the_set_are_taken_as_they_are() -> None:
    for pitch, prepared in PLANNER.prepared_sets:
        for roll in (0.0, 0.4):
            state = State(np.zeros(3), [roll, pitch, 1.0])
            assert PLANNER.prepare_at(state) is prepared


def test_a_start_pitch_predicted_anew_is_the_set() -> None:
    table = AUTOMATON.measure(8)
    for automaton in (
        AUTOMATON,
        replace(AUTOMATON, table=table),
        MovementAutomaton(AUTOMATON.movements, AUTOMATON.pitch_limit_rad, vehicle=Drifting()),
    ):
        own = Planner.of(ReachLibrary.build(automaton, AvoidanceGrid.uniform(5.0, 5)))
        for pitch, prepared in own.prepared_sets:
            near = prepared.fly_from(automaton, 0.0, pitch - 2e-9 * np.sign(pitch + 1e-3))
            assert near is not prepared
            same, anew = prepared.reach_set, near.reach_set
            assert np.allclose(anew.samples_m, same.samples_m, rtol=0.0, atol=1e-7)
            assert np.allclose(anew.states, same.states, rtol=0.0, atol=1e-7)
            assert np.allclose(anew.sagitta_m, same.sagitta_m, rtol=0.0, atol=1e-9)
            assert near.flyable.any()


class Drifting(PlaneModel):
    """A vehicle whose motion depends on its roll and pitch in a way of its own."""

    def advance(self, state: object, inputs: object, duration_s: float) -> FloatArray:
        end = super().advance(state, inputs, duration_s)  # type: ignore[arg-type]
        _, _, _, roll, pitch, _ = np.asarray(state, dtype=np.float64)
        end[2] -= 0.05 * duration_s * np.sin(pitch) + 0.1 * duration_s * np.sin(roll)
        return end


@pytest.mark.parametrize("kind", ["table", "vehicle"])
def test_measured_and_own_vehicles_are_flown_as_verified(kind: str) -> None:
    if kind == "table":
        automaton = replace(AUTOMATON, table=AUTOMATON.measure(8))
    else:
        automaton = MovementAutomaton(
            AUTOMATON.movements, AUTOMATON.pitch_limit_rad, vehicle=Drifting()
        )
    own = Planner.of(ReachLibrary.build(automaton, AvoidanceGrid.uniform(6.0, 6)))
    for decision in plans(own, 12, 4, (0.0, 7.4, 45.0)):
        assert verified_off_m(own, decision) < 1e-6
        assert breaches(own, decision) == 0


def test_a_level_vehicle_that_is_tilted_flies_on_level_movements() -> None:
    level = Planner.of(ReachLibrary.build(MovementAutomaton.plane(pitch_limit_deg=0.0), GRID))
    tilted = State(np.zeros(3), [0.0, 0.05, 0.0])
    decision = decide(level, Situation(tilted, np.array([30.0, 2.0, 0.0])))
    assert decision.choice.basis is Basis.RATED
    assert verified_off_m(level, decision) < 1e-6


def test_what_may_not_be_flown_from_a_tilt_is_in_no_way_out() -> None:
    library, rng = PLANNER.escapes, np.random.default_rng(6)
    assert library is not None
    for pitch_deg in (*PITCHES_DEG, 30.8, 33.8, *rng.uniform(-60.0, 60.0, 6)):
        off = np.array([0.1, np.radians(pitch_deg)])
        legs = library.legs_at(*off.tolist())
        attitudes = library.attitudes + off - library.attitudes[library.nearest(*off.tolist())]
        for attitude, following in zip(attitudes, legs.following, strict=True):
            for movement, then in zip(AUTOMATON.movements, following, strict=True):
                state = np.array([0.0, 0.0, 0.0, *attitude, 0.0])
                assert then < 0 or AUTOMATON.is_allowed(state, movement), (pitch_deg, movement)


@pytest.mark.parametrize("pitch_deg", [0.0, -15.0, 0.5, 7.4, -22.0])
def test_what_a_way_out_comes_back_to_is_told(pitch_deg: float) -> None:
    """For ever is said of loops that close; of others, how long they were verified for."""
    ball = Obstacle.ball([8.0, 0.0, 0.0], 1.0)
    state = State(np.zeros(3), np.array([0.0, np.radians(pitch_deg), 0.0]))
    situation = Situation(state, np.array([30.0, 0.0, 0.0]), obstacle_map=ObstacleMap([ball]))
    made = decide(PLANNER, situation)
    assert made.way_out is not None
    begins, loop = made.way_out.begins, made.way_out.loop
    start = flown_through(state.vector, (*made.movements[:1], *begins))
    end = flown_through(start, loop)
    once_s = sum(movement.duration_s for movement in AUTOMATON.chain(loop))
    if made.way_out.for_s == np.inf:
        assert np.abs(end[:5] - start[:5]).max() < 1e-6
    else:
        assert pitch_deg % 15.0 != 0.0
        assert made.way_out.for_s >= once_s
    assert (made.way_out.for_s == np.inf) == (pitch_deg % 15.0 == 0.0)


def test_a_loop_that_climbs_is_verified_as_far_as_it_is_said_to_last() -> None:
    """A lid above the second round, not above the first."""
    state = State(np.zeros(3), np.array([0.0, np.radians(7.4), 0.0]))
    for height_m in np.arange(1.0, 12.0, 0.5):
        lid = Obstacle.cuboid([0.0, 0.0, height_m + 0.5], [60.0, 60.0, 1.0])
        situation = Situation(state, np.array([30.0, 0.0, -3.0]), obstacle_map=ObstacleMap([lid]))
        made = decide(PLANNER, situation)
        way = made.way_out
        if way is None or not way.certain:
            continue
        at, time_s = flown_through(state.vector, made.movements[:1]), 0.0
        for movement in AUTOMATON.chain((*way.begins, *way.loop * 4)):
            if time_s >= way.for_s:
                break
            at, time_s = AUTOMATON.predict(at, movement), time_s + movement.duration_s
            assert height_m - at[2] >= way.margin_m - 1e-6


def flown_through(at: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """[6] state after movements."""
    for movement in AUTOMATON.chain(names):
        at = AUTOMATON.predict(at, movement)
    return at
