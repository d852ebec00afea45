import time

import numpy as np

import clearway as cw

beams = cw.BeamPattern.from_angles(np.radians(range(-45, 46)), [0.0], max_range_m=10.0)
sonar = cw.Lidar("sonar", beams, sigma_m=0.02)
trunk = cw.ObstacleMap([cw.Obstacle.ball([7.0, 0.3, 0.0], radius_m=1.0)])  # what there is to see
automaton = cw.MovementAutomaton.plane(speed_mps=1.0, pitch_limit_deg=0.0)
library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform(range_m=10.0))
mission = cw.Mission("live", cw.State(np.zeros(3)), waypoints_m=np.array([[14.0, 0.0, 0.0]]))
system = cw.AvoidanceSystem(cw.Planner.of(library), mission, lidars=[sonar])
start = time.monotonic()
while not system.progress.is_done(mission):
    now = time.monotonic() - start
    own = system.state_at(now) or mission.start  # your own navigation
    ranges = trunk.cast(own.position_m, beams.directions @ own.world_from_body.T, 10.0)  # your own
    system.update(cw.State(own.position_m, own.attitude_rad, time_s=now))
    points = beams.directions[ranges < 10.0] * ranges[ranges < 10.0, None]
    system.update(cw.Scan(points, now, sensor="sonar"))
    if system.due(now):
        print(f"{now:5.1f} s  {system.decide(now).explanation}")
    print(system.movement_at(now), flush=True)  # to your own autopilot
    time.sleep(max(0.0, start + now + 0.1 - time.monotonic()))
