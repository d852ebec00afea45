# %% [markdown]
# # Bring your own sensor
#
# clearway takes anything that measures where things are. Of a reading it asks three questions: what
# does it say of the cells, where are its returns and how far may each be off, and which places does
# it show to be empty? A LiDAR answers them by its beams. Here is a third kind of sensor: a radar
# that sees far, through fog too, but measures bearings badly.
#
# Run it as a script, `python examples/own_sensor.py [folder]`, or cell by cell in an editor that
# knows `# %%`.

# %%
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import clearway as cw
from clearway.sensors import Detection, RangeSensor, Standing, detection_of_cells

# %% [markdown]
# ## The radar
#
# A reading is a `Scan`: points in the sensor's frame, a time, the sensor's name. This radar sits in
# the nose and looks ahead, so that its frame is the vehicle's body. All that it needs is below; it
# inherits from nothing. `scan` is only there for the simulator, which asks what it would measure.


# %%
@dataclass(frozen=True)
class Radar:
    """A radar in the nose, with noise of range and bearing."""

    name: str = "radar"
    standing: Standing = field(default_factory=lambda: Standing(precision=0.6))
    max_range_m: float = 60.0
    sigma_m: float = 0.4
    bearing_sigma_rad: float = float(np.radians(1.5))
    field_rad: tuple[float, float] = (float(np.radians(50)), float(np.radians(25)))
    seen: float = 0.9  # probability that a beam which meets something says so

    def detect(self, grid, scan, *, grid_from_body=None, **_how_hits_are_counted) -> Detection:
        """P_OD: where the echo may come from, spread over the cells by what is not sure."""
        rotation, shift = grid_from_body or (np.eye(3), np.zeros(3))
        rng = np.random.default_rng(0)  # the same spread for the same reading
        free = np.ones(grid.cells)
        for point in scan.points_m:
            at = cell_shares(grid, self.spread(point, rng) @ rotation.T + shift)
            free *= 1.0 - at
        probability = 1.0 - free
        middle = 0.5 * (grid.azimuth_edges_rad[1:] + grid.azimuth_edges_rad[:-1])
        height = 0.5 * (grid.elevation_edges_rad[1:] + grid.elevation_edges_rad[:-1])
        looks = (np.abs(middle)[:, None] <= self.field_rad[0]) & (
            np.abs(height)[None, :] <= self.field_rad[1]
        )
        return detection_of_cells(
            grid,
            self.name,
            scan.time_s,
            probability,
            looks.ravel(),
            scan.points_m @ rotation.T + shift,
            self.balls(scan.points_m),
            self.max_range_m,
        )

    def returns(self, scan, state, reach_m, ground_m):
        """Echoes in the world, as balls that cover two standard deviations of the bearing."""
        near = np.linalg.norm(scan.points_m, axis=1) <= min(reach_m, self.max_range_m)
        points = scan.points_m[near] @ state.world_from_body.T + state.position_m
        above = points[:, 2] > ground_m
        return points[above], self.balls(scan.points_m[near])[above]

    def passes(self, scan, state, position_m, radius_m, tolerance_m):
        """What is inside the field, and has no echo in or before it within the bearing's noise."""
        place = (position_m - state.position_m) @ state.world_from_body
        distance, azimuth, elevation = polar(place)
        inside = (np.abs(azimuth) < self.field_rad[0]) & (np.abs(elevation) < self.field_rad[1])
        inside &= distance + tolerance_m < self.max_range_m
        ranges, azimuths, elevations = polar(scan.points_m)
        reach = 3.0 * self.bearing_sigma_rad + np.arctan2(radius_m, distance)
        off = np.hypot(azimuth[:, None] - azimuths, elevation[:, None] - elevations)
        stops = (off < reach[:, None]) & (ranges <= (distance + tolerance_m)[:, None])
        return inside & ~stops.any(axis=1)

    def scan(self, world, state, rng) -> cw.Scan:
        """For the simulator: echoes of a fan of beams, some lost, the others noisy."""
        azimuth, elevation = np.meshgrid(
            np.linspace(-1.0, 1.0, 41) * self.field_rad[0],
            np.linspace(-1.0, 1.0, 15) * self.field_rad[1],
        )
        beams = unit(azimuth.ravel(), elevation.ravel())
        directions = np.ascontiguousarray(beams @ state.world_from_body.T)
        ranges = world.cast(state.position_m, directions, self.max_range_m)
        echo = np.isfinite(ranges) & (rng.random(len(ranges)) < self.seen)
        measured = ranges[echo] + rng.normal(0.0, self.sigma_m, echo.sum())
        noise = rng.normal(0.0, self.bearing_sigma_rad, (2, echo.sum()))
        directions = unit(azimuth.ravel()[echo] + noise[0], elevation.ravel()[echo] + noise[1])
        return cw.Scan(measured[:, None] * directions, state.time_s, sensor=self.name)

    def balls(self, points: np.ndarray) -> np.ndarray:
        """How far to the side an echo may be off."""
        return 2.0 * self.bearing_sigma_rad * np.linalg.norm(points, axis=1)

    def spread(self, point: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """[100, 3] places that an echo may come from."""
        distance, azimuth, elevation = (float(value[0]) for value in polar(point[None]))
        turned = rng.normal(0.0, self.bearing_sigma_rad, (2, 100))
        ranges = distance + rng.normal(0.0, self.sigma_m, 100)
        return ranges[:, None] * unit(azimuth + turned[0], elevation + turned[1])


def polar(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Range, azimuth (left positive) and elevation (up positive)."""
    x, y, z = points.T
    return np.sqrt(x * x + y * y + z * z), np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))


def unit(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)


def cell_shares(grid: cw.AvoidanceGrid, places: np.ndarray) -> np.ndarray:
    """[cells] share of the places in each cell."""
    cells = grid.cell_of(places)
    return np.bincount(cells[cells >= 0], minlength=grid.cells) / len(places)


# %% [markdown]
# ## What it is good for
#
# Fog: the LiDAR sees 15 m, the radar 60 m. The vehicle flies at 5 m/s with a turning radius of 19 m
# towards two towers that no map shows. `weighted` lets the LiDAR, which is the more precise, count
# for more where both look.

# %%
if __name__ == "__main__":
    radar = Radar()
    print("answers all questions of a range sensor:", isinstance(radar, RangeSensor))
    grid = cw.AvoidanceGrid.uniform(range_m=60.0, layers=12)
    automaton = cw.MovementAutomaton.plane(speed_mps=5.0)
    library = cw.ReachLibrary.load_or_build(automaton, grid)
    settings = cw.AvoidanceSettings(safety_margin_m=3.0, sensor_fusion="weighted")
    planner = cw.Planner.of(library, settings)
    towers = cw.ObstacleMap(
        [
            cw.Obstacle.cuboid([110.0, 2.0, 0.0], [8.0, 14.0, 80.0], name="tower"),
            cw.Obstacle.cuboid([200.0, -8.0, 0.0], [8.0, 24.0, 80.0], name="second tower"),
        ]
    )
    lidar = cw.Lidar(
        "lidar", cw.BeamPattern.per_cell(grid, max_range_m=15.0), sigma_m=0.03, dropout=0.05
    )
    mission = cw.Mission(
        "fog", cw.State(np.zeros(3)), waypoints_m=np.array([[280.0, 0.0, 0.0]]), reach_radius_m=7.5
    )
    runs = {}
    for name, sensors in (("lidar alone", [lidar]), ("lidar and radar", [lidar, radar])):
        system = cw.AvoidanceSystem(planner, mission, lidars=sensors)
        runs[name] = cw.simulate(
            system, towers, lidars=sensors, settings=cw.SimulationSettings(time_limit_s=200.0)
        )

    print(f"{'sensors':<17}{'reached':<9}{'nearest':<10}{'emergencies':<13}{'first seen':<12}path")
    for name, run in runs.items():
        first = next(e.flight for e in run.decisions if len(e.flight.decision.seen_m))
        away = 106.0 - first.state.position_m[0]
        print(
            f"{name:<17}{'yes' if run.reached else 'NO':<9}"
            f"{run.metrics.min_obstacle_distance_m:.2f} m{'':<4}{run.emergencies:<13}"
            f"{away:.0f} m{'':<8}{run.metrics.path_length_m:.1f} m"
        )

# %% [markdown]
# ## Both from above
#
# With the radar, the vehicle turns away early. Several sensors also watch each other: see
# `docs/sensors.md` for what happens to one that lies.

# %%
if __name__ == "__main__":
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(12, 3.6), layout="constrained")
    for tower in ((106.0, -5.0, 8.0, 14.0), (196.0, -20.0, 8.0, 24.0)):
        axes.add_patch(plt.Rectangle(tower[:2], tower[2], tower[3], color="tab:brown"))
    for (name, run), colour in zip(runs.items(), ("tab:orange", "tab:blue"), strict=True):
        axes.plot(run.states[:, 0], run.states[:, 1], color=colour, label=name)
    here = np.array([60.0, 0.0, 0.0])
    echoes = radar.scan(towers, cw.State(here), np.random.default_rng(1)).points_m + here
    label = "one radar reading, at x = 60 m"
    axes.plot(echoes[:, 0], echoes[:, 1], ".", color="tab:red", markersize=3, label=label)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_aspect("equal")
    axes.legend(loc="lower left")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clearway-out/examples")
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "own_sensor.png", dpi=100)
    print(f"wrote {folder / 'own_sensor.png'}")
