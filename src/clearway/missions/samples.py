"""Mission and scene files of our own making, for `clearway sample`: each shows one thing."""

from __future__ import annotations

MISSION = """\
# Two waypoints, and a ball and a house in the way that no map shows.
[mission]
name = "my-mission"
waypoints_m = [[18, 0, 0], [18, 12, 2]]

[vehicle]
position_m = [0, 0, 0]
speed_mps = 1.0

[safety]
margin_m = 0.6

[[lidar]]
beams_per_cell = [20, 10]
sigma_m = 0.03
dropout = 0.05

[[obstacle]]
name = "ball"
shape = "ball"
position_m = [8, 0.4, 0]
radius_m = 1.5

[[obstacle]]
name = "house"
shape = "cuboid"
position_m = [14, 7, 0]
size_m = [4, 3, 8]

[[intruder]]
name = "KITE"
appears_s = 4
position_m = [16, 8, 0]
velocity_mps = [-0.4, -0.6, 0]
"""
COPTER = """\
# A copter of your own: enter its numbers. A house and a mast are in the way that no map shows.
[mission]
name = "my-copter"
waypoints_m = [[60, 0, 3]]

[vehicle]
kind = "multirotor"
position_m = [0, 0, 3]
speed_mps = 8.0            # the greatest; sight limits it further
acceleration_mps2 = 4.0    # what it brakes with, in the wind that you accept
body_radius_m = 0.3        # the ball that holds it, propellers too

[safety]
margin_m = 0.5             # from its centre: body and errors, see the table below

[rules]
floor_m = 1.5              # it flies no lower, and no higher than ceiling_m
ceiling_m = 12

[[lidar]]
name = "lidar"
field_deg = [360, 50]      # how wide it sees, and how far up and down
spacing_deg = 1            # between beams
max_range_m = 40
sigma_m = 0.02             # noise of its ranges

[[obstacle]]
name = "house"
shape = "cuboid"
position_m = [30, 2, 3]
size_m = [8, 10, 6]

[[obstacle]]
name = "mast"
shape = "ball"
position_m = [45, -1, 3]
radius_m = 0.5
"""
SURVEYED = """\
# Down a lane between two walls and round a house: the survey is what is really there.
[mission]
name = "survey-mission"
waypoints_m = [[24, 0, 3]]

[vehicle]
# A plane would find no room to circle in the lane, and by default leads nowhere without.
kind = "inertialess"
position_m = [-3, 0, 3]

[point_cloud]
file = "survey.laz"
# Neighbours lie half a metre apart; larger balls leave no holes to fly through.
point_radius_m = 0.4
origin_m = [500000, 5500000, 100]

[[lidar]]
beams_per_cell = [20, 10]
sigma_m = 0.03
"""
MAPPED = """\
# Past a mast of the map, out of a zone that is closed, above the terrain.
[mission]
name = "map-mission"
origin_geodetic = [50.0, 8.0, 100]
waypoints_m = [[160, 20, 60]]
reach_radius_m = 15

[vehicle]
position_m = [-140, -20, 60]
speed_mps = 10

[grid]
range_m = 100
layers = 10

[safety]
margin_m = 10

[map]
files = ["masts.csv", "zones-ed318.json"]

[[lidar]]
beams_per_cell = [20, 10]
sigma_m = 0.05
"""
SCENE = """\
# One moment: a scan, a box that only the map knows, and an intruder.
[scan]
file = "sweep.pcd"

[grid]
range_m = 20

[[obstacle]]
name = "box of the map"
shape = "cuboid"
position_m = [9, -3, 0]
size_m = [2, 2, 4]

[[intruder]]
position_m = [16, 4, 0]
velocity_mps = [-1, -0.5, 0]
spread_deg = 5
"""
ROBOT = """\
# The vehicle of a node on ROS 2 topics: a multirotor with a VLP-16.
[mission]
name = "robot"
waypoints_m = [[30, 0, 0]]

[vehicle]
kind = "inertialess"
position_m = [10, 0, 0]
speed_mps = 1.0
body_radius_m = 0.1

[grid]
elevation_deg = 15
rows = 3

[[lidar]]
name = "front"
pattern = "vlp16"
max_range_m = 15
"""
NODE = """\
# Which topics are what.
/**:
  ros__parameters:
    mission: robot-mission.toml
    map_frame: odom
    ground_m: -1.8
    clouds:
      front: {topic: front/points}
"""
GUARDED = f"""{NODE}\
    guard: {{topic: cmd_vel_in, type: Twist, hold_s: 0.5}}
    set_points:
      velocity: {{topic: cmd_vel, type: Twist}}
"""
VOLUMES = """\
[[volume]]
name = "well clear"
radius_m = 600
half_height_m = 75
buffer_m = 75

[[volume]]
name = "near"
radius_m = 150
half_height_m = 30
"""
PLANT = '''\
"""A vehicle of one's own: what truly moves, and the movements it is flown with."""

import numpy as np

import clearway as cw


class Blimp:
    """A blimp that gains speed and turns slowly, and that every wind carries off."""

    movements = staticmethod(
        lambda speed_mps=3.0, duration_s=2.0: cw.MovementAutomaton.inertialess(
            speed_mps, 15.0, duration_s=duration_s, climb_mps=0.5, diagonals=False
        )
    )

    def __init__(self, state, speed_mps, air):
        self.outputs = {}
        self.state, self.air, self.now = np.array(state, dtype=float), air, np.zeros(3)
        self.now[0] = speed_mps

    def begin(self, movement):
        self.asked = np.array([movement.speed_mps, movement.yaw_rate_rps, movement.climb_mps or 0])

    def step(self, duration_s):
        self.now += (self.asked - self.now) * (1.0 - np.exp(-duration_s / 0.4))
        speed, rate, climb = self.now
        air = self.air.step(duration_s, speed, self.state[2], self.state[5])
        yaw = self.state[5] = self.state[5] + rate * duration_s
        way = np.array([speed * np.cos(yaw), speed * np.sin(yaw), climb])
        self.state = np.concatenate([self.state[:3] + (way + air) * duration_s, self.state[3:]])
'''
FLOWN = """\
# That blimp among masts that no map shows. Once it is measured it may fly by what it really does:
# automaton = "blimp.toml" under [vehicle].
[mission]
name = "blimp-mission"
waypoints_m = [[60, 0, 0]]
reach_radius_m = 3

[vehicle]
plant = "own_plant.py:Blimp"
speed_mps = 3
movement_s = 2
body_radius_m = 0.5

[grid]
range_m = 40
layers = 10

[safety]
margin_m = 1.5

[simulation]
wind_mps = [0, 0.3, 0]
gusts_mps = 0.1

[[lidar]]
sigma_m = 0.03

[[obstacle]]
name = "mast"
shape = "line"
position_m = [22, 1, 0]
orientation_deg = [0, 90, 0]
size_m = [40]
radius_m = 0.5

[[obstacle]]
name = "house"
shape = "cuboid"
position_m = [42, -5, 0]
size_m = [6, 8, 30]
"""
