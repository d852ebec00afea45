"""Encounters flown by ORCA of pyrvo; run by the peers' Python, never imported by clearway.

    python fly_orca.py courses.json tracks.json

Two variants: "orca" moves as the library has it, with any velocity up to the own speed from one
step to the next; "orca, turning" keeps the speed and turns towards that velocity no faster than
the automaton does. The intruder flies straight and avoids nobody, though ORCA counts on every
agent doing half of the work: it asks again in every step, and gets the other half then.
"""

import json
import math
import sys

import pyrvo

STEP_S = 0.05
HORIZON_S = 10.0
SPARE = 1.05
"""Of the distance to keep; split between the radii of both agents."""


def fly(course, keep, turn_rps, limited):
    """[n, 5] time and both positions."""
    radius = 0.5 * SPARE * keep
    sim = pyrvo.RVOSimulator(STEP_S, 100.0, 5, HORIZON_S, HORIZON_S, radius, 1.0)
    own = sim.add_agent((0.0, 0.0))
    other = sim.add_agent(tuple(course["position"]))
    # Without neighbours an agent avoids nobody.
    sim.set_agent_max_neighbors(other, 0)
    sim.set_agent_max_speed(other, 2.0)
    sim.set_agent_velocity(own, (1.0, 0.0))
    sim.set_agent_velocity(other, tuple(course["velocity"]))
    heading, place = 0.0, [0.0, 0.0]
    rows = [[0.0, 0.0, 0.0, *course["position"]]]
    for step in range(1, math.ceil(course["lasts_s"] / STEP_S) + 1):
        # Towards a far point on the first course, as the others fly to a far waypoint.
        ahead = (1e4 - place[0], -place[1])
        length = math.hypot(*ahead)
        sim.set_agent_pref_velocity(own, (ahead[0] / length, ahead[1] / length))
        sim.set_agent_pref_velocity(other, tuple(course["velocity"]))
        sim.do_step()
        velocity = _pair(sim.get_agent_velocity(own))
        if limited:
            if math.hypot(*velocity) > 1e-9:
                wished = math.atan2(velocity[1], velocity[0])
                off = math.remainder(wished - heading, 2.0 * math.pi)
                heading += max(-turn_rps * STEP_S, min(turn_rps * STEP_S, off))
            velocity = (math.cos(heading), math.sin(heading))
            sim.set_agent_velocity(own, velocity)
        place = [place[0] + STEP_S * velocity[0], place[1] + STEP_S * velocity[1]]
        sim.set_agent_position(own, tuple(place))
        there = _pair(sim.get_agent_position(other))
        rows.append([step * STEP_S, *place, *there])
    return rows


def _pair(vector):
    return (vector.x, vector.y) if hasattr(vector, "x") else tuple(vector)


def main():
    courses, out = sys.argv[1:]
    with open(courses, encoding="utf-8") as file:
        given = json.load(file)
    flown = {
        name: [fly(course, given["keep_m"], given["turn_rps"], limited)
               for course in given["courses"]]
        for name, limited in (("orca", False), ("orca, turning", True))
    }  # fmt: skip
    with open(out, "w", encoding="utf-8") as file:
        json.dump(flown, file)


if __name__ == "__main__":
    main()
