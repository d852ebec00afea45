"""Several sensors: what becomes of one that lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError, InputError
from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import prepare
from clearway.sensors import (
    Court,
    Mounting,
    Standing,
    hear_reading,
    range_sensors,
    simulate_scan,
)
from clearway.sensors.several.trust import BELIEVED, DOUBTED, LOWERED
from clearway.sensors.standing import COMBINE_RULES
from clearway.sim.lying_lidar import LyingLidar
from repository import REPOSITORY
from sensors_for_tests import GRID, WORLD, at, lidar

MARGIN_M = 0.6


# --- the court -------------------------------------------------------------------------------


def tried(
    lidars: Sequence[cw.Lidar],
    scanners: Sequence[cw.Lidar | LyingLidar],
    seconds: int,
    world: cw.ObstacleMap = WORLD,
) -> list[Court]:
    """The court after every second of straight flight at 1 m/s."""
    sensors = range_sensors(lidars)
    court = Court.of(sensors, MARGIN_M, 10.0, 1.0)
    rng = np.random.default_rng(3)
    courts = []
    for second in range(seconds):
        state = at(float(second))
        for scanner in scanners:
            scan = (
                simulate_scan(scanner, world, state, rng)
                if isinstance(scanner, cw.Lidar)
                else scanner.scan(world, state, rng)
            )
            court = hear_reading(court, sensors, scan, state)
        courts.append(court)
    return courts


def test_honest_sensors_keep_their_trust() -> None:
    crossed = Mounting(attitude_rad=np.radians([0.0, 0.0, 25.0]))
    three = [lidar("a"), lidar("b", sigma_m=0.1), lidar("c", mounting=crossed, dropout=0.3)]
    last = tried(three, three, 12)[-1]
    for record in last.records.values():
        assert record.believed
        assert record.verdicts_against == 0
        assert record.trust == 1.0


@pytest.mark.parametrize("world", [WORLD, cw.ObstacleMap([])], ids=["balls", "empty"])
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_wall_that_travels_along_is_not_believed_after_four_verdicts(
    world: cw.ObstacleMap, order: tuple[int, int]
) -> None:
    both = [lidar("good"), lidar("liar")]
    said = [both[0], LyingLidar(both[1], "ghost-wall")]
    courts = tried(both, [said[n] for n in order], 9, world)
    against = [court.records["liar"].verdicts_against for court in courts]
    # The first reading is only remembered; then one verdict a second, which is more than a margin.
    first = next(n for n, count in enumerate(against) if count)
    assert first in (1, 2)
    assert against[first : first + 4] == [1, 2, 3, 4]
    believed = [court.believes("liar") for court in courts]
    needed = int(np.ceil(np.log(DOUBTED) / np.log(LOWERED)))
    assert needed == 4
    assert believed == [n < first + needed - 1 for n in range(9)]
    assert all(court.believes("good") for court in courts)
    assert courts[-1].records["good"].trust == 1.0


def test_a_blind_sensor_loses_trust_where_another_sees_steadily() -> None:
    both = [lidar("good"), lidar("blind")]
    courts = tried(both, [both[0], LyingLidar(both[1], "blind")], 14)
    assert not courts[-1].believes("blind")
    assert all(court.believes("good") for court in courts)
    # Where there is nothing to see, seeing nothing is no lie.
    courts = tried(both, [both[0], LyingLidar(both[1], "blind")], 14, cw.ObstacleMap([]))
    assert courts[-1].records["blind"].verdicts_against == 0


def test_trust_comes_back_when_the_lie_ends() -> None:
    class Repenting(LyingLidar):
        """Lies until 7 s."""

        def scan(self, world, state, rng):  # type: ignore[no-untyped-def]
            if state.time_s > 7.0:
                return simulate_scan(self.lidar, world, state, rng)
            return super().scan(world, state, rng)

    rows = cw.ObstacleMap(
        [cw.Obstacle.ball([x, y, 0.0], 1.5) for x in range(5, 60, 6) for y in (-4.0, 4.0)]
    )
    both = [lidar("good"), lidar("liar")]
    courts = tried(both, [both[0], Repenting(both[1], "ghost-wall")], 22, rows)
    believed = [court.believes("liar") for court in courts]
    assert not believed[7]
    assert believed[-1]
    trust = [court.records["liar"].trust for court in courts]
    again = believed.index(True, 7)
    assert trust[again - 1] <= BELIEVED < trust[again]


def test_what_one_sees_steadily_counts_though_another_misses_it() -> None:
    """A coarse sensor that is alive passes a thing that the other sees: nothing is decided."""
    world = cw.ObstacleMap([*WORLD.obstacles, cw.Obstacle.ball([6.0, 3.0, 0.0], 1.0)])
    partly = lidar("partly")

    class LeftBlind(LyingLidar):
        """Honest, but that it sees nothing on the left."""

        def scan(self, world, state, rng):  # type: ignore[no-untyped-def]
            scan = simulate_scan(self.lidar, world, state, rng)
            return cw.Scan(
                scan.points_m[scan.points_m[:, 1] < 0.5], scan.time_s, sensor=scan.sensor
            )

    both = [lidar("good"), partly]
    last = tried(both, [both[0], LeftBlind(partly, "blind")], 8, world)[-1]
    assert last.believes("good")


def test_two_outvote_one() -> None:
    """A false wall that stands still cannot be told from a real one, but by the others' weight."""

    beside = cw.ObstacleMap([cw.Obstacle.ball([8.0, y, 0.0], 1.5) for y in (-5.0, 5.0)])
    wall = cw.Obstacle.cuboid([14.0, 0.0, 0.0], [0.5, 5.0, 5.0])
    false = cw.ObstacleMap([*beside.obstacles, wall])

    class Mirage(LyingLidar):
        def scan(self, _world, state, rng):  # type: ignore[no-untyped-def]
            return simulate_scan(self.lidar, false, state, rng)

    three = [lidar("a"), lidar("b"), lidar("mirage")]
    one = tried([three[0], three[2]], [three[0], Mirage(three[2], "blind")], 9, beside)
    assert all(court.believes("mirage") for court in one)  # one word against another: it counts
    two = tried(three, [three[0], three[1], Mirage(three[2], "blind")], 13, beside)
    assert not two[-1].believes("mirage")
    weak = [three[0], lidar("mirage", standing=Standing(trust=0.5))]
    last = tried(weak, [weak[0], Mirage(weak[1], "blind")], 13, beside)[-1]
    assert not last.believes("mirage")


