"""Figs. 3.2 and 5.1-5.4: a patch of a ball, and the cone in which an intruder may be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.studies.reproduction.intruder_cases import (
    Assessed,
    assess_intruder_alone,
    intruder_of_6_3,
    model_cells,
)
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AT_S = 10.0
STEPS = 400
"""Of numerical integration over the ellipse, each way."""
NODES = 8
"""Of quadrature over a patch, each way: a cosine over 20 degrees is exact to the last digit."""
STEP_RAD = 1e-4
"""Of differences: 2e-9 of a derivative are left out, and 1e-12 are rounding."""
POINTS_PER_M = 10
"""Density k of the paper's lattice (5.24)."""


@dataclass(frozen=True, eq=False)
class Ellipse:
    """Where the intruder of 6.3 may be after 10 s, in the plane across its flight (5.15)."""

    distance_m: float
    semi_axes_m: FloatArray
    """[2] horizontal and vertical, by (5.16)."""

    def density(self, offsets_m: FloatArray) -> FloatArray:
        """[n] of (5.20) at offsets [n, 2], not yet normalised on the ellipse."""
        scaled = offsets_m / self.semi_axes_m
        normal = np.exp(-0.5 * scaled**2) / (np.sqrt(2.0 * np.pi) * self.semi_axes_m)
        mean: FloatArray = normal.mean(axis=1)
        return np.where(np.sum(scaled**2, axis=1) <= 1.0, mean, 0.0)

    def raster(self, per_axis: int) -> FloatArray:
        """[per_axis^2, 2] middles of a raster over the ellipse's rectangle."""
        middle = (np.arange(per_axis) + 0.5) / per_axis * 2.0 - 1.0
        across, up = np.meshgrid(*(axis * middle for axis in self.semi_axes_m))
        return np.stack([across.ravel(), up.ravel()], axis=1)

    @property
    def norm(self) -> float:
        """Integral of the density over the ellipse."""
        area = 4.0 * float(np.prod(self.semi_axes_m)) / STEPS**2
        return float(self.density(self.raster(STEPS)).sum() * area)

    def arrival_s(self, offsets_m: FloatArray, speed_mps: float) -> FloatArray:
        """[n] time of arrival on the straight way from the apex."""
        across = np.sum(offsets_m**2, axis=1)
        times: FloatArray = np.sqrt(self.distance_m**2 + across) / speed_mps
        return times


def ellipse_after(time_s: float) -> Ellipse:
    """Of the intruder of 6.3."""
    intruder = intruder_of_6_3()
    distance = intruder.speed_mps * time_s
    return Ellipse(distance, distance * np.sin(intruder.spread_rad))


@cache
def _spread() -> Assessed:
    return assess_intruder_alone(model_cells("spread")[0])


def patch_figure() -> tuple[Exhibit, ...]:
    """Fig. 3.2."""
    grid = AvoidanceGrid.uniform()
    radius = grid.range_m
    by_formula = float(grid.patch_area_m2(radius)[-1, -1])
    azimuth, elevation = grid.azimuth_edges_rad[-2:], grid.elevation_edges_rad[-2:]
    by_integral = integrate_patch_m2(radius, azimuth, elevation)
    printed = radius**2 * float(np.diff(azimuth)[0] * np.diff(-np.cos(elevation))[0])
    return (
        Exhibit(
            "Figure 3.2",
            "surface of a patch of a ball",
            Findings(
                claim="A patch of radius r between two azimuths and two polar angles has the "
                "area r^2 (cos theta_s - cos theta_e) (phi_e - phi_s), from E, F, G (3.49)-(3.52).",
                ours=f"The outermost upper left patch of the grid at {radius:g} m has "
                f"{by_formula:.4f} m^2 by r^2 (sin e - sin s)(azimuth). The integral of "
                f"sqrt(E G - F^2) over the patch, by quadrature, is {by_integral:.4f} m^2.",
                difference="The area agrees, but (3.52) is printed with a slip in X_phi. The "
                "paper's theta is a polar angle, while sensors and grid count elevation from the "
                "horizon, so that cosines become sines: with elevations put into the cosines "
                f"the patch would have {printed:.2f} m^2, {printed / by_formula:.0%} of its area.",
                measures=(
                    Measure(
                        "area by the formula, m^2",
                        by_formula,
                        by_integral,
                        "reference",
                        1e-6 * by_integral,
                    ),
                ),
            ),
            partial(_draw_patch, radius, tuple(azimuth), tuple(elevation)),
        ),
    )


