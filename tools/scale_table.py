"""What suits a vehicle where a file leaves it out, for the reference: figures by the function."""

from __future__ import annotations

from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import MEMORY_REACH, Scale, movement_s, scale_of, voxel_m

SPEEDS_MPS = (1.0, 5.0, 15.0)
TURN_STEP_DEG = 15.0
PROSE = """
### What suits the vehicle

Four keys follow from the vehicle where a mission, a flight plan or a scene leaves them out. One
rule serves all of them, so links to a vehicle too. `clearway` prints the values that it chose, and
the `mission.toml` of the run states them. Keys that are given win.

A *movement* is what a plane, or an inertialess vehicle, flies in `movement_s`. A multirotor
brakes, and its tube grows with its speed, so its margin and reach radius need not.

| key | plane | multirotor |
| --- | --- | --- |
| `vehicle.movement_s` | 1 s, or longer for a bank of 30 degrees | by acceleration |
| `grid.range_m` | 10 movements, or 2.6 turning radii where that is more | 2 stopping distances |
| `safety.margin_m` | 0.4 movements | 0.6 m |
| `mission.reach_radius_m` | 1.5 movements, or 0.39 turning radii where that is more | 1.5 m |
| voxels of free space | 5/12 of the margin, within a 60th and a 40th of the range | as a plane |
| memory of returns | 1.5 ranges, in voxels of a fifth of the margin | as a plane |

None of them is less than at 1 m/s. Where every sensor states its range, `grid.range_m` is no
longer than the longest, unless turning or stopping needs more. The reach radius is no larger than
the least distance between two waypoints. An inertialess vehicle needs no room to turn; the rest is
as for a plane. A scene has movements of 1 s, and follows this rule where it states a speed. With
the default turns and accelerations:

"""


def scale_section() -> str:
    """The section: what the rule is, and what it gives at some speeds."""
    kinds = [("plane", _plane(v)) for v in SPEEDS_MPS]
    kinds += [("multirotor", MovementAutomaton.multirotor(v)) for v in SPEEDS_MPS]
    head = "| vehicle | movement | range | margin | reach radius | voxels | memory |"
    lines = [head, "| --- |" + " ---: |" * 6]
    for kind, automaton in kinds:
        lines.append(_row(kind, automaton, scale_of(automaton)))
    return PROSE + "\n".join(lines) + "\n"


def _plane(speed_mps: float) -> MovementAutomaton:
    lasts_s = movement_s(speed_mps, TURN_STEP_DEG)
    return MovementAutomaton.plane(speed_mps, TURN_STEP_DEG, duration_s=lasts_s)


def _row(kind: str, automaton: MovementAutomaton, scale: Scale) -> str:
    lengths = (
        scale.range_m,
        scale.margin_m,
        scale.reach_radius_m,
        voxel_m(scale.margin_m, scale.range_m),
        MEMORY_REACH * scale.range_m,
    )
    told = [f"{automaton.movements[0].duration_s:.3g} s", *(f"{one:.3g} m" for one in lengths)]
    return f"| {kind}, {automaton.fastest_mps:g} m/s | {' | '.join(told)} |"
