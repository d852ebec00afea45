# %% [markdown]
# # Bring your own vehicle
#
# clearway knows a vehicle by its *movement automaton*: a few movements of constant input, and what
# predicts where they lead. The plane of the paper flies as fast uphill as downhill. This one does
# not: it slows down when it climbs, as most do. All that is needed is one method.
#
# Run it as a script, `python examples/own_vehicle.py [folder]`, or cell by cell in an editor that
# knows `# %%`.

# %%
import sys
from pathlib import Path

import matplotlib
import numpy as np
import numpy.typing as npt

import clearway as cw
from clearway.vehicle.automaton import Movement

matplotlib.use("agg")
import matplotlib.pyplot as plt

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "clearway-out/examples")
folder.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## The vehicle
#
# `advance` takes a state (x, y, z, roll, pitch, yaw), inputs that are held (speed, roll rate,
# pitch rate, yaw rate) and a duration, and returns the state afterwards: metres, seconds, radians,
# z up, pitch positive nose down, yaw positive left. Reach sets are built once and turned with the
# vehicle, so the motion must depend neither on place nor on yaw.


# %%
class Climber:
    """A small aircraft that climbs at 1 - 2/3 sin(climb) of its speed, and dives faster."""

    LOSS = 2.0 / 3.0
    STEPS = 20

    def advance(self, state: npt.ArrayLike, inputs: npt.ArrayLike, duration_s: float) -> np.ndarray:
        x, y, z, roll, pitch, yaw = np.asarray(state, dtype=float)
        speed, roll_rate, pitch_rate, yaw_rate = np.asarray(inputs, dtype=float)
        step = duration_s / self.STEPS
        for _ in range(self.STEPS):  # the middle of each step: second order
            middle_pitch, middle_yaw = pitch + 0.5 * step * pitch_rate, yaw + 0.5 * step * yaw_rate
            along = speed * (1.0 + self.LOSS * np.sin(middle_pitch)) * step
            x += along * np.cos(middle_pitch) * np.cos(middle_yaw)
            y += along * np.cos(middle_pitch) * np.sin(middle_yaw)
            z -= along * np.sin(middle_pitch)
            roll, pitch, yaw = (
                roll + step * roll_rate,
                pitch + step * pitch_rate,
                yaw + step * yaw_rate,
            )
        return np.array([x, y, z, roll, pitch, yaw])


# %% [markdown]
# ## Its movements
#
# Straight, a wide and a tight turn to either side, up and down. A movement has constant inputs and
# a duration; `smooth` marks those that cost nothing extra.

# %%
SPEED = 2.0


def turn(name: str, yaw_deg: float = 0.0, pitch_deg: float = 0.0) -> Movement:
    """One second of turning, by so much."""
    return Movement(
        name, SPEED, pitch_rate_rps=np.radians(pitch_deg), yaw_rate_rps=np.radians(yaw_deg)
    )


movements = (
    Movement("Straight", SPEED, smooth=True),
    turn("Left", 10.0),
    turn("Right", -10.0),
    turn("Hard-Left", 25.0),
    turn("Hard-Right", -25.0),
    turn("Up", pitch_deg=-10.0),
    turn("Down", pitch_deg=10.0),
)
limit = float(np.radians(20.0))
own = cw.MovementAutomaton(movements, pitch_limit_rad=limit, vehicle=Climber())
plane = cw.MovementAutomaton(movements, pitch_limit_rad=limit)

# %% [markdown]
# ## Its reach sets, and a flight
#
# Reach sets are built for the automaton and kept for the next time. How many movements deep they
# go follows from the speed of the movements; climbing takes this vehicle more of them to the end
# of the grid, so it is said here. Then everything works as it does for the plane: up a cliff that
# the map shows, for instance.

# %%
grid = cw.AvoidanceGrid.uniform(range_m=30.0)
cliff = cw.ObstacleMap([cw.Obstacle.cuboid([55.0, 0.0, -7.0], [40.0, 200.0, 26.0], name="cliff")])
goals = np.array([[45.0, 0.0, 10.0], [75.0, 0.0, 10.0]])
mission = cw.Mission("up a cliff", cw.State(np.zeros(3)), waypoints_m=goals, reach_radius_m=3.0)
settings = cw.AvoidanceSettings(safety_margin_m=1.0, escape="off")
DEEP = {"depth": 20}
runs, sets = {}, {}
for name, automaton in (("plane (4.4)", plane), ("climber", own)):
    library = cw.ReachLibrary.load_or_build(automaton, grid, tuning=DEEP)
    planner = cw.Planner.of(library, settings)
    sets[name] = library.nearest(0.0)
    system = cw.AvoidanceSystem(planner, mission, obstacle_map=cliff)
    runs[name] = cw.simulate(system, cliff, lidars=[])

print(f"{'vehicle':<14}{'trajectories':<14}{'reached':<9}{'nearest':<10}{'time':<9}path")
for name, run in runs.items():
    print(
        f"{name:<14}{len(sets[name].trajectories):<14}{'yes' if run.reached else 'NO':<9}"
        f"{run.metrics.min_obstacle_distance_m:.2f} m    {run.metrics.time_s:.1f} s   "
        f"{run.metrics.path_length_m:.1f} m"
    )

# %% [markdown]
# ## Both seen from the side
#
# The climber is slower uphill, so its movements up are shorter and it begins to climb as it can.

# %%
figure, axes = plt.subplots(figsize=(11, 2.8), layout="constrained")
for (name, run), colour in zip(runs.items(), ("tab:gray", "tab:blue"), strict=True):
    axes.plot(run.states[:, 0], run.states[:, 2], color=colour, label=name)
    whole = [int(np.searchsorted(run.time_s, t)) for t in np.arange(0.0, run.time_s[-1], 5.0)]
    axes.plot(run.states[whole, 0], run.states[whole, 2], "o", color=colour, markersize=4)
axes.add_patch(plt.Rectangle((35.0, -2.0), 40.0, 8.0, color="tab:brown", alpha=0.5))
axes.plot(goals[:, 0], goals[:, 2], "s", color="tab:green", label="waypoints")
axes.set_xlabel("x (m)")
axes.set_ylabel("z (m)")
axes.set_aspect("equal")
axes.set_title("a dot every 5 s")
axes.legend()
figure.savefig(folder / "own_vehicle.png", dpi=100)
print(f"wrote {folder / 'own_vehicle.png'}")
