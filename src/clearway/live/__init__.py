"""Live use: readings come in as they come, decisions are asked for when due.

`live.AvoidanceSystem` is what a vehicle runs. The rest of this room is what it keeps from reading
to reading and from decision to decision, one thing a file: own state estimates, what range sensors
saw, reported traffic, the plan being flown.
"""

from clearway.live.inputs.readings import Reading
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.live.system import AvoidanceSystem

__all__ = ["AvoidanceSystem", "FlightDecision", "Reading"]
