"""Whole files to damage: every format, the command that reads it, and how whole ones are made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tools.fuzz.hostile import (
    Damage,
    chunks_lying,
    list_changed,
    lists,
    members,
    packed_nothing,
    planted,
    schema_changed,
)
from tools.fuzz.made import (
    beast_files,
    bin_files,
    both,
    campaign_files,
    gzip_files,
    json_files,
    las_files,
    metadata_beside,
    model_files,
    npy_files,
    ouster_files,
    ouster_json_files,
    packets_beside,
    pcd_files,
    ply_files,
    real,
    robot_files,
    run_files,
    sample_files,
    scan_beside,
    shapefile_beside,
    table_files,
    text_files,
    tif_files,
    ulog_files,
    with_real,
    zstd_files,
)
from tools.fuzz.mutate import mutated
from tools.fuzz.texts import (
    AIRCRAFT,
    AVR,
    CITY,
    DAA,
    GEOJSON,
    HEX,
    JUMPS,
    LIMITS,
    MISSIONS,
    OBSTACLES,
    PLAN,
    POSE_TEXTS,
    SBS,
    SCENES,
    SCN,
    STATES,
    STATES_CSV,
    TRACE,
    TRAJECTORIES,
    WAYPOINTS,
)

SMALL = ("--layers", "3", "--columns", "4", "--rows", "3")


class Format(NamedTuple):
    """A kind of file, whole ones of it, and the command that reads it."""

    suffix: str
    command: tuple[str, ...]
    """{} is the file."""
    make: Callable[[Path], list[bytes]]
    """From a scratch folder."""
    beside: Callable[[Path], dict[str, bytes]] = lambda folder: {}
    """Whole files that lie beside it, by suffix or name."""
    apart: bool = False
    """Whether a case takes a while, as where it is read in a process of its own."""
    damage: Damage = mutated
    """From a whole file to one of the cases."""
    plant: Callable[[Path, bytes], None] | None = None
    """Fills the scratch folder, where a file alone is no case."""


SCAN = ("assess", "--scan", "{}", *SMALL, "--no-plots", "--out", "out")
SCENE = ("assess", "{}", "--no-plots", "--out", "out")
POSES = ("assess", "--scan", "scan.bin", "--poses", "{}", *SMALL, "--no-plots", "--out", "out")
MAP = ("map", "{}", "--no-plots")
TRAFFIC = ("traffic", "{}")
FLY = ("fly", "{}", "--no-plots", "--no-mcap", "--out", "out")
REPLAY = ("replay", "{}", "--html", "page.html", "--no-browser")


FORMATS: dict[str, Format] = {
    "pcd": Format(".pcd", SCAN, pcd_files),
    "ply": Format(".ply", SCAN, ply_files),
    "las": Format(".las", SCAN, las_files(".las")),
    "laz": Format(".laz", SCAN, las_files(".laz"), apart=True),
    "point-table": Format(".csv", SCAN, table_files),
    "npy": Format(".npy", SCAN, npy_files),
    "kitti": Format(".bin", SCAN, bin_files),
    "bag": Format(".bag", SCAN, robot_files("bag1")),
    "db3": Format(".db3", SCAN, robot_files("bag2_bare")),
    "mcap": Format(
        ".mcap", SCAN, both(robot_files("mcap2"), robot_files("mcap1"), robot_files("mcap2_plain"))
    ),
    "livox": Format(".bag", SCAN, sample_files("livox.bag")),
    "livox-db3": Format(".db3", SCAN, sample_files("livox/livox.db3")),
    "db3-schema": Format(".db3", SCAN, robot_files("bag2_bare"), apart=True, damage=schema_changed),
    "mcap-chunks": Format(
        ".mcap",
        SCAN,
        both(robot_files("mcap2"), robot_files("mcap2_plain"), packed_nothing),
        apart=True,
        damage=chunks_lying,
    ),
    "results": Format(
        ".json",
        ("assess", "damaged-file.toml", "--no-plots", "--out", "out"),
        lists,
        damage=list_changed,
        plant=planted,
    ),
    "db3-zstd": Format(".db3.zstd", SCAN, zstd_files(robot_files("bag2_bare"))),
    "pcap": Format(".pcap", SCAN, ouster_files, metadata_beside, apart=True),
    "pcap-json": Format(
        ".json",
        (*SCAN[:2], "{stem}.pcap", *SCAN[3:]),
        ouster_json_files,
        packets_beside,
        apart=True,
    ),
    "poses": Format(".txt", POSES, text_files(*POSE_TEXTS), scan_beside),
    "poses-ulog": Format(".ulg", POSES, ulog_files, scan_beside, apart=True),
    "scene": Format(".toml", SCENE, text_files(*SCENES)),
    "mission": Format(".toml", FLY, text_files(*MISSIONS)),
    "plan": Format(".plan", FLY, with_real(json_files(PLAN), "maps/missions/*.plan")),
    "waypoints": Format(
        ".waypoints", FLY, with_real(text_files(WAYPOINTS, JUMPS), "maps/missions/*.waypoints")
    ),
    "plan-limits": Format(".txt", FLY, text_files(*LIMITS)),
    "kml": Format(".kml", FLY, sample_files("way.kml"), apart=True),
    "kmz": Format(".kmz", FLY, sample_files("dji.kmz"), apart=True),
    "campaign": Format(".toml", ("campaign", "{}", "--out", "out"), campaign_files),
    "encounter-model": Format(
        ".txt", ("risk", "{}", "--count", "2", "--workers", "1"), model_files
    ),
    "replay": Format(".mcap", REPLAY, run_files),
    "obstacle-table": Format(".csv", MAP, with_real(text_files(OBSTACLES), "maps/obstacles/*.csv")),
    "faa": Format(".dat", MAP, lambda folder: real("maps/obstacles/*.dat")),
    "geojson": Format(".geojson", MAP, json_files(GEOJSON)),
    "cityjson": Format(".json", MAP, json_files(CITY)),
    "geozones": Format(".json", MAP, lambda folder: real("maps/geozones/*.json", most=10**6)),
    "terrain": Format(".tif", MAP, tif_files),
    "hgt": Format(".hgt", MAP, sample_files("N50E008.hgt"), apart=True),
    "dted": Format(".dt0", MAP, sample_files("n50.dt0")),
    "gpkg": Format(".gpkg", MAP, sample_files("houses.gpkg")),
    "gpkg-schema": Format(".gpkg", MAP, sample_files("houses.gpkg"), damage=schema_changed),
    "shp": Format(".shp", MAP, sample_files("houses.shp"), shapefile_beside(".dbf", ".prj")),
    "dbf": Format(
        ".dbf",
        ("map", "{stem}.shp", "--no-plots"),
        sample_files("houses.dbf"),
        shapefile_beside(".shp", ".prj"),
    ),
    "osm": Format(".osm", MAP, sample_files("place.osm"), apart=True),
    "osm-pbf": Format(".osm.pbf", MAP, sample_files("place.osm.pbf"), apart=True),
    "mode-s-hex": Format(".csv", TRAFFIC, with_real(text_files(HEX), "adsb/*.csv")),
    "avr": Format(".txt", TRAFFIC, text_files(AVR)),
    "beast": Format(".bin", TRAFFIC, with_real(beast_files, "adsb/*.bin")),
    "sbs": Format(".txt", TRAFFIC, text_files(SBS)),
    "aircraft-json": Format(".json", TRAFFIC, with_real(json_files(AIRCRAFT), "adsb/*.jsonl")),
    "trace": Format(".json", TRAFFIC, json_files(TRACE)),
    "states": Format(".json", TRAFFIC, json_files(STATES)),
    "trajectories": Format(".json", TRAFFIC, json_files(TRAJECTORIES)),
    "states-csv": Format(".csv", TRAFFIC, text_files(STATES_CSV)),
    "daa": Format(".daa", TRAFFIC, with_real(text_files(DAA), "daa/daidalus/Scenarios/*.daa")),
    "bluesky": Format(".scn", TRAFFIC, with_real(text_files(SCN), "daa/bluesky/*.scn")),
    "traffic-gzip": Format(".gz", TRAFFIC, gzip_files),
    "traffic-members": Format(".gz", TRAFFIC, gzip_files, apart=True, damage=members),
    "tlog": Format(".tlog", TRAFFIC, sample_files("flight.tlog")),
    "dataflash": Format(".bin", TRAFFIC, sample_files("copter.bin"), apart=True),
    "gdl90": Format(".gdl90", TRAFFIC, sample_files("tablet.gdl90")),
    "ogn": Format(".txt", TRAFFIC, sample_files("gliders.txt")),
    "traffic-ulog": Format(".ulg", TRAFFIC, ulog_files, apart=True),
}
