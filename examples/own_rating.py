# %% [markdown]
# # Bring your own rating
#
# For every cell of the avoidance grid there is evidence: how likely an obstacle was detected in
# it, how much of it is visible, what a map says, whether an intruder may be there. A *rating*
# turns that into one number between 0 (never go there) and 1 (safe). clearway has four of them by
# name; any function of the same kind takes their place.
#
# Run it as a script, `python examples/own_rating.py [folder]`, or cell by cell in an editor that
# knows `# %%`.

# %%
import sys
from pathlib import Path

import numpy as np

import clearway as cw
from clearway.avoidance.rate.fusion import Evidence

# %% [markdown]
# ## The rating
#
# It gets the evidence, the obstacle probability P_O of (4.17), and how far unknown space counts as
# blocked, each an array with one number for every cell. This one has no trust in what is half
# hidden: whatever a beam does not see counts as blocked, squared. Behind every obstacle it sees a
# wall.


# %%
def wary(evidence: Evidence, obstacle: np.ndarray, unknown: np.ndarray) -> np.ndarray:
    """Visible and free, both beyond doubt: P_V^2 (1 - P_O)."""
    free = evidence.visibility**2 * (1.0 - obstacle)
    return np.where(evidence.seen, free, free * (1.0 - unknown))


# %% [markdown]
# ## In a mission
#
# Wherever a rating is named, `module:name` is one too: on the command line, and in files, where the
# module may lie beside the file.
#
#     cd examples
#     clearway fly static-obstacles --rating own_rating:wary
#
# or `[rating] name = "own_rating:wary"` in a mission.

# %% [markdown]
# ## A world to try it in
#
# Two columns of trees with a gap, a LiDAR that looks through it, and a waypoint behind.

# %%
if __name__ == "__main__":
    grid = cw.AvoidanceGrid.uniform(range_m=10.0)
    automaton = cw.MovementAutomaton.plane(speed_mps=1.0)
    library = cw.ReachLibrary.load_or_build(automaton, grid)
    lidar = cw.Lidar("lidar", cw.BeamPattern.per_cell(grid, max_range_m=10.0))
    trees = cw.ObstacleMap(
        [
            cw.Obstacle.ball([9.0, 1.2, 0.0], 1.6, name="left tree"),
            cw.Obstacle.ball([9.0, -3.4, 0.0], 1.6, name="right tree"),
            cw.Obstacle.ball([16.0, -1.0, 0.0], 2.0, name="tree behind the gap"),
        ]
    )
    mission = cw.Mission("gap", cw.State(np.zeros(3)), waypoints_m=np.array([[26.0, 0.0, 0.0]]))

# %% [markdown]
# ## Flown with both
#
# `Planner.of` takes the rating in place of the one that the settings name. Verification stays as
# it is: it holds the chosen trajectory against the evidence itself, so a rating may be careless or
# fearful and the margin is kept all the same. What the rating decides is which ways are considered
# first, and how they are priced.

# %%
if __name__ == "__main__":
    runs = {}
    for name, rating in (("total (clearway's own)", None), ("wary", wary)):
        planner = cw.Planner.of(library, rating=rating)
        system = cw.AvoidanceSystem(planner, mission, lidars=[lidar])
        runs[name] = cw.simulate(system, trees, lidars=[lidar])

    print(
        f"{'rating':<24}{'reached':<9}{'nearest':<10}{'path':<9}{'cells, mean':<13}worst way chosen"
    )
    means = {}
    for name, run in runs.items():
        decisions = [entry.flight.decision for entry in run.decisions]
        seen = [d.cells.rating[d.cells.evidence.seen].mean() for d in decisions]
        means[name] = float(np.mean(seen))
        print(
            f"{name:<24}{'yes' if run.reached else 'NO':<9}"
            f"{run.metrics.min_obstacle_distance_m:.2f} m    {run.metrics.path_length_m:.1f} m   "
            f"{means[name]:<13.3f}{min(d.choice.rating for d in decisions):.3f}"
        )

# %% [markdown]
# ## What the cells look like
#
# The level row of the grid in front of the first decision that sees the trees, from above: the
# wary rating darkens all that lies behind them.

# %%
if __name__ == "__main__":
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        1, 2, figsize=(12, 4.5), subplot_kw={"projection": "polar"}, layout="constrained"
    )
    for ax, (name, run) in zip(axes, runs.items(), strict=True):
        decisions = [entry.flight.decision for entry in run.decisions]
        decision = next(d for d in decisions if d.cells.evidence.detected.max() > 0.3)
        rated = decision.cells.rating.reshape(grid.shape)[:, :, grid.shape[2] // 2]
        mesh = ax.pcolormesh(grid.azimuth_edges_rad, grid.range_edges_m, rated, vmin=0, vmax=1)
        ax.set_thetalim(-np.pi / 4, np.pi / 4)
        ax.set_theta_zero_location("N")
        ax.set_title(f"{name}, at {decision.state.position_m[0]:.0f} m of the way")
    figure.colorbar(mesh, ax=axes, label="rating")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clearway-out/examples")
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "own_rating.png", dpi=100)
    print(f"wrote {folder / 'own_rating.png'}")
