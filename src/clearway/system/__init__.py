"""Live use: readings come in as they come, decisions are asked for when due.

`live.AvoidanceSystem` is what a vehicle runs. The rest of this room is what it keeps from reading
to reading and from decision to decision, one thing a file: own states, what range sensors saw,
reported traffic, the plan being flown.
"""

from clearway.system.flight_decision import FlightDecision
from clearway.system.live import AvoidanceSystem
from clearway.system.readings import DataLimits, Reading

__all__ = ["AvoidanceSystem", "DataLimits", "FlightDecision", "Reading"]