def test_dirt_on_a_lens_is_found_though_most_of_what_it_sees_is_real() -> None:
    class Dirty(LyingLidar):
        """Honest, but for a blot straight ahead."""

        def scan(self, world, state, rng):  # type: ignore[no-untyped-def]
            scan = simulate_scan(self.lidar, world, state, rng)
            y, z = np.meshgrid(np.linspace(-0.3, 0.3, 31), np.linspace(-0.3, 0.3, 31))
            blot = np.stack([np.full(y.size, 3.0), y.ravel(), z.ravel()], axis=1)
            kept = np.hypot(scan.points_m[:, 1], scan.points_m[:, 2]) > 0.1 * scan.points_m[:, 0]
            return cw.Scan(
                np.concatenate([scan.points_m[kept], blot]), scan.time_s, sensor=scan.sensor
            )

    street = cw.ObstacleMap(
        [cw.Obstacle.cuboid([30.0, y, 0.0], [80.0, 1.0, 8.0]) for y in (-4.0, 4.0)]
    )
    both = [lidar("good"), lidar("dirty")]
    courts = tried(both, [both[0], Dirty(both[1], "blind")], 12, street)
    assert courts[5].records["dirty"].steady  # most of it
    assert not courts[-1].believes("dirty")
    assert all(court.believes("good") for court in courts)
    assert courts[-1].records["good"].trust == 1.0


def test_what_moves_is_no_lie() -> None:
    """A ball that crosses at the own speed; one sensor tells half a second after the other."""
    both = [lidar("a"), lidar("b")]
    sensors = range_sensors(both)
    court = Court.of(sensors, MARGIN_M, 10.0, 1.0)
    for second in range(10):
        for delay, sensor in ((0.0, both[0]), (0.5, both[1])):
            state = at(second + delay)
            moving = cw.Obstacle.ball([12.0, 5.0 - state.time_s, 0.0], 1.0)
            there = cw.ObstacleMap([*WORLD.obstacles, moving])
            court = hear_reading(court, sensors, simulate_scan(sensor, there, state, second), state)
    assert {record.verdicts_against for record in court.records.values()} == {0}


# --- in flight -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def library() -> cw.ReachLibrary:
    return cw.ReachLibrary.load_or_build(cw.MovementAutomaton.plane(speed_mps=1.0), GRID)


