"""A mission flown in one call."""

from __future__ import annotations

from pathlib import Path

from clearway.missions.mission_file import MissionFile
from clearway.missions.planned import Notice
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sim import OnDecision, Run
from clearway.sim.pilot import CLEARWAY, Steering


def fly(
    mission: MissionFile | str | Path,
    planner: str = CLEARWAY,
    *,
    on_decision: OnDecision[Steering] | None = None,
    notice: Notice | None = None,
) -> Run[Steering]:
    """Fly a mission from start to end in a simulated world, as the command `clearway fly` does.

    The same mission gives the same run, its times of computing to the side.

    Parameters
    ----------
    mission
        What `read_mission` gives, perhaps changed by `with_values`, or whatever it reads.
    planner
        clearway, or one of its rivals by name.
    on_decision
        Called with every decision and the progress of the mission.
    notice
        Called with sentences about what was assumed, left out or prepared.

    Returns
    -------
    Run
        The flight, with its decisions.

    Raises
    ------
    InputError
        For files that cannot be used and values that contradict each other.
    FlightRefusedError
        For a mission that cannot be flown.
    ClearwayError
        For an unknown planner.

    Examples
    --------
    >>> import clearway as cw
    >>> run = cw.fly("static-obstacles")
    >>> run
    Run('static-obstacles' by clearway: safe, ... m of 0.6 m, ... decisions, 0 emergencies)
    >>> run.reached, run.states.shape[1], run.summary()["margin_violations"]
    (True, 6, 0)
    """
    file = mission if isinstance(mission, MissionFile) else read_mission(mission, notice)
    setup = prepare(file, notice)
    if notice is not None:
        for note in (*setup.notes, *setup.doubts):
            notice(note)
        notice(str(setup.escape))
    return setup.fly_with(planner, on_decision)
