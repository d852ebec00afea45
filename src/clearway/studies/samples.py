"""What `clearway sample` writes: one small input of our own making in every format, by name.

Each has the command that takes it. Every sample is drawn from the seed and its own name, so that
one more changes none of the others.
"""

from __future__ import annotations

import shutil
import zlib
from collections.abc import Callable, Sequence
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.io.results_folder import ResultsFolder
from clearway.io.samples import (
    dataflash,
    gis,
    maps,
    mode_s,
    packets,
    plans,
    radio,
    recordings,
    scans,
    telemetry,
    traffic,
    ulog,
)
from clearway.missions import samples as own

Write = Callable[[Path, np.random.Generator], None]
PACKAGES = {
    "adsb": ("rs1090",),
    "foxglove": ("foxglove", "mcap"),
    "lidar": ("laspy", "rosbags", "mcap", "lzf"),
    "map": ("rasterio", "shapely", "pyproj", "osmium", "shapefile"),
    "mavlink": ("pymavlink",),
    "ouster": ("ouster",),
    "parquet": ("pyarrow",),
    "ros2": ("cyclonedds", "rosbags"),
    "ulog": ("pyulog",),
}
"""Of an extra: modules without which neither writer nor reader works."""


class Sample(NamedTuple):
    """One file or folder, and the command that takes it."""

    name: str
    kind: str
    about: str
    write: Write
    command: str
    """As typed in the folder of the samples; empty for what lies beside another."""
    needs: str = ""
    """Extra of the command, and of the writer."""

    @property
    def lacks(self) -> bool:
        """Whether the packages that it needs are not there."""
        return any(find_spec(name) is None for name in PACKAGES.get(self.needs, ()))


def _text(content: str) -> Write:
    """A writer of a file that no seed changes."""

    def write(path: Path, rng: np.random.Generator) -> None:
        del rng
        path.write_text(content)

    return write


def _model(path: Path, rng: np.random.Generator) -> None:
    """An encounter model in the text format of MIT Lincoln Laboratory; its numbers are made up."""
    del rng
    shipped = resources.files("clearway.studies") / "encounter_model" / "made-up.txt"
    path.write_text(shipped.read_text(encoding="utf-8"))


def _examples(folder: Path, rng: np.random.Generator) -> None:
    """What the documentation calls examples/: in a checkout at its top, in a wheel beside this."""
    del rng
    shipped = Path(__file__).with_name("examples")
    top = shipped if shipped.is_dir() else Path(__file__).parents[3] / "examples"
    shutil.copytree(top, folder, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))


CAMPAIGN = """\
# Two families of cases, flown by two planners, two seeds each.
name = "mine"
planners = ["clearway", "straight"]
seeds = 2

[[family]]
family = "forest"

[[family]]
family = "place"
label = "my-mission"
parameters = { mission = "my-mission.toml" }
"""
PLANNER = '''\
"""A planner of one's own, to begin with: to the waypoint, whatever is in the way."""

import numpy as np

import clearway as cw
from clearway.sim.baselines import Manoeuvre


def make(craft):
    """The rule for a vehicle, made once for each flight."""

    def rule(situation: cw.Situation, before: Manoeuvre | None) -> Manoeuvre:
        state = situation.state
        ahead, left, _ = (situation.target_m - state.position_m) @ state.world_from_body
        bearing = np.degrees(np.arctan2(left, ahead))
        if abs(bearing) < 10.0:
            return Manoeuvre(("Straight",), "towards the waypoint")
        return Manoeuvre(("Left" if bearing > 0.0 else "Right",), f"it is at {bearing:.0f} deg")

    return rule
'''


def _scan(name: str, about: str, write: Write, needs: str = "", more: str = "") -> Sample:
    command = f"clearway assess --scan {name} --range 20{more}"
    return Sample(name, "scan", about, write, command, needs)