@pytest.mark.parametrize("rule", sorted(COMBINE_RULES))
@pytest.mark.parametrize("lie", ["ghost-wall", "blind"])
def test_a_liar_neither_blinds_the_others_nor_stops_the_flight(
    library: cw.ReachLibrary, lie: str, rule: str
) -> None:
    planner = cw.Planner.of(library, cw.AvoidanceSettings(sensor_fusion=rule))
    both = [lidar("good"), lidar("liar")]
    mission = cw.Mission("m", cw.State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    system = cw.AvoidanceSystem(planner, mission, lidars=both)
    told = [both[0], LyingLidar(both[1], lie, from_s=3.0)]
    run = cw.simulate(system, WORLD, lidars=told, settings=cw.SimulationSettings(time_limit_s=60.0))
    assert run.safe
    assert system.trust == {"good": 1.0, "liar": 0.0}
    assert system.counts["scan: liar is contradicted by others"] > 10
    if lie == "ghost-wall":
        # Before the verdicts its word counts, and the flight takes the wall for real.
        wall = [entry.flight for entry in run.decisions if 3.0 <= entry.flight.time_s < 6.0]
        assert sum(one.decision.choice.clearance_m < 0.6 for one in wall) >= 2
    assert run.metrics.path_length_m < 40.0


def test_a_blind_sensor_does_not_wipe_out_what_another_has_seen(
    library: cw.ReachLibrary,
) -> None:
    both = [lidar("good"), lidar("blind")]
    mission = cw.Mission("m", cw.State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    system = cw.AvoidanceSystem(cw.Planner.of(library), mission, lidars=both)
    nothing = np.zeros((0, 3))
    system.update(at(5.0))
    system.update(simulate_scan(both[0], WORLD, at(5.0)))
    count = len(system.situation(5.0)[0].remembered.radius_m)  # type: ignore[union-attr]
    assert count > 10
    for step in range(1, 5):
        time_s = 5.0 + 0.1 * step
        system.update(at(time_s, 5.0 / time_s))
        system.update(cw.Scan(nothing, time_s, sensor="blind"))
    remembered = system.situation(5.4)[0].remembered
    assert remembered is not None
    assert len(remembered.radius_m) == count


def test_alone_a_sensor_is_as_before(library: cw.ReachLibrary) -> None:
    mission = cw.Mission("m", cw.State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    system = cw.AvoidanceSystem(cw.Planner.of(library), mission, lidars=[lidar("a", sigma_m=0.05)])
    system.update(at(5.0))
    system.update(simulate_scan(lidar("a"), WORLD, at(5.0)))
    situation, _ = system.situation(5.0)
    assert situation.range_sigma_m == 0.05
    assert system.trust == {"a": 1.0}
    # Beside a better one, its points alone grow by what it measures worse: 2 sigmas of 0.03 m.
    pair = [lidar("a", sigma_m=0.05), lidar("b", sigma_m=0.02)]
    both = cw.AvoidanceSystem(cw.Planner.of(library), mission, lidars=pair)
    both.update(at(5.0))
    both.update(simulate_scan(lidar("a"), WORLD, at(5.0)))
    together, _ = both.situation(5.0)
    assert together.range_sigma_m == 0.02
    assert situation.remembered is not None
    assert together.remembered is not None
    assert together.remembered.radius_m == pytest.approx(situation.remembered.radius_m + 0.06)


@pytest.mark.nightly
def test_the_example_mission_with_a_liar() -> None:
    path = REPOSITORY / "examples" / "missions" / "lying-sensor.toml"
    file = read_mission_file(str(path))
    setup = prepare(file)
    assert [sensor.standing.precision for sensor in setup.lidars] == [0.9, 1.0, 0.9]
    assert setup.planner.settings.sensor_fusion == "weighted"
    run = setup.fly()
    assert run.safe
    assert run.counts["scan: middle is contradicted by others"] > 20
    tables = file.effective()
    tables["lidar"] = [part for part in tables["lidar"] if part["name"] == "middle"]
    tables["simulation"]["time_limit_s"] = 40.0
    tables["safety"]["escape"] = "off"
    alone = prepare(parse_model("alone", tables, MissionFile)).fly()
    assert not alone.reached
    assert alone.states[:, 0].max() < 30.0


def test_mission_keys_are_checked() -> None:
    tables = {
        "mission": {"name": "m", "waypoints_m": [[9.0, 0.0, 0.0]]},
        "rating": {"sensors": "loudest"},
        "lidar": [{"name": "a", "trust": 0.0, "lie": "polite"}],
    }
    with pytest.raises(InputError) as caught:
        parse_model("m", tables, MissionFile)
    told = str(caught.value)
    for words in ("rating.sensors", "trust", "lie", "ghost-wall", "weighted"):
        assert words in told
    with pytest.raises(ClearwayError, match="valid lies are blind, ghost-wall"):
        LyingLidar(lidar("a"), "polite")
