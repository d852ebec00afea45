"""What an encounter of the risk study is like: whose aircraft, how it decides, what counts.

The loss of well clear is a cylinder, eight times as wide as high, and a margin here is a ball. So
the flight takes place in a world stretched upwards: heights are multiplied by `stretch`, planners
decide on what they then see, and what comes of it is measured in true feet. A ball about the
stretched cylinder protects all of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from clearway.base.checks import collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, KNOT_MPS, NAUTICAL_MILE_M
from clearway.studies.risk.candidates import WantedKinds, find_wanted_kinds
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.entry import Shells
from clearway.traffic.surveillance import SURVEILLANCES
from clearway.traffic.volumes.named import SMALL_WELL_CLEAR
from clearway.vehicle.performance import PERFORMANCES

WELL_CLEAR = Cylinder(2000.0 * FOOT_M, 250.0 * FOOT_M)
"""Of ASTM F3442, for small unmanned aircraft."""
NEAR_COLLISION = Cylinder(500.0 * FOOT_M, 100.0 * FOOT_M)
"""Near mid-air collision."""
COLLISION = Cylinder(15.0, 5.0)
"""Two aircraft touch: about half of both spans, and of both heights."""
STRAIGHT = "straight"
"""Straight flight needs no simulation: what happens without any avoidance."""
CROSSED = 1.25
"""Radii of the encounter cylinder that an ownship crosses until slow aircraft are met too."""
TRACKS = 6
ENTRIES = 6
"""Candidates for one encounter at real scale."""
WIDER = 1.5
"""What intruders are drawn into, over well clear: some that just miss may be made worse."""


def _wider(times: float) -> Cylinder:
    return Cylinder(times * WELL_CLEAR.radius_m, times * WELL_CLEAR.half_height_m)


NEAR = _wider(3.0)
"""What comes no nearer is hardly led astray by any avoidance."""
VALID = {
    "own_kt": (1.0, 1000.0),
    "stretch": (0.1, 100.0),
    "movement_s": (0.1, 100.0),
    "turn_deg_per_s": (0.1, 360.0),
    "pitch_limit_deg": (0.1, 89.0),
    "position_std_m": (0.0, 1e4),
    "velocity_std_mps": (0.0, 1e3),
    "report_s": (0.01, 1e3),
    "spare": (0.1, 100.0),
    "radius_nmi": (0.1, 1e3),
    "half_height_ft": (1.0, 1e5),
    "within_s": (1.0, 1e5),
    "afterwards_s": (0.0, 1e4),
}
"""From and to: what aircraft and their surveillance could have, with room to spare."""
VALID_WHERE_GIVEN = {"range_m": (1.0, 1e6), "reaction_s": (0.0, 600.0)}
HIGHEST_FT = 1e5


@dataclass(frozen=True, slots=True)
class RiskSettings:
    """One study; the defaults are those of docs/risk.md."""

    own_kt: float = 50.0
    """Speed of the ownship: along the nose in the stretched world, so less when it climbs."""
    stretch: float = 4.0
    """Heights are multiplied by this in the world that planners see."""
    movement_s: float = 4.0
    """Duration of a movement, which is the time between decisions."""
    turn_deg_per_s: float = 5.0
    """Of a turn; 12.5 degrees of bank at 50 kt."""
    pitch_limit_deg: float = 20.0
    """In the stretched world: climbs of 430 ft/min at 50 kt."""
    range_movements: int = 15
    """Range of the grid in movements, which is how far ahead a plan goes."""
    position_std_m: float = 0.0
    """Of reports; a quarter of it in height, with the default stretch."""
    velocity_std_mps: float = 0.0
    """Likewise."""
    report_s: float = 1.0
    """Time between reports."""
    spare: float = 1.15
    """Margin that planners are asked to keep, in margins: intruders turn."""
    radius_nmi: float = 3.0
    """Of the encounter cylinder about the ownship, at whose border an encounter begins."""
    half_height_ft: float = 1500.0
    """Likewise."""
    within_s: float = 200.0
    """After entry; what happens later is another encounter's."""
    afterwards_s: float = 40.0
    """Flown on after straight flight has come nearest."""
    layers: tuple[int, ...] = ()
    """Altitude layers of the model, from 0, that intruders begin in; all where empty."""
    vehicle: str = ""
    """Airframe of an encounter at real scale; empty for the stretched world, in which an automaton
    manoeuvres at once and hears perfectly but for `position_std_m` and `velocity_std_mps`."""
    surveillance: str = "ads-b"
    """How the intruder is known, at real scale."""
    range_m: float | None = None
    """How far it is heard; None for the surveillance's own range."""
    reaction_s: float | None = None
    """From a decision to the controls; None for the airframe's own."""
    floor_ft: float = 50.0
    """Height above ground that the ownship of an encounter at real scale is never led below, and
    above which it begins."""
    ceiling_ft: float = 6000.0
    """Likewise above."""
    surveillance_seed: int = 0
    """Of its errors, beside the number of the encounter."""
    tracks: int = 1
    """Drawn for every encounter that is flown."""
    entries: int = 1
    """Of each of them: one of all is flown, see `candidates`."""

    def __post_init__(self) -> None:
        problems = collect_problems(
            number_problem(name, getattr(self, name), low, high)
            for name, (low, high) in VALID.items()
        )
        problems += self._real_scale_problems()
        problems += [
            f"{name}: must be a whole number >= 1, got {getattr(self, name)}"
            for name in ("tracks", "entries")
            if getattr(self, name) < 1
        ]
        if self.range_movements < 3:
            problems.append(f"range_movements: must be at least 3, got {self.range_movements}")
        if not problems and not (
            self.outer.radius_m > 2.0 * WELL_CLEAR.radius_m
            and self.outer.half_height_m > 2.0 * WELL_CLEAR.half_height_m
        ):
            problems.append(
                "radius_nmi, half_height_ft: the encounter cylinder must be more than twice as "
                "wide and as high as well clear, 2000 x 250 ft"
            )
        if problems:
            raise InputError("risk", problems)

    def _real_scale_problems(self) -> list[str]:
        if not self.vehicle:
            return []
        PERFORMANCES.find(self.vehicle)
        SURVEILLANCES.find(self.surveillance)
        problems = collect_problems(
            number_problem(name, getattr(self, name), low, high)
            for name, (low, high) in VALID_WHERE_GIVEN.items()
            if getattr(self, name) is not None
        )
        if not 0.0 <= self.floor_ft < self.ceiling_ft <= HIGHEST_FT:
            problems.append(
                "floor_ft, ceiling_ft: the floor must lie below the ceiling, both within 0 to "
                f"{HIGHEST_FT:,.0f} ft, got {self.floor_ft:g} and {self.ceiling_ft:g}"
            )
        return problems

    @classmethod
    def real_scale(
        cls,
        vehicle: str,
        surveillance: str = "ads-b",
        range_m: float | None = None,
        **others: Any,
    ) -> RiskSettings:
        """Encounters in the true world: a cylinder beyond what is heard, and time to cross it."""
        able, kind = PERFORMANCES.find(vehicle), SURVEILLANCES.find(surveillance)
        heard_nmi = (range_m or kind.range_m) / NAUTICAL_MILE_M
        radius_nmi = max(3.0, heard_nmi + 0.5)
        return cls(
            own_kt=able.speed_mps / KNOT_MPS,
            stretch=1.0,
            radius_nmi=radius_nmi,
            vehicle=vehicle,
            surveillance=surveillance,
            range_m=range_m,
            **{"tracks": TRACKS, "entries": ENTRIES, "within_s": 200.0 * radius_nmi / 3.0} | others,
        )

    @property
    def own_mps(self) -> float:
        return self.own_kt * KNOT_MPS

    @property
    def crossing_s(self) -> float:
        """Whole seconds until aircraft that stand still are met, and those that creep away."""
        return float(round(CROSSED * self.outer.radius_m / self.own_mps))

    @property
    def outer(self) -> Cylinder:
        """The encounter cylinder."""
        return Cylinder(self.radius_nmi * NAUTICAL_MILE_M, self.half_height_ft * FOOT_M)

    @property
    def shells(self) -> Shells:
        """Four fifths of the intruders are drawn so that straight flight meets them."""
        if self.vehicle:
            return Shells(
                self.outer,
                (NEAR, _wider(1.05), NEAR_COLLISION, COLLISION),
                (0.25, 0.35, 0.2, 0.03),
            )
        return Shells(self.outer, (_wider(WIDER), NEAR_COLLISION, COLLISION), (0.4, 0.25, 0.15))

    @property
    def wanted(self) -> WantedKinds:
        """What is flown of the candidates: three in four lose well clear without avoidance."""
        inner = (COLLISION, NEAR_COLLISION, WELL_CLEAR, NEAR)
        return find_wanted_kinds(self.outer, inner, (0.03, 0.32, 0.4, 0.15))

    @property
    def margin_m(self) -> float:
        """Radius of the ball about the stretched well-clear cylinder; at real scale, of well clear
        with its buffer."""
        if self.vehicle:
            return SMALL_WELL_CLEAR.kept.radius_m
        return math.hypot(WELL_CLEAR.radius_m, self.stretch * WELL_CLEAR.half_height_m)

    @property
    def in_words(self) -> str:
        """One line for tables."""
        if self.vehicle:
            heard = "" if self.range_m is None else f" to {self.range_m:g} m"
            return f"{self.vehicle} at {self.own_mps:.0f} m/s, {self.surveillance}{heard}"
        return (
            f"ownship at {self.dynamics_in_words}, {self.surveillance_in_words}, "
            f"heights x {self.stretch:g}"
        )

    @property
    def dynamics_in_words(self) -> str:
        """How the ownship moves: the airframe at real scale, else what an automaton flies."""
        return self.vehicle or f"{self.own_kt:g} kt, {self.turn_deg_per_s:g} deg/s"

    @property
    def surveillance_in_words(self) -> str:
        """How the intruder is known: by name at real scale."""
        if self.vehicle:
            return self.surveillance
        noise = ""
        if self.position_std_m or self.velocity_std_mps:
            noise = f", noise {self.position_std_m:g} m, {self.velocity_std_mps:g} m/s"
        return f"reports every {self.report_s:g} s{noise}"