def _traffic(name: str, about: str, write: Write, needs: str = "") -> Sample:
    return Sample(name, "traffic", about, write, f"clearway traffic {name}", needs)


def _map(name: str, about: str, write: Write, more: str = "") -> Sample:
    return Sample(name, "map", about, write, f"clearway map {name}{more}", "map")


POSED = "clearway assess --scan velodyne --poses {} --all"
SAMPLES = (
    Sample("my-mission.toml", "mission", "obstacles, an intruder, a LiDAR", _text(own.MISSION),
           "clearway fly my-mission.toml"),
    Sample("my-copter.toml", "mission", "a copter with inertia, to enter your own numbers",
           _text(own.COPTER), "clearway fly my-copter.toml"),
    Sample("my-scene.toml", "scene", "one moment: scan, map, intruder", _text(own.SCENE),
           "clearway assess my-scene.toml"),
    _scan("sweep.pcd", "PCD, binary", scans.write_pcd),
    _scan("sweep-text.pcd", "PCD, text", scans.write_pcd_text),
    _scan("sweep-packed.pcd", "PCD, compressed", scans.write_pcd_packed, "lidar"),
    _scan("sweep.ply", "PLY, binary", scans.write_ply),
    _scan("sweep.csv", "table of points", scans.write_table),
    _scan("sweep.npy", "NumPy array", scans.write_npy),
    Sample("velodyne", "scans", "folder of KITTI scans with their times", scans.write_folder,
           "clearway assess --scan velodyne --all"),
    Sample("poses.txt", "poses", "KITTI, of a camera", scans.write_kitti_poses,
           POSED.format("poses.txt")),
    Sample("calib.txt", "poses", "where the LiDAR of those poses is", scans.write_calibration, ""),
    Sample("way.txt", "poses", "TUM", scans.write_tum_poses, POSED.format("way.txt")),
    Sample("way.csv", "poses", "table", scans.write_table_poses, POSED.format("way.csv")),
    Sample("flight.mcap", "recording", "MCAP of ROS 2 messages, with odometry and own legs in view",
           recordings.write_mcap_sample,
           "clearway assess --scan flight.mcap --all --airframe-radius 0.5", "lidar"),
    Sample("flight.bag", "recording", "ROS 1 bag", recordings.write_bag,
           "clearway assess --scan flight.bag --at 1.5s --airframe-radius 0.5", "lidar"),
    Sample("flight", "recording", "folder of a ROS 2 bag", recordings.write_bag2,
           "clearway assess --scan flight --topic /front/points --airframe-radius 0.5", "lidar"),
    Sample("packed", "recording", "folder of a ROS 2 bag whose file is packed by zstd",
           recordings.write_bag2_packed,
           "clearway assess --scan packed --airframe-radius 0.5", "lidar"),
    Sample("packed-messages", "recording", "folder of a ROS 2 bag, its messages packed one by one",
           recordings.write_bag2_messages,
           "clearway assess --scan packed-messages --airframe-radius 0.5", "lidar"),
    Sample("livox.bag", "recording", "ROS 1 bag of Livox's CustomMsg", recordings.write_livox,
           "clearway assess --scan livox.bag --airframe-radius 0.5", "lidar"),
    Sample("livox", "recording", "ROS 2 bag of Livox's CustomMsg", recordings.write_livox2,
           "clearway assess --scan livox --airframe-radius 0.5", "lidar"),
    Sample("robot-mission.toml", "mission", "vehicle and sensor of a robot on ROS 2 topics",
           _text(own.ROBOT), ""),
    Sample("commanded", "recording", "ROS 2 bag of a robot that somebody flies at a house",
           recordings.write_commanded, "", "ros2"),
    Sample("robot.yaml", "parameters", "of a node on ROS 2 topics",
           _text(own.NODE), "clearway ros2 robot.yaml --bag commanded", "ros2"),
    Sample("guarded.yaml", "parameters", "of a guardian of those commands",
           _text(own.GUARDED), "clearway guard guarded.yaml --bag commanded", "ros2"),
    Sample("os1.json", "recording", "metadata of the packets", packets.write_metadata, "",
           "ouster"),
    Sample("os1.pcap", "recording", "packets of an Ouster LiDAR", packets.write_packets,
           "clearway assess --scan os1.pcap --range 20", "ouster"),
    _scan("sweep.las", "LAS", scans.write_las, "lidar"),
    _scan("sweep.laz", "LAZ", scans.write_las, "lidar"),
    Sample("survey.laz", "survey", "LAZ, the world of survey-mission.toml", scans.write_survey,
           "clearway fly survey-mission.toml", "lidar"),
    Sample("survey-mission.toml", "mission", "through that survey", _text(own.SURVEYED), "",
           "lidar"),
    Sample("log.ulg", "traffic", "log of PX4: own track, and aircraft received", ulog.write_ulog,
           "clearway traffic log.ulg", "ulog"),
    Sample("flight.tlog", "traffic", "telemetry log of MAVLink", telemetry.write_telemetry,
           "clearway traffic flight.tlog", "mavlink"),
    Sample("copter.bin", "traffic", "DataFlash log of ArduPilot", dataflash.write_dataflash,
           "clearway traffic copter.bin", "mavlink"),
    _traffic("tablet.gdl90", "GDL 90, the own aircraft and another", radio.write_gdl90),
    _traffic("gliders.txt", "Open Glider Network (APRS lines)", radio.write_ogn),
    _traffic("day.jsonl.gz", "readsb aircraft, one a line, gzip", traffic.write_readsb_lines),
    _traffic("aircraft.json", "readsb snapshots", traffic.write_readsb),
    _traffic("trace.json", "readsb trace of one aircraft", traffic.write_trace),
    _traffic("states.jsonl", "OpenSky states (JSON)", traffic.write_states),
    _traffic("states.csv", "OpenSky states (CSV)", traffic.write_states_table),
    _traffic("trajectories.json", "the `traffic` library", traffic.write_trajectories),
    _traffic("traffic.json", "its to_json(), by column", traffic.write_trajectory_columns),
    _traffic("basestation.txt", "BaseStation lines", traffic.write_basestation),
    _traffic("encounter.daa", "DAIDALUS scenario", traffic.write_daidalus),
    _traffic("encounter.scn", "BlueSky script", traffic.write_bluesky),
    _traffic("messages.csv", "Mode S, times and hex", mode_s.write_hex, "adsb"),
    _traffic("messages.avr", "Mode S, AVR with ticks", mode_s.write_avr, "adsb"),
    _traffic("messages.bin", "Mode S, Beast", mode_s.write_beast, "adsb"),
    _traffic("frames.jsonl", "Mode S, jet1090", mode_s.write_json_frames, "adsb"),
    _map("masts.csv", "table of obstacles", maps.write_obstacle_table),
    _map("masts.dat", "digital obstacle file of the FAA", maps.write_faa),
    _map("blocks.geojson", "GeoJSON", maps.write_geojson),
    _map("blocks.geojsonl", "GeoJSON, a feature a line", maps.write_geojson_lines),
    _map("city.json", "CityJSON", maps.write_cityjson),
    _map("city.jsonl", "CityJSON sequence", maps.write_cityjson_lines),
    _map("zones-ed269.json", "ED-269 zones", maps.write_ed269, " --at 2026-07-01T12:00Z"),
    _map("zones-ed318.json", "ED-318 zones", maps.write_ed318),
    _map("terrain.tif", "terrain raster", maps.write_terrain, " masts.csv"),
    _map("houses.gpkg", "GeoPackage", gis.write_geopackage),
    _map("houses.shp", "Shapefile, with .dbf, .shx and .prj", gis.write_shapefile),
    _map("place.osm", "OpenStreetMap, XML", gis.write_osm),
    _map("place.osm.pbf", "OpenStreetMap, PBF", gis.write_osm_packed),
    _map("N50E008.hgt", "tile of SRTM", gis.write_hgt),
    _map("n50.dt0", "tile of DTED", gis.write_dted),
    Sample("map-mission.toml", "mission", "over that map, 10 m/s", _text(own.MAPPED),
           "clearway fly map-mission.toml", "map"),
    Sample("volumes.toml", "volumes", "what two aircraft should not share", _text(own.VOLUMES),
           "clearway alerts encounter.daa --volumes volumes.toml"),
    Sample("own_plant.py", "plant", "one's own, as module:name", _text(own.PLANT),
           "clearway automaton measure own_plant.py:Blimp --out blimp.toml --gusts 0.1"),
    Sample("blimp-mission.toml", "mission", "flown with that plant", _text(own.FLOWN),
           "clearway fly blimp-mission.toml"),
    Sample("plan.plan", "plan", "QGroundControl, with a fence", plans.write_plan_sample,
           "clearway fly plan.plan", "map"),
    Sample("plan.waypoints", "plan", "QGC WPL 110", plans.write_waypoints,
           "clearway fly plan.waypoints"),
    Sample("way.kml", "plan", "KML, a path above the ground", plans.write_kml,
           "clearway fly way.kml"),
    Sample("dji.kmz", "plan", "DJI WPML, heights above the ellipsoid", plans.write_wpml,
           "clearway fly dji.kmz"),
    Sample("model.txt", "encounter model", "made-up numbers, MIT-LL's text format", _model,
           "clearway risk model.txt --count 20"),
    Sample("my.toml", "campaign", "two families, two planners", _text(CAMPAIGN),
           "clearway campaign my.toml", "parquet"),
    Sample("own_planner.py", "planner", "one's own, as module:name", _text(PLANNER),
           "clearway compare my-mission.toml --planners clearway,own_planner:make"),
    Sample("examples", "examples", "missions, scenes and own parts of the documentation", _examples,
           "clearway fly examples/missions/rules.toml"),
)  # fmt: skip
"""Add a sample here: README.md of the folder and the tests are made from it."""


