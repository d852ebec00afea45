"""How the link is, and what may be done then: the table of docs/mavlink.md, as one function."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum


class LinkState(StrEnum):
    """What the link allows."""

    WAITING = "waiting"
    """For a heartbeat, a position with attitude and origin, or the first distances."""
    FLYING = "flying"
    AGEING = "ageing"
    """The position is late: decided on, with a margin that grows with its age."""
    BLIND = "blind"
    """No distances lately: decided on, with space as unseen and what is remembered."""
    STALE = "stale position"
    """Too old to decide on: the last plan is flown on while it holds."""
    POSITION_LOST = "position lost"
    SENSOR_LOST = "sensor lost"
    """Blind for too long to fly on what is remembered."""
    LINK_LOST = "link lost"
    """No heartbeat of the autopilot."""
    RESTARTED = "autopilot restarted"
    """Its clock began anew, and so may have its local frame: over for good."""
    ARRIVED = "arrived"
    """The last goal is held."""

    @property
    def decides(self) -> bool:
        return self in (LinkState.FLYING, LinkState.AGEING, LinkState.BLIND)

    @property
    def steers(self) -> bool:
        """Whether set-points may be sent."""
        return self.decides or self in (LinkState.STALE, LinkState.ARRIVED)


@dataclass(frozen=True, slots=True)
class LinkLimits:
    """When the link is no longer good."""

    heartbeat_s: float = 3.0
    """Without a heartbeat of the autopilot; by our clock."""
    ageing_s: float = 0.5
    """Age of the own position; by the vehicle's clock, as below."""
    stale_s: float = 1.5
    lost_s: float = 3.0
    blind_s: float = 3.0
    """Age of the distances, where the mission has a sensor."""
    sensor_lost_s: float = 6.0


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What is known of the link at a moment."""

    heartbeat_age_s: float = math.inf
    position_age_s: float = math.inf
    distances_age_s: float | None = None
    """None where the mission has no sensor."""
    restarted: bool = False
    arrived: bool = False


def link_state(facts: LinkFacts, limits: LinkLimits) -> LinkState:
    """The state of the link; the first of the table that fits."""
    sensed_s = facts.distances_age_s or 0.0
    if facts.restarted:
        return LinkState.RESTARTED
    if math.inf in (facts.heartbeat_age_s, facts.position_age_s, sensed_s):
        return LinkState.WAITING
    if facts.heartbeat_age_s > limits.heartbeat_s:
        return LinkState.LINK_LOST
    if facts.position_age_s > limits.lost_s:
        return LinkState.POSITION_LOST
    if sensed_s > limits.sensor_lost_s and not facts.arrived:
        return LinkState.SENSOR_LOST
    if facts.arrived:
        return LinkState.ARRIVED
    if facts.position_age_s > limits.stale_s:
        return LinkState.STALE
    if sensed_s > limits.blind_s:
        return LinkState.BLIND
    return LinkState.AGEING if facts.position_age_s > limits.ageing_s else LinkState.FLYING
