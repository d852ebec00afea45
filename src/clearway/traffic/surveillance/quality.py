"""Kinds of surveillance by name: range, errors, latency, rate and loss, each with its source."""

from __future__ import annotations

import math
from dataclasses import dataclass

from clearway.base.checks import above_zero_problem, collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.units import FOOT_M
from clearway.base.variants import Variants

NACP_EPU_M = {6: 555.6, 7: 185.2, 8: 92.6, 9: 30.0, 10: 10.0, 11: 3.0}
"""Estimated position uncertainty (95 %, horizontal) by navigation accuracy category, DO-260B."""
NIC_RADIUS_M = {6: 1111.2, 7: 370.4, 8: 185.2, 9: 75.0, 10: 25.0, 11: 7.5}
"""Radius of containment by navigation integrity category, DO-260B: a larger error is alerted."""
NACV_95_MPS = {1: 10.0, 2: 3.0, 3: 1.0, 4: 0.3}
"""Horizontal velocity error (95 %) by navigation accuracy category for velocity, DO-260B."""
RADIUS_95 = math.sqrt(-2.0 * math.log(0.05))
"""Radius that holds 95 % of two independent normal numbers, in deviations: 2.45."""


@dataclass(frozen=True, slots=True)
class Surveillance:
    """How another aircraft is known. Deviations are per axis; errors of one aircraft are drawn once
    (bias), wander (drift) or come anew with every report (noise)."""

    name: str
    about: str
    range_m: float
    """Nothing is heard from farther away."""
    bias_m: float = 0.0
    """Deviation of what is constant of the horizontal position error."""
    drift_m: float = 0.0
    """Of what wanders, with `drift_s` as correlation time."""
    drift_s: float = 60.0
    noise_m: float = 0.0
    contained_m: float = 1e6
    """No horizontal error is larger, but for what measures angles: radius of containment."""
    bearing_rad: float = 0.0
    """Deviation across the line of sight, of what measures angles: grows with the range."""
    elevation_rad: float = 0.0
    velocity_mps: float = 0.0
    """Deviation of the reported horizontal velocity, which wanders as the position does."""
    climb_mps: float = 0.0
    tells_velocity: bool = True
    altitude_bias_m: float = 0.0
    """Deviation of the constant error of height, barometric against barometric."""
    altitude_noise_m: float = 0.0
    altitude_step_m: float = 0.0
    """Heights are reported in steps of this."""
    latency_s: float = 0.0
    """From the time that a report is of to when it is heard; it carries that time."""
    untold_s: float = 0.0
    """Part of the latency that its time does not tell."""
    report_s: float = 1.0
    lost: float = 0.0
    """Share of reports that are lost."""
    burst_s: float = 1.0
    """Mean length of a silence that loss makes."""

    def __post_init__(self) -> None:
        keys = [key for key in self.__slots__ if key not in ("name", "about", "tells_velocity")]
        problems = collect_problems(number_problem(key, getattr(self, key)) for key in keys)
        for key in ("range_m", "drift_s", "report_s", "burst_s", "contained_m"):
            problems += collect_problems([above_zero_problem(key, getattr(self, key))])
        if not self.lost < 1.0:
            problems.append(f"lost: must be below 1, got {self.lost}")
        if problems:
            raise InputError(f"surveillance {self.name}", list(dict.fromkeys(problems)))

    def find_stated_m(self, range_m: float) -> float:
        """Horizontal deviation that a report states, or that is known of the sensor."""
        level = math.hypot(self.bias_m, self.drift_m, self.noise_m)
        return max(math.hypot(level, self.bearing_rad * range_m), 1e-3)

    def find_stated_height_m(self, range_m: float) -> float:
        """Deviation of height, its steps included."""
        told = math.hypot(self.altitude_noise_m, self.altitude_step_m / math.sqrt(12.0))
        return max(math.hypot(told, self.altitude_bias_m, self.elevation_rad * range_m), 1e-3)

    @property
    def stated_mps(self) -> float:
        return max(self.velocity_mps, 1e-3)

    @property
    def stated_climb_mps(self) -> float:
        return max(self.climb_mps, 1e-3)


def by_categories(
    name: str,
    about: str,
    range_m: float,
    nacp: int,
    nic: int,
    nacv: int,
    latency_s: float,
    untold_s: float,
) -> Surveillance:
    """ADS-B of accuracy and integrity categories: half of the variance is bias, half of it wanders,
    and none of it leads beyond the radius of containment; heights in steps of 25 ft with a
    deviation of 10 m between two altimeters, one report in ten lost."""
    part = NACP_EPU_M[nacp] / RADIUS_95 / math.sqrt(2.0)
    return Surveillance(
        name,
        about,
        range_m,
        bias_m=part,
        drift_m=part,
        contained_m=NIC_RADIUS_M[nic],
        velocity_mps=NACV_95_MPS[nacv] / RADIUS_95,
        climb_mps=0.5,
        altitude_bias_m=10.0,
        altitude_step_m=25.0 * FOOT_M,
        latency_s=latency_s,
        untold_s=untold_s,
        report_s=1.0,
        lost=0.1,
        burst_s=3.0,
    )


SURVEILLANCES: Variants[Surveillance] = Variants(
    "surveillance",
    {
        one.name: one
        for one in (
            Surveillance("perfect", "exact, at once, every second, out to 5.5 km", 5556.0),
            by_categories(
                "ads-b",
                "NACp 9, NIC 8 and NACv 2, as most of today's transponders state (DO-260B)",
                8000.0,
                nacp=9,
                nic=8,
                nacv=2,
                latency_s=1.0,
                untold_s=0.2,
            ),
            by_categories(
                "ads-b-minimum",
                "the least of 14 CFR 91.227: NACp 8, NIC 7, NACv 1, 2 s late, 0.6 s untold",
                8000.0,
                nacp=8,
                nic=7,
                nacv=1,
                latency_s=2.0,
                untold_s=0.6,
            ),
            Surveillance(
                "remote-id",
                "broadcast Remote ID at the limits of 14 CFR 89.315: 100 ft, 150 ft of height, 1 s",
                2000.0,
                bias_m=100.0 * FOOT_M / RADIUS_95 / math.sqrt(2.0),
                drift_m=100.0 * FOOT_M / RADIUS_95 / math.sqrt(2.0),
                velocity_mps=1.0,
                climb_mps=0.5,
                altitude_bias_m=150.0 * FOOT_M / 1.96,
                altitude_step_m=0.5,
                latency_s=1.0,
                untold_s=0.1,
                report_s=1.0,
                lost=0.3,
                burst_s=3.0,
            ),
            Surveillance(
                "radar",
                "a small radar as data sheets have them: 2 km, 1 x 1.5 deg, 5 Hz, no velocity",
                2000.0,
                noise_m=3.0,
                bearing_rad=math.radians(1.0),
                elevation_rad=math.radians(1.5),
                tells_velocity=False,
                latency_s=0.2,
                report_s=0.2,
                lost=0.1,
                burst_s=0.5,
            ),
        )
    },
)
"""Surveillance by name."""
