"""What the paper explains with drawings, drawn from computed values: beams, spaces, patches."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.sensors.cells.space import SpaceCells, SpaceClass
from clearway.view.plot.cells import cell_wedges
from clearway.view.plot.space import name_height

INK = "#222222"
BEAM = "#9db8d9"
BODY = "#e8c384"
HIT = "#b2182b"
SPACES = {
    SpaceClass.FREE: "#dcebf7",
    SpaceClass.OCCUPIED: "#b2182b",
    SpaceClass.HIDDEN: "#5c6370",
    SpaceClass.MIXED: "#e8c384",
}


def draw_beams(
    title: str,
    azimuths_rad: FloatArray,
    bodies: Sequence[tuple[FloatArray, float]],
    hits_m: Sequence[FloatArray],
) -> Figure:
    """Beams of one row against bodies (centre [2], radius), each scanned by itself, from above."""
    figure = Figure(figsize=(11.0, 3.2 * len(bodies)), layout="constrained")
    figure.suptitle(title)
    panels = figure.subplots(len(bodies), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (center, radius), hits in zip(panels, bodies, hits_m, strict=True):
        far = float(center[0]) + 2.0 * radius
        for azimuth in azimuths_rad:
            axes.plot([0, far], [0, far * np.tan(azimuth)], color=BEAM, lw=0.9, zorder=1)
        axes.add_patch(Circle((float(center[0]), float(center[1])), radius, color=BODY, zorder=2))
        axes.plot(*hits.T, "o", color=HIT, ms=6, zorder=3)
        axes.plot(0, 0, "o", color=INK, ms=7)
        axes.set_title(f"{len(hits)} hits at {float(center[0]):g} m", fontsize=11)
        axes.set(ylabel="y left (m)", ylim=(-2.2, 2.2), aspect="equal")
        axes.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xlabel("x ahead (m)")
    return figure


def draw_spaces(
    space: SpaceCells, grid: AvoidanceGrid, row: int, points_m: FloatArray, title: str
) -> Figure:
    """Space class of the cells of one row from above, with the occupied points [n, 3]."""
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    axes = figure.add_subplot()
    codes = space.code.reshape(grid.shape)[:, :, row]
    wedges = [wedge for layer in cell_wedges(grid) for wedge in layer]
    colors = [SPACES[SpaceClass(int(code))] for code in codes.ravel()]
    axes.add_collection(PolyCollection(wedges, facecolors=colors, edgecolors="white", lw=0.8))
    here = points_m[grid.cell_of(points_m) % grid.rows == row]
    axes.plot(here[:, 1], here[:, 0], ".", color=INK, ms=2.5)
    axes.plot(0, 0, "^", color=INK, ms=8)
    figure.suptitle(title)
    axes.set(xlabel="y left (m)", ylabel="x ahead (m)", aspect="equal")
    axes.autoscale_view()
    axes.invert_xaxis()
    axes.spines[["top", "right"]].set_visible(False)
    handles = [Patch(color=color, label=kind.name.lower()) for kind, color in SPACES.items()]
    points = axes.plot([], [], ".", color=INK, label="occupied points")
    figure.legend(handles=[*handles, *points], loc="outside lower center", ncols=5, frameon=False)
    return figure


def draw_patch(
    radius_m: float,
    azimuth_rad: tuple[float, float],
    elevation_rad: tuple[float, float],
    title: str,
) -> Figure:
    """A patch of a ball's surface between two azimuths and elevations (fig. 3.2)."""
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    axes = figure.add_subplot(projection="3d")
    assert isinstance(axes, Axes3D)
    turn, rise = np.meshgrid(np.linspace(-np.pi, np.pi, 49), np.linspace(-1.5, 1.5, 25))
    ball = cartesian_from_spherical(np.stack([np.full_like(turn, radius_m), turn, rise], axis=-1))
    axes.plot_wireframe(*np.moveaxis(ball, -1, 0), color=BEAM, lw=0.4, rstride=2, cstride=2)
    turns, rises = np.linspace(*azimuth_rad, 13), np.linspace(*elevation_rad, 13)
    corners = [
        cartesian_from_spherical(
            np.array([[radius_m, a, e] for a, e in ((a0, e0), (a1, e0), (a1, e1), (a0, e1))])
        )
        for a0, a1 in itertools.pairwise(turns)
        for e0, e1 in itertools.pairwise(rises)
    ]
    axes.add_collection3d(Poly3DCollection(corners, facecolor=HIT, edgecolor="white", lw=0.2))
    for azimuth in azimuth_rad:
        for elevation in elevation_rad:
            corner = cartesian_from_spherical(np.array([radius_m, azimuth, elevation]))
            axes.plot(*np.stack([np.zeros(3), corner], axis=1), color=INK, lw=1.0)
    axes.set(xlabel="x ahead (m)", ylabel="y left (m)", title=title)
    name_height(axes, "z up (m)")
    axes.set_box_aspect((1.0, 1.0, 1.0))
    axes.view_init(elev=22.0, azim=35.0)
    return figure
