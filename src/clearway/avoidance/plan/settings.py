"""Settings of a flight: how the vehicle senses, remembers and decides, as one frozen value."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, field
from typing import get_args

from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.held_escape import SEES, Escape, Narrow
from clearway.avoidance.rate.fusion import rating_named
from clearway.base.brief import brief
from clearway.base.checks import (
    LARGEST,
    above_zero_problem,
    choice_problem,
    collect_problems,
    kind_of,
    number_problem,
    span_problem,
    take_floats,
    vector_problem,
)
from clearway.base.errors import InputError
from clearway.sensors import combine_rule_named
from clearway.sensors.cells.detection import DetectionRule
from clearway.traffic import TrackerSettings
from clearway.traffic.models.cells import Accuracy
from clearway.traffic.volumes.volume import VolumeSet

TIMES = (
    "state_s", "scan_s", "intruder_s", "ahead_s", "history_s", "memory_s", "patience_turns",
)  # fmt: skip
"""Settings that are ages and durations: 0 or more, infinity too."""


@dataclass(frozen=True, slots=True)
class EvidenceSettings:
    """How evidence is gathered and rated; defaults are those of the paper's static mission."""

    rating: str = "total"
    unknown: float = 0.0
    """How far hidden space counts as blocked, u in [0, 1]."""
    _: KW_ONLY
    unknown_unseen: float = 1.0
    """The same for columns that no beam looks into."""
    threshold: float = 0.3
    """P_R that a trajectory must have."""
    safety_margin_m: float = 0.6
    """From the vehicle's centre to any obstacle's surface."""
    sigmas: float = 3.0
    """Standard deviations of the own position by which the margin grows."""
    own_drift_mps: float = 0.05
    """Growth of the margin with the age of the own state estimate."""
    point_sigmas: float = 2.0
    """Standard deviations of the range by which a hit point grows."""
    intruder_models: tuple[str, ...] = ("line", "spread")
    detection: DetectionRule = "ratio"
    """How hits become P_OD."""
    sensor_fusion: str = "conjunction"
    """How several sensors become one: (5.38), or weighted by precision and trust."""
    accuracy: Accuracy = "fast"
    """How finely volumes, bodies and spreads are looked at; but for "fast", returns at hand are not
    merged either."""

    __repr__ = brief

    def __post_init__(self) -> None:
        rating_named(self.rating)
        combine_rule_named(self.sensor_fusion)
        shares = ("unknown", "unknown_unseen", "threshold")
        lengths = ("safety_margin_m", "sigmas", "own_drift_mps", "point_sigmas")
        problems = collect_problems(
            (
                *(number_problem(key, getattr(self, key), 0.0, 1.0) for key in shares),
                *(number_problem(key, getattr(self, key)) for key in lengths),
            )
        )
        problems += collect_problems(
            (choice_problem("accuracy", self.accuracy, get_args(Accuracy)),)
        )
        if problems:
            raise InputError("settings", problems)
        take_floats(self, EvidenceSettings)


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceSettings(EvidenceSettings):
    """How the vehicle senses, remembers and decides; defaults are those of the static mission.

    This one value holds every setting that goes from a mission to sensing, live and avoidance.

    Raises
    ------
    InputError
        Naming every value that cannot be used.

    Examples
    --------
    >>> import clearway as cw
    >>> cw.AvoidanceSettings(safety_margin_m=3.0, rating="visible")
    AvoidanceSettings(rating='visible', safety_margin_m=3)
    """

    verify: bool = True
    """Hold candidates against the evidence itself; without, cell ratings alone decide."""
    smallest_object_m: float | None = None
    """Thickness of the thinnest thing to keep clear of; None where nothing is declared."""
    escape: str = "strict"
    """What must be known of the escape that every decision holds, see `way_out.Escape`; without a
    range sensor "strict" is as "known"."""
    unobserved_m: float = 0.0
    """Metres of an escape that may lead through unobserved space: of `escape = "budgeted"`, and of
    no other."""
    narrow: str = "refuse"
    """Whether places that leave no escape may be flown through, see `way_out.Narrow`."""
    body_radius_m: float = 0.1
    """Distance kept from unobserved space, and in flight with escapes from all else at least."""
    start_free_m: float | None = None
    """Radius of the ball about the start that counts as seen to be free, since nobody can look at
    where the vehicle stands; None for the length of a movement, or as far as a vehicle that can
    stop needs to leave any start, by `live.preflight.straight_trial`."""
    obstacles_span_m: tuple[float, float] | None = None
    """Lowest and highest height, world frame, between which whatever stands reaches through all
    heights: seen to be free at one of them, a place counts as free at all. None where nothing is
    declared."""
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """What is known of the wind before take-off, world frame; own state estimates tell it from then
    on."""
    prices: Prices = field(default_factory=Prices)
    volumes: VolumeSet | None = None
    """What no aircraft should share with us in the next minute, beside the margin; None looks no
    farther than trajectories lead."""
    lowest_m: float = -math.inf
    """Height below which nobody flies on in the next minute: of a rule, which itself holds it."""
    highest_m: float = math.inf
    """Likewise above."""
    alert_volumes: VolumeSet | None = None
    """Volumes about other aircraft to alert on, at every decision; None alerts on nothing."""
    ground_height_m: float | None = None
    """Height, world frame, at or below which returns come from the ground and are no obstacles;
    whoever sets it keeps the aircraft above by other means."""
    follow_movers: bool = False
    """Count what moves and is seen by LiDAR alone as intruders too."""
    tracker: TrackerSettings | None = None
    """Make reports of intruders into tracks first; None believes each as it comes, save own,
    repeated, late and stale ones."""
    transponder_address: str = ""
    """Of the own transponder, by which own echoes are known; by place where empty."""
    state_s: float = 1.5
    """Age of an own state estimate beyond which it is counted; it is used all the same, and widens
    the margin."""
    scan_s: float = 3.0
    """Age of a scan beyond which its sensor's columns count as unobserved."""
    intruder_s: float = 10.0
    """Age of a report beyond which an intruder is forgotten."""
    ahead_s: float = 0.25
    """Readings that lie farther ahead of the question have a wrong clock; nearer ones wait."""
    history_s: float = 10.0
    """Own state estimates, and movements flown, are kept for so long: late scans are placed by
    them."""
    memory_s: float = 120.0
    """Points out of reach are remembered so long after they were last seen; in reach, for ever."""
    patience_turns: float = 1.5
    """Full circles' worth of time without progress before a detour."""

    __repr__ = brief

    def __post_init__(self) -> None:
        EvidenceSettings.__post_init__(self)
        kind_of("settings.prices", self.prices, Prices)
        problems = [
            above_zero_problem("safety_margin_m", self.safety_margin_m),
            number_problem("body_radius_m", self.body_radius_m),
        ]
        problems.append(vector_problem("wind_mps", self.wind_mps, 3))
        problems += [number_problem(key, getattr(self, key), 0.0, math.inf) for key in TIMES]
        bounds = ("lowest_m", "highest_m")
        problems += [number_problem(key, getattr(self, key), -math.inf, math.inf) for key in bounds]
        if self.ground_height_m is not None:
            problems.append(number_problem("ground_height_m", self.ground_height_m, -LARGEST))
        problems.append(choice_problem("escape", self.escape, (*Escape,)))
        problems.append(choice_problem("narrow", self.narrow, (*Narrow,)))
        problems.append(number_problem("unobserved_m", self.unobserved_m))
        if found := collect_problems(problems):
            raise InputError("settings", found)
        if (self.escape == Escape.BUDGETED) != (self.unobserved_m > 0.0):
            problems.append(
                'unobserved_m: above 0 where escape is "budgeted", and 0 where it is any other'
            )
        if self.escape in SEES and self.body_radius_m == 0.0:
            problems.append(f'body_radius_m: must be above 0 where escape is "{self.escape}"')
        if self.start_free_m is not None:
            problems.append(number_problem("start_free_m", self.start_free_m))
        if self.obstacles_span_m is not None:
            problems.append(span_problem("obstacles_span_m", self.obstacles_span_m))
        if self.smallest_object_m is not None:
            problems.append(above_zero_problem("smallest_object_m", self.smallest_object_m))
        if found := collect_problems(problems):
            raise InputError("settings", found)
        take_floats(self, AvoidanceSettings)
