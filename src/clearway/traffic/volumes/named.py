"""The volumes that standards define, by name."""

from __future__ import annotations

from clearway.base.units import FOOT_M, NAUTICAL_MILE_M
from clearway.base.variants import Variants
from clearway.traffic.volumes.volume import AirVolume, AlertLevel, AlertRule, VolumeSet

NEAR_MID_AIR = AirVolume("near mid-air collision", 500.0 * FOOT_M, 100.0 * FOOT_M)
"""ASTM F3442, DO-365: what the risk ratios of both are about."""
SMALL_WELL_CLEAR = AirVolume(
    "well clear",
    2000.0 * FOOT_M,
    250.0 * FOOT_M,
    buffer_m=250.0 * FOOT_M,
    buffer_height_m=50.0 * FOOT_M,
)
"""Of ASTM F3442, for small unmanned aircraft; the buffers are this program's."""


def _by_do_365(
    name: str, about: str, radius_m: float, tau_s: float, early_s: float, late_s: float,
    preventive_ft: float,
) -> VolumeSet:  # fmt: skip
    """Alerts where two of the last four seconds ask for them."""
    clear = AirVolume("well clear", radius_m, 450.0 * FOOT_M, tau_s)
    above = AirVolume("preventive", radius_m, preventive_ft * FOOT_M, tau_s)
    return VolumeSet(
        name,
        about,
        (clear, NEAR_MID_AIR),
        (
            AlertRule(AlertLevel.PREVENTIVE, above, early_s),
            AlertRule(AlertLevel.CORRECTIVE, clear, early_s),
            AlertRule(AlertLevel.WARNING, clear, late_s),
        ),
        window_s=4.0,
        needed=2,
    )


SMALL = VolumeSet.of(
    "f3442", (SMALL_WELL_CLEAR, NEAR_MID_AIR), "ASTM F3442, small unmanned aircraft: 2000 x 250 ft"
)
EN_ROUTE = _by_do_365(
    "do-365", "DO-365 en route: 0.66 nmi, 450 ft, modified tau of 35 s",
    0.66 * NAUTICAL_MILE_M, 35.0, 55.0, 25.0, 700.0,
)  # fmt: skip
TERMINAL = _by_do_365(
    "do-365-terminal", "DO-365 in terminal areas: 1500 x 450 ft",
    1500.0 * FOOT_M, 0.0, 45.0, 45.0, 450.0,
)  # fmt: skip
NON_COOPERATIVE = _by_do_365(
    "do-365-non-cooperative", "DO-365 for intruders that tell nothing: 2200 x 450 ft",
    2200.0 * FOOT_M, 0.0, 55.0, 25.0, 450.0,
)  # fmt: skip

VOLUME_SETS: Variants[VolumeSet] = Variants(
    "volume set", {each.name: each for each in (SMALL, EN_ROUTE, TERMINAL, NON_COOPERATIVE)}
)
"""What may be kept, by name."""