def integrate_patch_m2(radius_m: float, azimuth: FloatArray, elevation: FloatArray) -> float:
    """Area [m^2] of a patch between two azimuths and two elevations [rad], without the formula.

    E, F and G (3.49) are made of differences of places on the ball, the tangents (3.52), and the
    element sqrt(E G - F^2), (3.50) and (3.51), is integrated by Gauss and Legendre's quadrature.
    What both leave out is below 1e-8 of the area.
    """
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    half = 0.5 * np.diff(azimuth)[0], 0.5 * np.diff(elevation)[0]
    turn, rise = np.meshgrid(
        np.mean(azimuth) + half[0] * nodes, np.mean(elevation) + half[1] * nodes, indexing="ij"
    )

    def along(turn_rad: float, rise_rad: float) -> FloatArray:
        ends = [
            cartesian_from_spherical(
                np.stack(
                    [np.full_like(turn, radius_m), turn + way * turn_rad, rise + way * rise_rad],
                    axis=-1,
                )
            )
            for way in (1.0, -1.0)
        ]
        slope: FloatArray = (ends[0] - ends[1]) / (2.0 * STEP_RAD)
        return slope

    by_turn, by_rise = along(STEP_RAD, 0.0), along(0.0, STEP_RAD)
    e, f, g = (
        np.sum(one * other, axis=-1)
        for one, other in ((by_turn, by_turn), (by_turn, by_rise), (by_rise, by_rise))
    )
    return float(half[0] * half[1] * (weights @ np.sqrt(e * g - f**2) @ weights))


def _draw_patch(
    radius_m: float, azimuth: tuple[float, float], elevation: tuple[float, float]
) -> Figure:
    from clearway.view.plot.sketches import draw_patch

    return draw_patch(radius_m, azimuth, elevation, "Figure 3.2: a patch of a ball's surface")


def cone_figures() -> tuple[Exhibit, ...]:
    """Figs. 5.1-5.4."""
    ellipse = ellipse_after(AT_S)
    return (_position(ellipse), _density(ellipse), _intersection(), _arrival(ellipse))


def _position(ellipse: Ellipse) -> Exhibit:
    across, up = ellipse.semi_axes_m
    tangents = ellipse.distance_m * np.tan(intruder_of_6_3().spread_rad)
    return Exhibit(
        "Figure 5.1",
        "a probable position after 10 s",
        Findings(
            claim="At 10 s the intruder is in an ellipse across its straight line, with semi-axes "
            "d sin theta and d sin phi (5.16).",
            ours=f"With the spreads of 6.3, pi/12 and pi/16: {across:.3f} m and {up:.3f} m.",
            difference=f"A cone with these half-angles would have tangents: {tangents[0]:.3f} m "
            f"and {tangents[1]:.3f} m. Sines are used for rating, as printed, tangents for "
            "verification, which must cover all of the stated spread.",
            measures=(
                Measure(
                    "horizontal semi-axis, m",
                    float(across),
                    10.0 * np.sin(np.pi / 12),
                    "paper",
                    1e-9,
                ),
                Measure(
                    "vertical semi-axis, m", float(up), 10.0 * np.sin(np.pi / 16), "paper", 1e-9
                ),
            ),
        ),
        partial(_draw_position, ellipse),
    )


def _draw_position(ellipse: Ellipse) -> Figure:
    from clearway.view.plot.cone import draw_position

    intruder = intruder_of_6_3()
    return draw_position(
        intruder.position_m,
        intruder.velocity_mps / intruder.speed_mps,
        ellipse.distance_m,
        ellipse.semi_axes_m,
        "Figure 5.1: where the intruder may be after 10 s",
    )


