"""Closed loop: truth in small steps, sensors that see it, a pilot that decides, and the outcome."""

from clearway.sim.closed_loop import simulate
from clearway.sim.run import LoggedDecision, OnDecision, Run, is_clearway_run
from clearway.sim.settings import SimulationSettings

__all__ = [
    "LoggedDecision",
    "OnDecision",
    "Run",
    "SimulationSettings",
    "is_clearway_run",
    "simulate",
]