class Written(NamedTuple):
    """What there is in a folder now."""

    samples: tuple[Sample, ...]
    left_out: tuple[Sample, ...]
    """For want of an extra."""


def write_samples(folder: ResultsFolder, seed: int = 0) -> Written:
    """All samples that the installed packages can write and read, a README.md, and commands.txt: a
    line for each command that takes one.

    The same seed gives the same files. Errors as of `ResultsFolder`.
    """
    written = tuple(one for one in SAMPLES if not one.lacks)
    left_out = tuple(one for one in SAMPLES if one.lacks)
    with folder.write() as scratch:
        for one in written:
            rng = np.random.default_rng([seed, zlib.crc32(one.name.encode())])
            one.write(scratch / one.name, rng)
        (scratch / "README.md").write_text(_readme(written, left_out, seed))
        commands = [one.command for one in written if one.command]
        (scratch / "commands.txt").write_text("\n".join(commands) + "\n")
    return Written(written, left_out)


def _readme(written: Sequence[Sample], left_out: Sequence[Sample], seed: int) -> str:
    lines = [
        "# Samples of everything that clearway reads\n",
        f"Written by `clearway sample`, seed {seed}: all of it is made up. Go into this folder and",
        "try the commands, which stand alone in `commands.txt`; most write results below",
        "`clearway-out/`.\n",
        "| file | what it is | command |",
        "| --- | --- | --- |",
    ]
    for one in written:
        command = f"`{one.command}`" if one.command else ""
        lines.append(f"| {one.name} | {one.kind}: {one.about} | {command} |")
    for one in left_out:
        lines.append(f"| {one.name} | {one.kind}: {one.about} | not written: needs [{one.needs}] |")
    return "\n".join(lines) + "\n"
