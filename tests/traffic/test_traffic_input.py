"""Traffic that nobody wants to meet: hovering, on top of us, by the thousand, out of order."""

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission, Mode
from clearway.studies.encounters.flights import planner_at
from clearway.traffic import Intruder, TrackerSettings


def live(**settings):
    to_fly = Mission("test", State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    system = AvoidanceSystem(
        planner_at(1.0).with_values(**{"transponder_address": ""} | settings), to_fly
    )
    system.update(State(np.zeros(3)))
    return system


def intruder(position, velocity=(0.0, 0.0, 0.0), **more):
    values = {"spread_rad": np.array([0.2, 0.1]), "radius_m": 0.6, "name": "i"} | more
    return Intruder(np.array(position, float), np.array(velocity, float), **values)


def no_nan(flight):
    cells = flight.decision.cells
    evidence = [cells.evidence.intruder, cells.evidence.map_base, cells.rating]
    return (
        all(np.isfinite(values).all() for values in evidence)
        and np.isfinite(flight.decision.path_m).all()
    )


@pytest.mark.parametrize(
    ("position", "velocity", "mode"),
    [
        ((6, 0, 0), (0, 0, 0), Mode.AVOIDANCE),
        ((0, 0, 0), (0, 0, 0), Mode.EMERGENCY),
        ((0, 0, 0), (1, 0, 0), Mode.EMERGENCY),
        ((0, 0, 0), (-1, 0, 0), Mode.EMERGENCY),
        ((0, 0, 8), (0, 0, -1), Mode.AVOIDANCE),
    ],
    ids=["hovering ahead", "on top, hovering", "on top, alike", "on top, opposite", "diving"],
)
def test_degenerate_intruders_give_a_decision_without_nan(position, velocity, mode):
    system = live()
    system.update(intruder(position, velocity))
    flight = system.decide(0.0)
    assert no_nan(flight)
    assert flight.mode is mode or position == (0, 0, 8)


def test_a_thousand_intruders_give_a_decision_without_nan():
    system = live()
    rng = np.random.default_rng(1)
    for number in range(1000):
        place, velocity = rng.uniform(-20.0, 20.0, 3), rng.normal(0.0, 0.7, 3)
        system.update(intruder(place, velocity, name=str(number)))
    flight = system.decide(0.0)
    assert no_nan(flight)
    assert len(flight.decision.hazards.moving.radius_m) == 1000


@pytest.mark.parametrize("bad", [{"position": (np.nan, 0, 0)}, {"velocity": (np.inf, 0, 0)}])
def test_an_intruder_that_is_no_number_is_refused(bad):
    with pytest.raises(InputError, match="finite"):
        intruder(**({"position": (6, 0, 0)} | bad))


def test_reports_out_of_order_are_counted_and_the_latest_is_kept():
    system = live()
    system.update(replace(intruder((6, 0, 0)), time_s=1.0))
    assert system.decide(1.0).counts == {}
    system.update(replace(intruder((9, 0, 0)), time_s=0.5))
    flight = system.decide(1.0)
    assert flight.counts["intruder: late report"] == 1
    assert flight.decision.hazards.moving.position_m[0, 0] == pytest.approx(6.0)


def test_own_and_repeated_reports_are_counted_and_left_out():
    system = live(transponder_address="own")
    system.update(intruder((0.1, 0, 0), name="own"))
    system.update(intruder((0.1, 0, 0), name="", address="own"))
    for _ in range(3):
        system.update(intruder((6, 0, 0)))
    system.update(intruder((6.1, 0, 0)))
    flight = system.decide(0.0)
    assert flight.counts == {"intruder: ownship": 2, "intruder: duplicate": 2}
    assert flight.decision.hazards.moving.position_m[:, 0] == pytest.approx([6.1])


def test_stale_reports_are_counted_and_left_out():
    system = live()
    system.update(intruder((6, 0, 0)))
    later = system.planner.settings.intruder_s + 0.1
    system.update(State(np.zeros(3), time_s=later))
    flight = system.decide(later)
    assert flight.counts == {"intruder: stale": 1}
    assert flight.decision.intruders == ()


def test_reports_without_a_name_do_not_replace_each_other():
    system = live()
    for place, address in (((6, 0, 0), ""), ((6, 3, 0), ""), ((9, 0, 3), "3c6dd2")):
        system.update(intruder(place, name="", address=address))
    flight = system.decide(0.0)
    assert flight.decision.intruders == ("anonymous 1", "anonymous 2", "3c6dd2")
    assert len(flight.decision.hazards.moving.radius_m) == 3


def test_a_tracker_does_not_go_back_in_time():
    system = live(tracker=TrackerSettings(), transponder_address="own")
    system.update(State(np.zeros(3), time_s=5.0))
    system.decide(5.0)
    assert system.decide(4.0).counts["clock: set back"] == 1


def test_an_intruder_on_top_of_us_is_not_our_echo_where_addresses_are_known():
    system = live(tracker=TrackerSettings(), transponder_address="own")
    system.update(intruder((0.5, 0, 0), (1, 0, 0)))
    assert system.decide(0.0).mode is Mode.EMERGENCY
    nameless = live(tracker=TrackerSettings())
    nameless.update(intruder((0.5, 0, 0), (1, 0, 0)))
    assert nameless.decide(0.0).counts == {"report: ownship": 1}
