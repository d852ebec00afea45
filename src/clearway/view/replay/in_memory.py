"""A run that has just been flown, as it would be read back from its file."""

from __future__ import annotations

import numpy as np

from clearway.base.made import Made
from clearway.live import FlightDecision
from clearway.missions.setup import FlightSetup
from clearway.sim import Run
from clearway.sim.pilot import Steering
from clearway.view.replay.about import list_surveyed_points, mission_message
from clearway.view.replay.messages import (
    decision_message,
    intruders_message,
    list_seen_points,
    state_messages,
)
from clearway.view.replay.reading import Recording
from clearway.view.replay.writing import INTRUDER_STEP_S


def recording_of(run: Run[Steering], setup: FlightSetup) -> Recording:
    """States, decisions, seen points and intruders of a run; without cells and reach sets."""
    mission = mission_message(run, setup, 0.0)
    begins, ends = float(run.time_s[0]), float(run.time_s[-1])
    times_s: list[float] = []
    if run.intruder_tracks:
        times_s = np.arange(begins, ends + INTRUDER_STEP_S, INTRUDER_STEP_S).tolist()
    flights = [entry.flight for entry in run.decisions]
    clearways = [flight for flight in flights if isinstance(flight, FlightDecision)]
    return Recording(
        source=run.mission.name,
        mission=mission,
        states=state_messages(run),
        decisions=Made(run.decisions, decision_message),
        cells=(),
        reach=(),
        points_m=Made(
            clearways, lambda flight: list_seen_points(flight.decision, mission["voxel_m"])
        ),
        reach_sets=(),
        intruders=Made(times_s, lambda time_s: intruders_message(run, time_s)),
        surveyed_m=list_surveyed_points(setup.world),
    )
