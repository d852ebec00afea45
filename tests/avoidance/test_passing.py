"""On which side aircraft are passed: it is kept, and no way is taken that only ends before them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.passing import Meetings
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup, prepare
from clearway.sim.scripted import ScriptedIntruder
from worlds_for_tests import LIBRARY

KEPT_M = 11.0
"""Margin and half span of the aircraft below."""


@pytest.fixture(scope="module")
def crossing() -> FlightSetup:
    """At 3 m/s, with 40 m of sight; who crosses does so at 20 m/s or so."""
    return prepare(
        parse_model(
            "crossing",
            {
                "mission": {"name": "crossing", "waypoints_m": [[120, 0, 40]], "reach_radius_m": 4},
                "vehicle": {"position_m": [0, 0, 40], "speed_mps": 3.0},
                "grid": {
                    "range_m": 40,
                    "layers": 10,
                    "azimuth_deg": 45,
                    "columns": 7,
                    "elevation_deg": 30,
                    "rows": 5,
                },
                "safety": {"margin_m": 5.0},
                "lidar": [],
            },
            MissionFile,
        )
    )


def crosser(angle_rad: float, speed_mps: float, off_m: float) -> ScriptedIntruder:
    """Somebody who would hit after 21 s, or nearly so, and is heard of 13 s before."""
    velocity = speed_mps * np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
    meets = np.array([63.0 + off_m, 0.0, 40.0])
    return ScriptedIntruder("FAST", 8.0, meets - 13.0 * velocity, velocity, radius_m=6.0,
                            spawn="world")  # fmt: skip


def changes_of_side(asides: list[np.ndarray]) -> int:
    """How often the direction to the aircraft at the closest approach turned by more than 90 deg
    from where it was first, or last changed to."""
    changes, begun = 0, asides[0]
    for aside in asides[1:]:
        if aside @ begun < 0.0:
            changes, begun = changes + 1, aside
    return changes


def strewn(rng: np.random.Generator, count: int, within_m: float) -> MovingHazards:
    """Balls that move any way and grow, within so much of the vehicle along each axis."""
    return MovingHazards(
        rng.uniform(-within_m, within_m, (count, 3)),
        rng.normal(size=(count, 3)),
        rng.uniform(0.1, 1.0, count),
        rng.uniform(0.0, 0.5, count),
        np.zeros(count),
        np.ones(count),
    )


def at(met: Meetings, node: int) -> tuple[np.ndarray, np.ndarray]:
    """[k, 3] from the vehicle to each when closest on the way to a node, and [k] when that is."""
    return met.on_way(node, 0.0, np.zeros(len(met.names), dtype=np.bool_))[:2]


@pytest.mark.parametrize(
    ("angle_deg", "speed_mps", "off_m"), [(-90, 20, 0), (100, 30, 2), (-120, 12, -3)]
)
def test_a_side_once_chosen_is_kept(
    crossing: FlightSetup, angle_deg: float, speed_mps: float, off_m: float
) -> None:
    who = crosser(np.radians(angle_deg), speed_mps, off_m)
    asides: list[np.ndarray] = []

    def look(entry: object, _progress: object) -> None:
        decision = entry.flight.decision  # type: ignore[attr-defined]
        if decision.passings:
            met = Meetings(decision.prepared.reach_set, decision.hazards.moving, ("FAST",))
            asides.append(decision.frame.world_from_grid @ at(met, decision.choice.node)[0][0])

    run = replace(crossing, script=(who,)).fly(look).summary()
    assert run["reached"]
    assert run["emergencies"] == 0
    assert run["min_intruder_distance_m"] >= KEPT_M - 0.05
    assert len(asides) >= 5
    assert changes_of_side(asides) == 0


def test_a_way_that_ends_first_is_met_as_if_flown_straight_on() -> None:
    reach_set = LIBRARY.nearest(0.0)
    # It comes from ahead at the own speed, and is where the vehicle then is after half the time.
    late = float(reach_set.end_time_s.max())
    none = np.zeros(1)
    moving = MovingHazards(
        np.array([[late, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0]]), none + 0.5, none, none, none
    )
    met = Meetings(reach_set, moving, ("ahead",))
    ends = reach_set.samples_m[:, -1]
    straight = int(np.argmax(ends[:, 0] - np.abs(ends[:, 1]) - np.abs(ends[:, 2])))
    first = reach_set.path(straight)[0]
    for node in (straight, int(first)):
        aside_m, time_s = at(met, int(node))
        assert time_s[0] == pytest.approx(0.5 * late, rel=1e-6)
        assert np.abs(aside_m).max() < 1e-6
    # Verification sees what is met on the way; what comes after its end only this does.
    assert met.lack(-0.5 + 1e-6)[first]
    assert not met.lack(-0.5 - 1e-6)[first]
    assert not met.lack(0.4 * late)[straight]


@pytest.mark.parametrize("seed", range(3))
def test_what_is_asked_of_one_way_or_of_all_intruders_is_what_each_says_of_every_way(seed) -> None:
    rng, reach_set = np.random.default_rng(seed), LIBRARY.nearest(0.0)
    many = strewn(rng, 5, 9.0)
    met = Meetings(reach_set, many, tuple("abcde"))
    alone = [
        Meetings(reach_set, MovingHazards(*(part[k : k + 1] for part in many)), ("x",))
        for k in range(5)
    ]
    shares = []
    for margin_m in np.linspace(-1.0, 8.0, 10):
        lack = met.lack(margin_m)
        np.testing.assert_array_equal(lack, np.any([one.lack(margin_m) for one in alone], axis=0))
        shares.append(lack.mean())
    assert 0.0 < shares[3] < 1.0
    nodes = rng.choice(reach_set.nodes, 100).tolist()
    sides = at(met, nodes[0])[0]
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    asides = [at(met, node)[0] for node in nodes]
    cosines = [min(np.sum(a * sides, axis=1) / np.linalg.norm(a, axis=1)) for a in asides]
    least = 0.5 * (min(cosines) + max(cosines)), 0.1 * min(cosines) + 0.9 * max(cosines)
    off = met.off_sides(range(5), sides, least)[:, nodes]
    np.testing.assert_array_equal(off, [[c < each for c in cosines] for each in least])
    assert 0 < off[0].sum() <= off[1].sum() < len(nodes)
    for node in nodes:
        asides_m, times_s = at(met, node)
        for k, one in enumerate(alone):
            np.testing.assert_array_equal(asides_m[k], at(one, node)[0][0])
            assert times_s[k] == at(one, node)[1][0]


@pytest.mark.parametrize("seed", range(3))
def test_who_is_passed_is_ahead_and_near_or_was_begun_with(seed) -> None:
    rng, reach_set = np.random.default_rng(seed), LIBRARY.nearest(0.0)
    many = strewn(rng, 60, 12.0)
    met = Meetings(reach_set, many, tuple(map(str, range(60))))
    begun, margin_m = rng.random(60) < 0.2, 1.5
    for node in rng.choice(reach_set.nodes, 10).tolist():
        aside, when_s, apart, near, passed = met.on_way(node, margin_m, begun)
        np.testing.assert_allclose(apart, np.linalg.norm(aside, axis=1), rtol=1e-12)
        is_near = apart <= many.radius_m + many.growth_mps * when_s + 3.0 * margin_m
        np.testing.assert_array_equal(near, is_near)
        np.testing.assert_array_equal(passed, (when_s > 0.0) & (is_near | begun))
        assert 0 < is_near.sum() < 60
        assert 0 < (passed & ~is_near).sum() < passed.sum()


@pytest.mark.parametrize("reach_m", [5.0, 30.0, 300.0])
def test_who_is_passed_over_as_too_far_would_have_kept_the_margin(reach_m: float) -> None:
    """Held against the closest approach of the two straight ways, by the formula."""
    rng, reach_set = np.random.default_rng(int(reach_m)), LIBRARY.nearest(0.0)
    many = MovingHazards(
        rng.uniform(-reach_m, reach_m, (40, 3)), rng.normal(size=(40, 3)) * reach_m / 20.0,
        rng.uniform(0.1, 3.0, 40), rng.uniform(-0.2, 0.5, 40), np.zeros(40), np.ones(40),
    )  # fmt: skip
    end_s, samples = reach_set.end_time_s, reach_set.samples_m
    begun_s = np.where(reach_set.parent >= 0, end_s[reach_set.parent], 0.0)
    speed = (samples[:, -1] - samples[:, -2]) / ((end_s - begun_s) / samples.shape[1])[:, None]
    place = many.position_m + end_s[:, None, None] * many.velocity_mps - samples[:, -1][:, None]
    moves = many.velocity_mps - speed[:, None]
    after_s = -np.einsum("nki,nki->nk", place, moves) / np.einsum("nki,nki->nk", moves, moves)
    after_s = np.clip(after_s, 0.0, np.maximum(end_s.max() - end_s, 0.0)[:, None])
    gap_m = np.linalg.norm(place + after_s[:, :, None] * moves, axis=2)
    most_m = many.radius_m + many.growth_mps * (end_s[:, None] + after_s) - gap_m
    for margin_m in (0.6, 5.0, 40.0):
        lack = Meetings(reach_set, many, ("x",) * 40).lack(margin_m)
        sure = np.abs(most_m.max(axis=1) + margin_m) > 1e-6
        np.testing.assert_array_equal(lack[sure], most_m.max(axis=1)[sure] > -margin_m)
