# %% [markdown]
# # Bring your own planner
#
# To compare a method of your own with clearway, only the decision has to be written: a *rule* that
# is told what is known and answers what to fly next. Sensing, memory, mission, simulator and
# measures are the same for all, so that what differs is the rule.
#
# Run it as a script, `python examples/own_planner.py [folder]`, or cell by cell in an editor that
# knows `# %%`.

# %%
import sys
from pathlib import Path

import numpy as np

import clearway as cw
from clearway.live.mission import Mode
from clearway.sim.baselines import BaselinePilot, Craft, Manoeuvre, ManoeuvreRule

# %% [markdown]
# ## The rule
#
# What is known is a `Situation`: the own state, the waypoint, the returns that are remembered
# (world frame), the map, intruders. The answer is a `Manoeuvre`: movements of the automaton by
# name, at least one, and the reason. The rule is asked anew after every movement.
#
# This one steers for the waypoint, unless a return lies in a tunnel ahead: then it turns away from
# the side where most of them are. It is a beginner's method on purpose.

# %%
AHEAD_M, WIDE_M = 5.0, 1.3


def swerve(situation: cw.Situation, before: Manoeuvre | None) -> Manoeuvre:
    """Turn away from what is ahead, else to the waypoint."""
    state = situation.state
    seen = np.zeros((0, 3)) if situation.remembered is None else situation.remembered.position_m
    place = (seen - state.position_m) @ state.world_from_body  # body frame: forward, left, up
    tunnel = (place[:, 0] > 0.0) & (place[:, 0] < AHEAD_M)
    tunnel &= np.hypot(place[:, 1], place[:, 2]) < WIDE_M
    if tunnel.any():
        # Keep turning the way that was begun, or the rule dithers in front of every trunk.
        going_on = before is not None and before.mode is Mode.AVOIDANCE
        side = before.movements[0] if before is not None and going_on else None
        side = side or ("Right" if place[tunnel, 1].mean() > 0.0 else "Left")
        return Manoeuvre((side,), f"{tunnel.sum()} returns ahead", Mode.AVOIDANCE)
    ahead, left, _ = (situation.target_m - state.position_m) @ state.world_from_body
    bearing = np.degrees(np.arctan2(left, ahead))
    if abs(bearing) < 10.0:
        return Manoeuvre(("Straight",), "towards the waypoint")
    return Manoeuvre(("Left" if bearing > 0.0 else "Right",), f"waypoint at {bearing:.0f} deg")


# %% [markdown]
# ## Beside clearway's own planners
#
# Every command that takes planners by name takes `module:name` too, with a function that makes the
# rule for a vehicle: its movements, its grid, its margin are known before take-off. It is called
# for every flight, so that a rule may remember.
#
#     cd examples
#     clearway compare forest --planners clearway,own_planner:make --seeds 3
#     clearway fly static-obstacles --planner own_planner:make
#     clearway encounters --planners own_planner:make --count 100
#     clearway risk --planners own_planner:make --count 100
#
# In a campaign file it is one of `planners = ["clearway", "own_planner:make"]`.


# %%
def make(craft: Craft) -> ManoeuvreRule:
    """The rule is the same for every vehicle."""
    del craft
    return swerve


# %% [markdown]
# ## The same world for both
#
# A wood of trunks that no map shows, from a seed. `BaselinePilot` takes clearway's own sensing and
# mission control, and the rule.

# %%
if __name__ == "__main__":
    rng = np.random.default_rng(3)
    places = np.column_stack([rng.uniform(8.0, 50.0, 22), rng.uniform(-8.0, 8.0, 22)])
    wood = cw.ObstacleMap(
        [cw.Obstacle.cuboid([x, y, 0.0], [1.0, 1.0, 40.0], name="trunk") for x, y in places]
    )
    grid = cw.AvoidanceGrid.uniform(range_m=10.0)
    library = cw.ReachLibrary.load_or_build(cw.MovementAutomaton.plane(speed_mps=1.0), grid)
    planner = cw.Planner.of(library)
    lidar = cw.Lidar("lidar", cw.BeamPattern.per_cell(grid, max_range_m=10.0), sigma_m=0.02)
    mission = cw.Mission("wood", cw.State(np.zeros(3)), waypoints_m=np.array([[60.0, 0.0, 0.0]]))
    limits = cw.SimulationSettings(seed=1, time_limit_s=200.0)

    def system() -> cw.AvoidanceSystem:
        """Fresh for every flight."""
        return cw.AvoidanceSystem(planner, mission, lidars=[lidar])

    runs = {}
    for name, pilot in (("clearway", system()), ("swerve", BaselinePilot(system(), swerve))):
        runs[name] = cw.simulate(pilot, wood, lidars=[lidar], settings=limits)

    print(f"{'planner':<12}{'reached':<9}{'nearest':<10}{'violations':<12}{'crashed':<9}path")
    for name, run in runs.items():
        print(
            f"{name:<12}{'yes' if run.reached else 'NO':<9}"
            f"{run.metrics.min_obstacle_distance_m:.2f} m    {run.metrics.margin_violations:<12}"
            f"{'YES' if run.crashed_s else 'no':<9}{run.metrics.path_length_m:.1f} m"
        )
    for entry in runs["swerve"].decisions[:3]:
        flight = entry.flight
        print(f"  {flight.time_s:.0f} s {flight.movements[0]}: {flight.explanation}")

# %% [markdown]
# ## Both from above
#
# `clearway compare` does this for any planners on any mission.

# %%
if __name__ == "__main__":
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(12, 3.8), layout="constrained")
    for x, y in places:
        axes.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1.0, 1.0, color="tab:brown"))
    for (name, run), colour in zip(runs.items(), ("tab:blue", "tab:orange"), strict=True):
        axes.plot(run.states[:, 0], run.states[:, 1], color=colour, label=name)
    axes.plot(*mission.waypoints_m[-1][:2], "s", color="tab:green", label="waypoint")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_aspect("equal")
    axes.legend()
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clearway-out/examples")
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "own_planner.png", dpi=100)
    print(f"wrote {folder / 'own_planner.png'}")