def _density(ellipse: Ellipse) -> Exhibit:
    ends = np.array([[0.0, 0.0], [ellipse.semi_axes_m[0], 0.0], [0.0, ellipse.semi_axes_m[1]]])
    middle, side, top = ellipse.density(ends * 0.999999) / ellipse.norm
    return Exhibit(
        "Figure 5.2",
        "probability of the intruder's position in the ellipse",
        Findings(
            claim="The probability of deviation falls with the distance from the centre of the "
            "ellipse.",
            ours=f"{middle:.4f} per m^2 at the centre, {side:.4f} at the end of the horizontal "
            f"axis, {top:.4f} at that of the vertical one.",
            difference="With standard deviations as long as the semi-axes it falls little: to "
            f"{side / middle:.0%} and {top / middle:.0%}. Summed over the ellipse before "
            f"normalising, (5.20) gives {ellipse.norm:.3f}, not 1.",
            measures=(
                Measure("density at the centre, per m^2", float(middle)),
                Measure("at the end of the horizontal axis, of that", float(side / middle)),
                Measure("at the end of the vertical axis, of that", float(top / middle)),
                Measure("integral over the ellipse before normalising", ellipse.norm),
            ),
        ),
        partial(_draw_density, ellipse),
    )


def _draw_density(ellipse: Ellipse) -> Figure:
    from clearway.view.plot.cone import draw_on_ellipse

    offsets = ellipse.raster(160)
    return draw_on_ellipse(
        offsets,
        np.where(ellipse.density(offsets) > 0.0, ellipse.density(offsets) / ellipse.norm, np.nan),
        ellipse.semi_axes_m,
        "probability density (1/m²)",
        "Figure 5.2: where the intruder is after 10 s",
    )


def _intersection() -> Exhibit:
    spread = _spread()
    met = spread.probability > 0.0
    return Exhibit(
        "Figure 5.3",
        "avoidance grid and cone of an intruder",
        Findings(
            claim="The cone, an elliptic one, intersects the grid.",
            ours=f"The intruder of 6.3 comes from the left; its cone meets {int(met.sum())} of "
            f"{len(met)} cells.",
            difference="",
            measures=(Measure("cells met", int(met.sum()), 131, "reference"),),
        ),
        partial(_draw_intersection, spread),
    )


def _draw_intersection(spread: Assessed) -> Figure:
    from clearway.view.plot.cone import draw_cone_in_grid

    intruder = intruder_of_6_3()
    return draw_cone_in_grid(
        spread.reach_set.grid,
        spread.probability > 0.0,
        intruder.position_m,
        intruder.velocity_mps / intruder.speed_mps,
        np.sin(intruder.spread_rad),
        "Figure 5.3: avoidance grid and cone of the intruder",
    )


def _arrival(ellipse: Ellipse) -> Exhibit:
    points = _lattice(ellipse)
    arrival = ellipse.arrival_s(points, intruder_of_6_3().speed_mps)
    return Exhibit(
        "Figure 5.4",
        "time of arrival on one ellipse",
        Findings(
            claim="Each point of the discrete ellipse (5.28) has a time of arrival.",
            ours=f"{len(points)} points, {POINTS_PER_M} to a metre, are reached from "
            f"{float(arrival.min()):.2f} to {float(arrival.max()):.2f} s on the straight way from "
            "where the intruder was detected.",
            difference="The text gives no equation for it. The model itself needs none: every "
            "point of the cone lies on a straight ray, whose times in a cell are exact.",
            measures=(
                Measure("points of the discrete ellipse", len(points)),
                Measure("first arrival, s", float(arrival.min()), AT_S, "paper", 0.001),
                Measure("last arrival, s", float(arrival.max())),
            ),
        ),
        partial(_draw_arrival, ellipse),
    )


def _lattice(ellipse: Ellipse) -> FloatArray:
    """[n, 2] points of the paper's lattice (5.25) within the ellipse (5.26)."""
    steps = [
        np.arange(-int(a * POINTS_PER_M), int(a * POINTS_PER_M) + 1) for a in ellipse.semi_axes_m
    ]
    across, up = np.meshgrid(*(step / POINTS_PER_M for step in steps))
    points = np.stack([across.ravel(), up.ravel()], axis=1)
    within: FloatArray = points[np.sum((points / ellipse.semi_axes_m) ** 2, axis=1) <= 1.0]
    return within


def _draw_arrival(ellipse: Ellipse) -> Figure:
    from clearway.view.plot.cone import draw_on_ellipse

    points = _lattice(ellipse)
    return draw_on_ellipse(
        points,
        ellipse.arrival_s(points, intruder_of_6_3().speed_mps),
        ellipse.semi_axes_m,
        "time of arrival (s)",
        "Figure 5.4: time of arrival on one ellipse",
    )
