"""When a danger counts as seen by sectors, which report their nearest return only; and stops."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clearway.base.state import State
from clearway.io.flights.recorded import make_sector_lidar, sector_reading
from clearway.studies.why.ending import Ending, Event, _sudden_stop
from clearway.studies.why.opening import open_flight
from clearway.studies.why.sights import find_sights
from clearway.studies.why.views import PlacedReading
from made_crashes import make_crash
from made_logs import WRITERS

AZIMUTH = np.radians(45.0) * np.arange(8)
JUDGE: Any = SimpleNamespace(
    body_m=0.3, margin_m=0.6, lidars=(make_sector_lidar("PRX", AZIMUTH, 20.0),)
)
DANGER = Ending(Event.CONTACT, 10.0, np.zeros(3), np.zeros(3), 0.0, "made")


def sights(distances_m: list[float], nearest_m: list[float]) -> list[tuple[float, bool]]:
    """First sights of a vehicle that comes straight at the danger, a metre ahead of it, a second
    each."""
    seen = []
    for number, (away, nearest) in enumerate(zip(distances_m, nearest_m, strict=True)):
        ranges = np.full(8, np.inf)
        ranges[0] = nearest
        reading = sector_reading(float(number), AZIMUTH, ranges)
        arcs, whose = reading.arcs(0.1)
        state = State(np.array([-away, 0.0, 0.0]), np.zeros(3), time_s=float(number))
        seen.append(PlacedReading("PRX", reading, state, arcs + state.position_m, whose))
    return [(one.away_m, one.hidden) for one in find_sights(JUDGE, DANGER, seen)]


@pytest.mark.parametrize(
    ("nearest_m", "found"),
    [
        ([18.0, 15.0, 12.0, 9.0, 6.0, 3.0], [(18.0, False)]),
        # A nearer part of it, as of a wall at an angle, until both are one.
        ([16.0, 13.2, 10.6, 7.9, 5.3, 2.7], [(18.0, True)]),
        # Something else, which hides it until it is passed.
        ([6.0, 5.5, 5.2, 5.1, 6.0, 3.0], [(18.0, True)]),
        # The sector was free in between: what hid it was something else.
        ([16.0, 13.2, np.inf, 7.9, 5.3, 2.7], [(9.0, True)]),
        # What appears at once was not seen before.
        ([17.0, 14.0, 11.0, 8.0, 3.0, 2.7], [(6.0, True)]),
        ([np.inf] * 5 + [3.0], [(3.0, False)]),
        ([np.inf] * 6, []),
    ],
)
def test_a_sector_sees_what_its_nearest_return_hides(
    nearest_m: list[float], found: list[tuple[float, bool]]
) -> None:
    assert sights([18.0, 15.0, 12.0, 9.0, 6.0, 3.0], nearest_m) == found


def test_nothing_is_seen_beyond_the_range_of_a_sensor() -> None:
    assert sights([30.0, 25.0, 15.0, 2.0], [5.0, 5.0, 5.0, 2.0]) == [(15.0, True)]


def test_a_stop_amid_noise_is_a_stop(tmp_path: Path) -> None:
    """Where poses have noise of 3 cm, one speed after the contact is a quarter of the flight's."""
    pytest.importorskip("pyulog")
    made = make_crash(20)
    flight = open_flight(WRITERS["ULog"](made, tmp_path))
    stopped_s = _sudden_stop(flight.track)
    assert stopped_s is not None
    ended_s = float(flight.track.time_s[0] + made.flight.time_s[-1])
    assert stopped_s == pytest.approx(ended_s, abs=0.2)
