"""`clearway mavlink --check`: is all there that a flight of a mission needs?"""

from __future__ import annotations

from clearway.live.link.floor import FloorRule
from clearway.live.link.session import Session
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.parameters import LONGEST_TIMEOUT_S, TIMEOUTS

CHECKED_S = 10.0
"""How long it listens where nobody says how long."""


def problems(link: MavlinkLink[Session], wall_s: float) -> list[str]:
    """What keeps a flight from going well, in words; none where all is well."""
    session, core = link.session, link.session.core
    if core.status is None:
        return ["no heartbeat of the autopilot", *link.inbox.strangers(), *link.inbox.warnings]
    found = session.missing(wall_s)
    floor: FloorRule = core.terms.floor
    mission = core.system.mission
    refusal = floor.refusal(session.place.ground_m, mission.goals_m, mission.reach_radius_m)
    found += [] if refusal is None else [refusal]
    found += session.parameters.findings(core.system.planner.speed_mps)
    if not any(name in session.parameters.values for name in TIMEOUTS):
        found.append(
            f"neither {' nor '.join(TIMEOUTS)} was told: see that set-points end after "
            f"{LONGEST_TIMEOUT_S:g} s"
        )
    return [*found, *link.inbox.warnings]
