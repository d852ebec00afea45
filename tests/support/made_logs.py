"""A simulated flight written as the logs that others write: of clearway, ROS, PX4, ArduPilot."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.base.frames import world_from_body
from clearway.cli.flight_files import write_flight
from clearway.io.results_folder import ResultsFolder
from clearway.io.samples.dataflash import FMT, HEAD
from clearway.io.samples.ulog import LETTERS, MAGIC
from made_crashes import BODY_M, MadeCrash
from robot_messages import Types, write_bag1, write_bag2, write_mcap

BEGIN_S, BOOT_US = 1_767_225_600.0, 5_000_000
STANDS_S, STEP_S = 1.6, 0.05
ULOG_BINS, SLAB_M = 72, 0.5
REACH_M = 10.0
ENU_FROM_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])


class Flown(NamedTuple):
    """A flight that stands still where its body touched something."""

    time_s: Any
    place_m: Any
    world_from_body: Any
    scans: tuple[tuple[float, Any], ...]


def until_contact(made: MadeCrash, *, clouds: bool = True) -> Flown:
    """The track to the first touch of the body, and then a while on the spot."""
    touched = made.run.nearest_surface_m <= BODY_M
    last = int(np.argmax(touched)) if touched.any() else len(touched) - 1
    times, states = made.run.time_s[: last + 1], made.run.states[: last + 1]
    stands_s = STANDS_S if touched.any() else 0.0
    after = times[-1] + np.arange(STEP_S, stands_s, STEP_S)
    times = np.concatenate([times, after])
    states = np.concatenate([states, np.repeat(states[-1:], len(after), axis=0)])
    turns = np.array([world_from_body(state[3:]) for state in states])
    ended = float(made.run.time_s[last])
    scans = [(one.time_s, one.points_m) for one in made.scans if one.time_s <= ended]
    return Flown(times, states[:, :3], turns, tuple(scans) if clouds else ())


def write_run(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    """A run folder of `clearway fly --scans`."""
    path = folder / "run"
    results = ResultsFolder.check(path, "fly", made.file.mission.name)
    scans = made.scans if clouds else ()
    write_flight(made.run, made.setup, made.file, results, scans=scans)
    return path


def _messages(made: MadeCrash, types: Types, clouds: bool) -> list[tuple[str, float, Any]]:
    flown = until_contact(made, clouds=clouds)
    turns = Rotation.from_matrix(flown.world_from_body).as_quat()[:, [3, 0, 1, 2]]
    begin = BEGIN_S
    told = [("/tf_static", begin, types.transform(begin, "base_link", "front", (0.0, 0.0, 0.0)))]
    for time_s, place, turn in zip(flown.time_s, flown.place_m, turns, strict=True):
        at_s = begin + float(time_s)
        told.append(("/odom", at_s, types.odometry(at_s, place.tolist(), turn.tolist())))
    for time_s, points in flown.scans:
        at_s = begin + float(time_s)
        told.append(("/front/points", at_s, types.cloud2(at_s, "front", points)))
    return sorted(told, key=lambda one: one[1])


def write_ros_mcap(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    return write_mcap(folder / "made.mcap", Types(), _messages(made, Types(), clouds))


def write_ros1(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    types = Types(ros2=False)
    return write_bag1(folder / "made.bag", types, _messages(made, types, clouds))


def write_ros2(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    return write_bag2(folder / "made", Types(), _messages(made, Types(), clouds))


def _sectors(points: Any, bins: int) -> Any:
    """Nearest level return of each sector, clockwise from the nose; inf without any."""
    nearest = np.full(bins, np.inf)
    level = points[np.abs(points[:, 2]) < SLAB_M]
    ranges = np.linalg.norm(level[:, :2], axis=1)
    clockwise = -np.arctan2(level[:, 1], level[:, 0])
    number = np.round(clockwise / (2.0 * np.pi / bins)).astype(int) % bins
    np.minimum.at(nearest, number, ranges)
    return nearest


ULOG_TOPICS: dict[str, tuple[tuple[str, str], ...]] = {
    "vehicle_local_position": (
        ("uint64_t", "timestamp"), ("double", "ref_lat"), ("double", "ref_lon"),
        ("float", "ref_alt"), ("float", "x"), ("float", "y"), ("float", "z"),
        ("bool", "xy_valid"), ("bool", "z_valid"),
    ),
    "vehicle_attitude": (("uint64_t", "timestamp"), ("float[4]", "q")),
    "obstacle_distance": (
        ("uint64_t", "timestamp"), ("float", "increment"), ("float", "angle_offset"),
        ("uint16_t", "min_distance"), ("uint16_t", "max_distance"),
        ("uint16_t[72]", "distances"), ("uint8_t", "frame"), ("uint8_t", "sensor_type"),
    ),
}  # fmt: skip
ULOG_LETTERS = {**LETTERS, "uint16_t[72]": "72H"}


def write_ulog(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    """A log of PX4 whose front sensor is reported as `obstacle_distance`."""
    content = MAGIC + struct.pack("<Q", BOOT_US) + _ulog_message(b"B", bytes(40))
    for topic, fields in ULOG_TOPICS.items():
        words = ";".join(f"{kind} {name}" for kind, name in fields)
        content += _ulog_message(b"F", f"{topic}:{words};".encode())
    for number, topic in enumerate(ULOG_TOPICS):
        content += _ulog_message(b"A", struct.pack("<BH", 0, number) + topic.encode())
    order = list(ULOG_TOPICS)
    for _, topic, values in sorted(_ulog_rows(until_contact(made, clouds=clouds)), key=_first):
        letters = "".join(ULOG_LETTERS[kind] for kind, _ in ULOG_TOPICS[topic])
        data = struct.pack("<" + letters, *values)
        content += _ulog_message(b"D", struct.pack("<H", order.index(topic)) + data)
    path = folder / "made.ulg"
    path.write_bytes(content)
    return path


def _first(row: tuple[Any, ...]) -> Any:
    return row[0]


def _ulog_message(kind: bytes, data: bytes) -> bytes:
    return struct.pack("<H", len(data)) + kind + data


def _ulog_rows(flown: Flown) -> Iterator[tuple[int, str, tuple[Any, ...]]]:
    for time_s, place, turn in zip(flown.time_s, flown.place_m, flown.world_from_body, strict=True):
        now = BOOT_US + round(1e6 * float(time_s))
        north, east, down = (ENU_FROM_NED.T @ place).tolist()
        yield now, "vehicle_local_position", (
            now, 47.0, 8.0, 400.0, north, east, down, True, True,
        )  # fmt: skip
        frd = Rotation.from_matrix(ENU_FROM_NED.T @ turn @ FRD_FROM_FLU)
        x, y, z, w = frd.as_quat().tolist()
        yield now, "vehicle_attitude", (now, w, x, y, z)
    for time_s, points in flown.scans:
        now = BOOT_US + round(1e6 * time_s)
        ranges = 100.0 * _sectors(points, ULOG_BINS)
        shown = [round(one) if np.isfinite(one) else round(100 * REACH_M) + 1 for one in ranges]
        yield now, "obstacle_distance", (
            now, 5.0, 0.0, 10, round(100 * REACH_M), *shown, 12, 0,
        )  # fmt: skip


DATAFLASH = {
    # Name: number, its characters, struct's, columns.
    "FMT": (FMT, "BBnNZ", "<BB4s16s64s", "Type,Length,Name,Format,Columns"),
    "XKF1": (140, "QBccCfff", "<QBhhHfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD"),
    "PRX": (141, "QBBffffffff", "<QBBffffffff",
            "TimeUS,Layer,He,D0,D45,D90,D135,D180,D225,D270,D315"),
    "ERR": (142, "QBB", "<QBB", "TimeUS,Subsys,ECode"),
}  # fmt: skip


def write_dataflash(made: MadeCrash, folder: Path, *, clouds: bool = True) -> Path:
    """A log of ArduPilot whose front sensor is reported as proximity (PRX)."""
    content = b""
    for name in DATAFLASH:
        number, characters, form, columns = DATAFLASH[name]
        words = (name.encode(), characters.encode(), columns.encode())
        content += _row("FMT", number, 3 + struct.calcsize(form), *words)
    rows = sorted(_dataflash_rows(until_contact(made, clouds=clouds)), key=_first)
    content += b"".join(_row(name, *values) for _, name, values in rows)
    path = folder / "made.bin"
    path.write_bytes(content)
    return path


def _row(name: str, *values: Any) -> bytes:
    number, _, form, _ = DATAFLASH[name]
    return HEAD + bytes((number,)) + struct.pack(form, *values)


def _dataflash_rows(flown: Flown) -> Iterator[tuple[int, str, tuple[Any, ...]]]:
    for time_s, place, turn in zip(flown.time_s, flown.place_m, flown.world_from_body, strict=True):
        now = BOOT_US + round(1e6 * float(time_s))
        north, east, down = (ENU_FROM_NED.T @ place).tolist()
        frd = Rotation.from_matrix(ENU_FROM_NED.T @ turn @ FRD_FROM_FLU)
        yaw, pitch, roll = np.degrees(frd.as_euler("ZYX")).tolist()
        angles = (round(100 * roll), round(100 * pitch), round(100 * (yaw % 360.0)) % 36000)
        yield now, "XKF1", (now, 0, *angles, north, east, down)
    for time_s, points in flown.scans:
        now = BOOT_US + round(1e6 * time_s)
        ranges = np.minimum(_sectors(points, 8), REACH_M + 5.0)
        yield now, "PRX", (now, 0, 2, *ranges.tolist())


WRITERS: dict[str, Callable[..., Path]] = {
    "run": write_run,
    "MCAP": write_ros_mcap,
    "ULog": write_ulog,
    "DataFlash": write_dataflash,
    "ROS 1 bag": write_ros1,
    "ROS 2 bag": write_ros2,
}
