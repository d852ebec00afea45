"""Figs. 2.1, 2.2, 3.1 and 5.9-5.11, which the paper draws by hand: the same scenes, scanned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.avoidance.scene import SceneAssessment, assess_scene
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.missions.scene_reading import scene_of
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import BeamPattern, Lidar, detect
from clearway.sensors.beams.simulate import simulate_scan
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BALL_M = 0.872
STEP_DEG = 4.0
"""Between beams: 5 of a row meet the ball at 5 m, 3 at 10 m, as in fig. 2.1."""
DISTANCES_M = (5.0, 10.0)
MIDDLE = 2
MAP_OBSTACLE = "#1f3fd6"


@dataclass(frozen=True, eq=False)
class Scanned:
    """One of two equal balls, scanned from the origin."""

    distance_m: float
    points_m: FloatArray
    ratio: float
    """P_O of its cell by hits of all beams (5.41)."""
    surface: float
    """The same by the hits expected of its surface at that distance."""

    @property
    def hits_in_middle_row(self) -> int:
        return int(np.sum(np.abs(self.points_m[:, 2]) < 1e-9))


def scan_figures() -> tuple[Exhibit, ...]:
    """Figs. 2.1 and 2.2."""
    return (_density_figure(), _draw_overshadowed())


def _density_figure() -> Exhibit:
    near, far = (scan_of_ball(distance) for distance in DISTANCES_M)
    return Exhibit(
        "Figure 2.1",
        "LiDAR hits on equal objects at different distance",
        Findings(
            claim="Of two equal objects the one at 5 m takes 5 hits, that at 10 m 3; equal "
            "scanned surfaces must rate equally.",
            ours=f"{near.hits_in_middle_row} and {far.hits_in_middle_row} hits in the middle "
            f"row, {len(near.points_m)} and {len(far.points_m)} in all. As hits of all beams "
            f"(5.41) they rate {near.ratio:.3f} and {far.ratio:.3f}; with the rule `surface`, "
            f"hits of those expected at that distance, {near.surface:.2f} and "
            f"{far.surface:.2f}.",
            difference="(5.41), which the paper gives later, does not do what it asks for "
            "here; the rule `surface` does, up to whole beams.",
            measures=(
                Measure("hits in the middle row at 5 m", near.hits_in_middle_row, 5, "paper"),
                Measure("hits in the middle row at 10 m", far.hits_in_middle_row, 3, "paper"),
                Measure("rule ratio, far over near", far.ratio / near.ratio),
                Measure("rule surface, far over near", far.surface / near.surface, 1, "paper", 0.1),
            ),
        ),
        partial(_draw_density, (near, far)),
    )


def scan_of_ball(distance_m: float) -> Scanned:
    """Scan a ball on the axis with a raster of beams."""
    angles = np.radians(np.arange(-44.0, 45.0, STEP_DEG))
    lidar = Lidar("lidar", BeamPattern.from_angles(angles, angles, max_range_m=12.0))
    grid = AvoidanceGrid.uniform(12.0, 6, azimuth_deg=46.0, columns=1, elevation_deg=46.0, rows=1)
    world = ObstacleMap([Obstacle.ball([distance_m, 0.0, 0.0], BALL_M)])
    scan = simulate_scan(lidar, world, State(np.zeros(3)))
    area = np.pi * BALL_M**2
    rated = [
        detect(grid, lidar, scan, rule=rule, reference_area_m2=area).probability.sum()
        for rule in ("ratio", "surface")
    ]
    points = np.asarray(scan.points_m)
    points = points[np.all(np.isfinite(points), axis=1)]
    return Scanned(distance_m, points, float(rated[0]), float(rated[1]))


def _draw_density(scans: Sequence[Scanned]) -> Figure:
    from clearway.view.plot.sketches import draw_beams

    return draw_beams(
        "Figure 2.1: hits on equal objects",
        np.radians(np.arange(-16.0, 17.0, STEP_DEG)),
        [(np.array([s.distance_m, 0.0]), BALL_M) for s in scans],
        [s.points_m[np.abs(s.points_m[:, 2]) < 1e-9][:, :2] for s in scans],
    )


def _ball(position_m: Sequence[float], radius_m: float) -> dict[str, Any]:
    return {"shape": "ball", "position_m": list(position_m), "radius_m": radius_m}


def assess_pictured_scene(
    name: str, charted: Mapping[str, Any], there: list[dict[str, Any]]
) -> SceneAssessment:
    """A scene with one obstacle on the map, and what a LiDAR sees of what is there."""
    content = {
        "obstacle": [charted],
        "scan": {"simulate": {"obstacles": (), "obstacle": there}},
    }
    return assess_scene(scene_of(name, content, Path(), name).scene)


def _draw_overshadowed() -> Exhibit:
    charted = _ball((7.5, 0, 0), 1.0)
    screens = [_ball((4.5, side, 0), 0.7) for side in (-1.1, 0.0, 1.1)]
    scene = assess_pictured_scene("figure 2.2", charted, screens)
    base, visible = scene.cells.evidence.map_base, scene.cells.evidence.visibility
    filled = base > 0.05
    hidden = float(np.average(1.0 - visible[filled], weights=base[filled]))
    return Exhibit(
        "Figure 2.2",
        "map obstacle overshadowed by detected ones",
        Findings(
            claim="A map obstacle behind three scanned ones cannot be seen, so that its "
            "uncertainty arises; hits alone miss it.",
            ours=f"{hidden:.0%} of it is hidden; its cells get up to "
            f"{float(scene.cells.map[filled].max()):.2f} by (5.54), and no hits.",
            difference="",
            measures=(
                Measure("share of the map obstacle that is hidden", hidden),
                Measure(
                    "largest probability of its cells from hits alone",
                    float(scene.cells.evidence.detected[filled].max()),
                    0.0,
                    "paper",
                    1e-9,
                ),
                Measure("largest probability (5.54)", float(scene.cells.map[filled].max())),
            ),
        ),
        partial(
            _draw_cells,
            scene,
            "visibility",
            "Figure 2.2: map obstacle overshadowed by detected ones",
            charted,
        ),
    )


def spaces_figure() -> tuple[Exhibit, ...]:
    """Fig. 3.1."""
    scene = assess_pictured_scene("figure 3.1", _ball((30, 0, 0), 1.0), [_ball((5, 0.5, 0), 1.2)])
    names = np.array(scene.space.names)
    counts = {kind: int(np.sum(names == kind)) for kind in ("free", "occupied", "hidden", "mixed")}
    accessible = int(scene.space.accessible.sum())
    return (
        Exhibit(
            "Figure 3.1",
            "six spaces of interest",
            Findings(
                claim="Occupied points, hidden space, free space, surface, interior and exterior "
                "of objects; the accessible space (3.33) is free and exterior.",
                ours="Behind a ball of 1.2 m radius: "
                + ", ".join(f"{count} cells {kind}" for kind, count in counts.items())
                + f"; {accessible} wholly in the accessible space.",
                difference="A scan shows surfaces only: what is inside of an object and what is "
                "behind it are both hidden, until a map tells them apart.",
                measures=(
                    *(Measure(f"cells {kind}", count) for kind, count in counts.items()),
                    Measure("free but not accessible", counts["free"] - accessible, 0, "paper"),
                ),
            ),
            partial(_draw_spaces, scene),
        ),
    )


def _draw_spaces(scene: SceneAssessment) -> Figure:
    from clearway.view.plot.sketches import draw_spaces

    return draw_spaces(
        scene.space,
        scene.scene.grid,
        MIDDLE,
        np.concatenate([found.points_m for found in scene.detections]),
        "Figure 3.1: spaces of the middle row behind a ball",
    )


MAP_CASES: tuple[tuple[str, str, list[dict[str, Any]], str, str], ...] = (
    (
        "5.9",
        "undetected",
        [],
        "Charted, seen into, not detected: its probability is 0.",
        "",
    ),
    (
        "5.10",
        "detected",
        [_ball((7, 0, 0), 1.0)],
        "Charted and detected: its probability is that of the detected obstacle, 1.",
        "",
    ),
    (
        "5.11",
        "hidden behind a detected obstacle",
        [_ball((3, 0, 0), 0.284), _ball((7, 0, 0), 1.0)],
        "A detected obstacle lowers visibility behind it by 60 %, and the charted obstacle counts "
        "for that share.",
        "",
    ),
)
"""Figure, title, what is there, claim, difference."""


def map_figures() -> tuple[Exhibit, ...]:
    """Figs. 5.9-5.11: a charted ball at 7 m."""
    return tuple(_map_case(*case) for case in MAP_CASES)


def _map_case(
    figure: str, title: str, there: list[dict[str, Any]], claim: str, difference: str
) -> Exhibit:
    charted = _ball((7, 0, 0), 1.0)
    scene = assess_pictured_scene(f"figure {figure}", charted, there)
    grid = scene.scene.grid
    cell = int(grid.cell_of(np.array([6.5, 0.0, 0.0])))
    evidence = scene.cells.evidence
    visible, base = float(evidence.visibility[cell]), float(evidence.map_base[cell])
    expected = {"5.9": 1.0, "5.11": 0.4}.get(figure)
    whole = {"5.9": 0.0, "5.10": 1.0}.get(figure)
    total = float(scene.cells.obstacle[cell])
    return Exhibit(
        f"Figure {figure}",
        f"map obstacle, {title}",
        Findings(
            claim=claim,
            ours=f"Of the cell at 6.5 m the map obstacle fills {base:.2f}; visibility is "
            f"{visible:.2f}, probability by the map (5.54) {float(scene.cells.map[cell]):.2f}, by "
            f"hits {float(evidence.detected[cell]):.2f}, together {total:.2f}.",
            difference=difference,
            measures=(
                Measure("visibility of the cell at 6.5 m", visible, expected, "paper", 0.03),
                Measure(
                    "its probability by the map (5.54)",
                    float(scene.cells.map[cell]),
                    base * (1.0 - visible),
                    "paper",
                    1e-9,
                ),
                Measure("its obstacle probability (4.17)", total, whole, "paper", 1e-9),
            ),
        ),
        partial(_draw_cells, scene, "obstacle", f"Figure {figure}: map obstacle, {title}", charted),
    )


def _draw_cells(
    scene: SceneAssessment, quantity: str, title: str, charted: Mapping[str, Any]
) -> Figure:
    from matplotlib.figure import Figure

    from clearway.view.plot.assessment import VISIBLE, obstacle_quantity
    from clearway.view.plot.cells import Border, CellView, Quantity, draw_cells

    center, radius = np.array(charted["position_m"]), float(charted["radius_m"])
    border = Border(
        lambda points: np.asarray(np.linalg.norm(points - center, axis=1) - radius),
        "obstacle on the map",
        MAP_OBSTACLE,
    )
    nowhere = np.zeros(scene.scene.grid.cells, dtype=np.bool_)
    visibility = scene.cells.evidence.visibility
    shown = (
        Quantity("visibility: 0 hidden, 1 visible", visibility, VISIBLE, nowhere)
        if quantity == "visibility"
        else obstacle_quantity(scene.cells, nowhere)
    )
    points = np.concatenate([found.points_m for found in scene.detections])
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    figure.suptitle(title, fontsize=14)
    view = CellView(rows=(MIDDLE,), border=border)
    draw_cells(figure, scene.scene.grid, shown, points, view)
    return figure
