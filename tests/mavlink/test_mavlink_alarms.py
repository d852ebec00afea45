"""What is wrong with a flight is told to the autopilot, once for as long as it lasts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem, FlightDecision
from clearway.live.outputs.alarms import Alarm, AlarmKind
from worlds_for_tests import LIDAR, mission, planner

pytest.importorskip("pymavlink", reason="needs the extra mavlink")

from clearway.mavlink.reasons import Sayings


def test_an_alarm_is_told_once() -> None:
    system = AvoidanceSystem(planner(), mission((60.0, 0.0, 0.0)), lidars=(LIDAR,))
    system.update(State(np.zeros(3)))
    calm = system.decide(0.0)
    stays = replace(calm, alarms=(Alarm(AlarmKind.STAYS, "it stays", False),))
    sayings = Sayings()

    def told(flight: FlightDecision) -> bool:
        return any("ALARM: it stays" in str(m.text) for m in sayings.of_decision(flight, ()))

    assert [told(flight) for flight in (calm, stays, stays, calm, stays)] == [
        False,
        True,
        False,
        False,
        True,
    ]
