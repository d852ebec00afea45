"""`--check` over MAVLink: is all there that a flight needs?"""

from __future__ import annotations

from typing import TypeVar

from clearway.live.link.hearing import Hearing
from clearway.mavlink.mavlink_link import MavlinkLink
from clearway.mavlink.parameters import LONGEST_TIMEOUT_S, TIMEOUTS

S = TypeVar("S", bound=Hearing)
LINK_CHECK_S = 10.0
"""How long it listens where nobody says how long."""


def problems(link: MavlinkLink[S], wall_s: float) -> list[str]:
    """What keeps a flight from going well, in words; none where all is well."""
    session, core = link.session, link.session.core
    if core.status is None:
        return ["no heartbeat of the autopilot", *link.inbox.strangers(), *link.inbox.warnings]
    found = session.missing(wall_s)
    refusal = core.refusal
    found += [] if refusal is None else [refusal]
    found += session.parameters.findings(core.speed_mps, session.asked_mps2)
    if not any(name in session.parameters.values for name in TIMEOUTS):
        found.append(
            f"neither {' nor '.join(TIMEOUTS)} was received: check that set-points end after "
            f"{LONGEST_TIMEOUT_S:g} s"
        )
    return [*found, *link.inbox.warnings]
