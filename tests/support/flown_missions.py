"""Short flights with everything that a run can hold, flown once for several test files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.sim import Run

SHORT = """
[mission]
name = "short <one>"
waypoints_m = [[8, 0, 0], [16, 2, 0]]

[traffic]
spawn = "world"

[[lidar]]
beams_per_cell = [6, 4]

[[obstacle]]
name = "ball"
shape = "ball"
position_m = [7, -1.5, 0]
radius_m = 1

[[obstacle]]
name = "mast"
known = "both"
shape = "line"
position_m = [12, 4, 0]
orientation_deg = [0, 90, 0]
size_m = [6]
radius_m = 0.2

[[obstacle]]
name = "zone"
known = "map"
shape = "cuboid"
position_m = [12, -5, 0]
size_m = [3, 3, 3]

[[obstacle]]
name = "wall"
known = "both"
shape = "plane"
position_m = [20, 6, 0]
orientation_deg = [0, 90, 20]
size_m = [4, 3]
radius_m = 0.1

[[keep_out]]
name = "school"
shape = "cuboid"
position_m = [4, 14, 0]
size_m = [4, 4, 8]

[[intruder]]
name = "crossing"
appears_s = 3
position_m = [12, 7, 0]
velocity_mps = [0, -0.8, 0.1]
spread_deg = [5, 5]
radius_m = 0.5
"""


@dataclass(frozen=True)
class Flown:
    file: MissionFile
    setup: FlightSetup
    run: Run


@cache
def flown(text: str = SHORT) -> Flown:
    """A mission's text, flown by clearway."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "mission.toml"
        path.write_text(text)
        file = read_mission_file(path)
    setup = prepare(file)
    return Flown(file, setup, setup.fly())


def written_run(folder: Path) -> Path:
    """The short mission's run as one MCAP file in a folder."""
    from clearway.io.toml_writing import dump_toml
    from clearway.view.replay.writing import write_mcap

    short, path = flown(), folder / "run.mcap"
    write_mcap(short.run, short.setup, dump_toml(short.file.effective()), path)
    return path
