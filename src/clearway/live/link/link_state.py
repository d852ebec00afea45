"""How the link is, and what may be done then: the table of docs/mavlink.md, as one function."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum


class LinkState(StrEnum):
    """What the link allows."""

    WAITING = "waiting"
    """For a heartbeat, a position with attitude and origin, or the first distances."""
    ON_GROUND = "on the ground"
    """Not armed, or not said to be in the air: a set-point would replace the take-off."""
    REFUSED = "refused"
    """It may pitch and knows no floor, or a goal lies below it."""
    FLYING = "flying"
    OTHER_MODE = "other mode"
    """The mode does not follow set-points: decided from where it flies."""
    NOT_FOLLOWED = "not followed"
    """The mode would follow, but the vehicle does not do what it is told."""
    AGEING = "ageing"
    """The position is late: decided on, with a margin that grows with its age."""
    BLIND = "blind"
    """No distances lately: decided on, with space as unobserved and what is remembered."""
    STALE = "stale position"
    """Too old to decide on: the last plan is flown on while it holds."""
    POSITION_LOST = "position lost"
    SENSOR_LOST = "sensor lost"
    """Blind for too long to fly on what is remembered."""
    LINK_LOST = "link lost"
    """No heartbeat of the autopilot."""
    RESTARTED = "autopilot restarted"
    """Its clock began anew, and so may have its local frame: over for good."""
    RELIEVED = "relieved"
    """The second process has taken over: over for good."""
    ARRIVED = "arrived"
    """The last goal is held."""

    @property
    def decides(self) -> bool:
        return self in DECIDING

    @property
    def steers(self) -> bool:
        """Whether set-points may be sent."""
        return self.decides or self in (LinkState.STALE, LinkState.ARRIVED)

    @property
    def is_over(self) -> bool:
        """Whether nothing is sent any more, whatever comes."""
        return self in (LinkState.RESTARTED, LinkState.RELIEVED)

    @property
    def may_hold(self) -> bool:
        """Whether a vehicle that was led may still be told to hold where it was led to."""
        return self not in (LinkState.RESTARTED, LinkState.ON_GROUND)


LEAST_BLIND_S = 1.0
"""Sensors may be silent for so long at any speed."""
DECIDING = (
    LinkState.FLYING,
    LinkState.OTHER_MODE,
    LinkState.NOT_FOLLOWED,
    LinkState.AGEING,
    LinkState.BLIND,
)


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

    def seeing(self, range_m: float, speed_mps: float) -> LinkLimits:
        """The same where no more than half of what was seen ahead is flown without the sensor: what
        is beyond may stand in the way, and to stop takes room too."""
        most_s = max(LEAST_BLIND_S, 0.5 * range_m / speed_mps)
        lost_s = min(self.sensor_lost_s, most_s)
        return replace(self, sensor_lost_s=lost_s, blind_s=min(self.blind_s, 0.5 * lost_s))


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What is known of the link at a moment."""

    heartbeat_age_s: float = math.inf
    position_age_s: float = math.inf
    distances_age_s: float | None = None
    """None where the mission has no sensor."""
    restarted: bool = False
    arrived: bool = False
    airborne: bool = True
    refused: bool = False
    mode_follows: bool = True
    followed: bool = True


def link_state(facts: LinkFacts, limits: LinkLimits) -> LinkState:
    """The state of the link; the first of the table that fits."""
    sensed_s = facts.distances_age_s or 0.0
    fits = (
        (LinkState.RESTARTED, facts.restarted),
        (
            LinkState.WAITING,
            math.inf in (facts.heartbeat_age_s, facts.position_age_s, sensed_s),
        ),
        (LinkState.LINK_LOST, facts.heartbeat_age_s > limits.heartbeat_s),
        (LinkState.POSITION_LOST, facts.position_age_s > limits.lost_s),
        (LinkState.ON_GROUND, not facts.airborne),
        (LinkState.REFUSED, facts.refused),
        (LinkState.SENSOR_LOST, sensed_s > limits.sensor_lost_s and not facts.arrived),
        (LinkState.ARRIVED, facts.arrived),
        (LinkState.STALE, facts.position_age_s > limits.stale_s),
        (LinkState.BLIND, sensed_s > limits.blind_s),
        (LinkState.AGEING, facts.position_age_s > limits.ageing_s),
        (LinkState.OTHER_MODE, not facts.mode_follows),
        (LinkState.NOT_FOLLOWED, not facts.followed),
    )
    return next((state for state, fit in fits if fit), LinkState.FLYING)
