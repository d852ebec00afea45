"""Every numbered equation and definition of the paper, and why some have no place in the code.

The paper itself is not part of the repository; its numbers and what they are about are listed here.
"""

from __future__ import annotations

EQUATIONS = """
3.1 continuous-time system
3.2 controlled system x' = f(t, x, u)
3.3 discrete-time system
3.4 reach set starting at a point
3.5 reach set starting at a set
3.6 reach set under adversarial behaviour
3.7 reach set under state constraints
3.8 ball
3.9 spherical coating
3.10 hybrid automaton
3.11 trajectory primitive
3.12 trajectory as a sequence of primitives
3.13 trajectory equivalence
3.14 movement primitive
3.15 movement automaton: movements, input evolution, transitions, buffer
3.16 ball of the prediction's deviation
3.17 chained input of a movement buffer
3.18 squared deviation V(t)
3.19 its derivative
3.20 system with state and input noise
3.21 predicted system
3.22 deviation's rate by noise alone
3.23 bound of state noise
3.24 input noise, movement by movement
3.25 its sum over the buffer
3.26 bound of input noise
3.27 bound rho of the deviation's rate
3.28 bound rho (t - t0) of the deviation
3.29 tracking problem of a waypoint
3.30 Lyapunov function
3.31 its derivative
3.32 scanned point
3.33 accessible space
3.34 rotation by roll
3.35 rotation by pitch
3.36 rotation by yaw
3.37 rotation body to world
3.38 reset at gimbal lock
3.39 level distance of a planar point
3.40 its z
3.41 its y
3.42 its x
3.43 distance of a Cartesian point
3.44 its level distance
3.45 its azimuth
3.46 its elevation
3.47 global position of a planar obstacle
3.48 local position of a global point
3.49 metric tensor of a sphere
3.50 Lagrange's identity
3.51 area element from E, F, G
3.52 tangent vectors
3.53 E, F and G
3.54 area element r^2 cos(el)
4.1 state vector
4.2 input vector
4.3 velocity distribution
4.4 simple plane model
4.5 step time equals movement time
4.6 optimal control problem
4.7 predictor: state and assessed grid to states and movements
4.8 discrete system driven by a movement chain
4.9 inverse movement interpretation
4.10 disturbed prediction
4.11 marginal error
4.12 chaining after corrections
4.13 state in discrete time
4.14 rotated table displacement
4.15 state after a table movement
4.16 recursive prediction
4.17 obstacle probability of a cell
4.18 cell of the avoidance grid
4.19 inputs and initialisation of the general algorithm
4.20 general algorithm
4.21 passing cells of a trajectory
4.22 reachability of a trajectory
4.23 reachability of a cell
4.24 trajectory bounded by the grid
4.25 membership function Q
4.26 set of footprints
4.27 coverage ratio
4.28 smoothness
4.29 simple expansion of a node
4.30 chaotic criterion
4.31 harmonic criterion
5.1 intruder model
5.2 trajectory in a cell, with times
5.3 cell entry time of the vehicle
5.4 cell leave time of the vehicle
5.5 timed intersection probability
5.6 the same by counting hits
5.7 intruder line
5.8 line in planar coordinates
5.9 simple line intersection
5.10 intruder line of the body model
5.11 body ball
5.12 body ball in planar coordinates
5.13 body intersection
5.14 axis of the spread's cone
5.15 plane across the axis
5.16 semi-axes of the ellipse
5.17 ellipse of the spread
5.18 normal density, horizontal
5.19 normal density, vertical
5.20 density in the ellipse
5.21 density integrates to one
5.22 probability of a cell at one time
5.23 spread intersection
5.24 lattice of numbers
5.25 lattice plane across the axis
5.26 lattice points in the ellipse
5.27 lattice planes do not meet
5.28 the centre where no lattice point lies inside
5.29 lattice probabilities sum to one
5.30 lattice probability of a cell at one time
5.31 its mean over the time in the cell
5.32 lattice points in a cell over all times
5.33 entry time of the spread
5.34 leave time of the spread
5.35 probabilities of the three models
5.36 combined, timed or not
5.37 several intruders
5.38 several sensors
5.39 beams through a cell's column
5.40 hits in a cell
5.41 detected obstacle probability
5.42 hindrance
5.43 surface of a cell's patch
5.44 the same in closed form
5.45 expected hits of a surface
5.46 row of cells from the vehicle
5.47 visibility
5.48 hindrance of a row sums to at most one
5.49 map obstacles
5.50 map obstacles in the grid
5.51 map obstacles in a cell
5.52 share of a cell that one obstacle fills
5.53 share that all fill
5.54 map obstacle probability
6.1 waypoints
6.2 movements decided at one time
6.3 movements flown
6.4 count of nodes, bounded
6.5 count of nodes of a selection
6.6 the same for the standard grid
6.7 share of the full reach set's nodes
6.8 timed line model of the mission
6.9 body volume in a cell
6.10 its maximum over time
6.11 tube around an intruder at one time
6.12 tube along its way
6.13 tracking deviation
6.14 crash margin
6.15 avoidance margin
6.16 safety margin of an intruder
6.17 positions of intruders at a time
6.18 closest intruder
6.19 collision distance
"""

DEFINITIONS = """
1 reach set starting at a given point
2 reach set starting at a given set
3 reach set under adversarial behaviour
4 reach set under state constraints
5 unit ball
6 spherical coating
7 hybrid automaton
8 trajectory primitive
9 trajectory equivalence
10 movement primitive
11 movement
12 movement automaton
13 prediction stability
14 scanned point and point cloud
15 accessible space
16 global coordinate system
17 local coordinate system
18 global position of a planar obstacle
19 local position of a global coordinate
20 reachability of a trajectory
21 reachability of a cell
22 trajectory footprint
23 footprint set
24 coverage ratio
25 smoothness of a trajectory
"""

WITHOUT_COUNTERPART = {
    "(3.18)": "a step of the proof of def. 13; the bound it leads to, (3.28), is computed directly",
    "(3.19)": "a step of the proof of def. 13, as (3.18)",
    "(4.5)": "not needed: movements may have durations of their own",
    "(5.27)": "a property, not a computation: planes across one axis at different distances "
    "never meet",
    "(6.6)": "(6.5) with the numbers of the standard grid put in",
}


def titles() -> dict[str, str]:
    """What each tag is about, by tag: "(3.1)" to "(6.19)", then "def. 1" to "def. 25"."""
    found = {}
    for line in EQUATIONS.split("\n"):
        number, _, title = line.partition(" ")
        if number:
            found[f"({number})"] = title
    for line in DEFINITIONS.split("\n"):
        number, _, title = line.partition(" ")
        if number:
            found[f"def. {number}"] = title
    return found
