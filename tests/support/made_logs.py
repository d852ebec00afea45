"""A made flight written as the logs that others write: of clearway, ROS, PX4, ArduPilot.

How a logger writes is drawn from the seed of the crash: rate and noise of its poses, whether a
vehicle stays where it hit or falls, whether a dead sensor is silent or reports that it is not
healthy, whether the autopilot states a wind and a crash.
"""

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
from clearway.live.mission import Progress
from clearway.missions.setup import prepare
from clearway.sim import Run
from clearway.sim.metrics import measure_flight
from crash_flights import STEP_S
from made_crashes import MadeCrash
from robot_messages import Types, write_bag1, write_bag2, write_mcap

BEGIN_S, BOOT_US = 1_767_225_600.0, 5_000_000
STANDS_S, FALL_MPS2 = 1.6, 9.81
ULOG_BINS, SLAB_SHARE = 72, 0.05
UNKNOWN_CM, GOOD, BAD = 65_535, 2, 1
WIND_ERROR = 0.1
ENU_FROM_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FRD_FROM_FLU = np.diag([1.0, -1.0, -1.0])


class Flown(NamedTuple):
    """What a logger of someone's vehicle keeps of a flight."""

    time_s: Any
    place_m: Any
    world_from_body: Any
    scans: tuple[tuple[float, Any], ...]
    dead_s: tuple[float, ...]
    """Times at which a dead sensor reports that it is not healthy."""
    wind: tuple[tuple[float, float, float], ...]
    """Time, east and north, as the autopilot estimates it."""
    ended_s: float
    states_crash: bool
    sees_m: float
    clock: Callable[[float], float] = float
    """What the logger's clock shows at a true time."""

    def stamp_us(self, time_s: float) -> int:
        """Microseconds since boot that an autopilot's log states."""
        return BOOT_US + round(1e6 * self.clock(time_s))


Change = Callable[[Flown], Flown]


def as_flown(kept: Flown) -> Flown:
    """No change."""
    return kept


def without_clouds(kept: Flown) -> Flown:
    """A logger that keeps no returns."""
    return kept._replace(scans=(), dead_s=())


def flown(made: MadeCrash) -> Flown:
    """The track as it is logged, and what came after the first touch of the body."""
    rng = np.random.default_rng([made.seed, 7])
    flight, every = made.flight, int(rng.choice([1, 2]))
    sigma, falls = float(rng.choice([0.0, 0.01, 0.03])), bool(rng.random() < 0.3)
    reports, states_wind, states_crash = (bool(rng.random() < 0.5) for _ in range(3))
    times, states = flight.time_s[::every], flight.states[::every]
    after = np.arange(STEP_S * every, STANDS_S + 1.0, STEP_S * every) if flight.touched else ()
    ended = float(flight.time_s[-1])
    rest = np.repeat(flight.states[-1:], len(after), axis=0)
    if falls and len(after):
        rest[:, 2] -= np.minimum(0.5 * FALL_MPS2 * np.asarray(after) ** 2, rng.uniform(1.0, 8.0))
        rest[:, 4] += np.minimum(3.0 * np.asarray(after), 1.5)
    times, states = np.append(times, ended + np.asarray(after)), np.concatenate([states, rest])
    turns = np.array([world_from_body(state[3:]) for state in states])
    places = states[:, :3] + rng.normal(0.0, 1.0, (len(states), 3)) * sigma
    fault = made.case.fault
    period = 1.0 / made.case.scans_hz
    dead = np.arange(fault.dead_s, ended, period) if fault.dead_s < ended and reports else ()
    wind = np.asarray(fault.wind_mps[:2]) + rng.normal(0.0, WIND_ERROR, 2) * np.linalg.norm(
        fault.wind_mps
    )
    estimates = [(float(one), *wind.tolist()) for one in times[::20]] if states_wind else []
    scans = [(one.time_s, one.points_m) for one in flight.scans]
    return Flown(
        times, places, turns, tuple(scans), tuple(dead), tuple(estimates), ended, states_crash,
        made.sees_m,
    )  # fmt: skip


def write_run(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    """A run folder of `clearway fly --scans`."""
    path, flight, setup = folder / "run", made.flight, prepare(made.file)
    results = ResultsFolder.check(path, "fly", made.file.mission.name)
    way = np.concatenate([setup.mission.start.position_m[None], setup.mission.waypoints_m])
    margin = made.case.craft.margin_m
    run: Run[Any] = Run(
        mission=setup.mission,
        time_s=flight.time_s,
        states=flight.states,
        decisions=(),
        movements=(),
        progress=Progress(),
        metrics=measure_flight(flight.time_s, flight.states, setup.world, way, margin),
        safety_margin_m=margin,
        body_radius_m=made.case.craft.body_m,
        seed=made.seed,
        world=setup.world,
        planner="made",
    )
    scans = flight.scans if change(flown(made)).scans else ()
    write_flight(run, setup, made.file, results, scans=scans)
    return path


def _messages(made: MadeCrash, types: Types, change: Change) -> list[tuple[str, float, Any]]:
    kept = change(flown(made))
    turns = Rotation.from_matrix(kept.world_from_body).as_quat()[:, [3, 0, 1, 2]]
    rows: list[tuple[float, str, Any]] = [
        (time_s, "/odom", (place.tolist(), turn.tolist()))
        for time_s, place, turn in zip(kept.time_s.tolist(), kept.place_m, turns, strict=True)
    ]
    rows += [(time_s, "/front/points", points) for time_s, points in kept.scans]
    mounted = types.transform(BEGIN_S, "base_link", "front", (0.0, 0.0, 0.0))
    told = [("/tf_static", BEGIN_S, mounted)]
    for time_s, topic, value in sorted(rows, key=_first):
        at_s = BEGIN_S + kept.clock(time_s)
        if topic == "/odom":
            told.append((topic, at_s, types.odometry(at_s, *value)))
        else:
            told.append((topic, at_s, types.cloud2(at_s, "front", value)))
    return told


def write_ros_mcap(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    return write_mcap(folder / "made.mcap", Types(), _messages(made, Types(), change))


def write_ros1(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    types = Types(ros2=False)
    return write_bag1(folder / "made.bag", types, _messages(made, types, change))


def write_ros2(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    return write_bag2(folder / "made", Types(), _messages(made, Types(), change))


def _sectors(points: Any, bins: int, sees_m: float) -> Any:
    """Nearest level return of each sector, clockwise from the nose; inf without any."""
    nearest = np.full(bins, np.inf)
    level = points[np.abs(points[:, 2]) < SLAB_SHARE * sees_m]
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
    "wind": (("uint64_t", "timestamp"), ("float", "windspeed_north"), ("float", "windspeed_east")),
    "obstacle_distance": (
        ("uint64_t", "timestamp"), ("float", "increment"), ("float", "angle_offset"),
        ("uint16_t", "min_distance"), ("uint16_t", "max_distance"),
        ("uint16_t[72]", "distances"), ("uint8_t", "frame"), ("uint8_t", "sensor_type"),
    ),
}  # fmt: skip
ULOG_LETTERS = {**LETTERS, "uint16_t[72]": "72H"}


def write_ulog(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    """A log of PX4 whose front sensor is reported as `obstacle_distance`."""
    content = MAGIC + struct.pack("<Q", BOOT_US) + _ulog_message(b"B", bytes(40))
    for topic, fields in ULOG_TOPICS.items():
        words = ";".join(f"{kind} {name}" for kind, name in fields)
        content += _ulog_message(b"F", f"{topic}:{words};".encode())
    for number, topic in enumerate(ULOG_TOPICS):
        content += _ulog_message(b"A", struct.pack("<BH", 0, number) + topic.encode())
    order = list(ULOG_TOPICS)
    for _, topic, values in sorted(_ulog_rows(change(flown(made))), key=_first):
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


def _ulog_rows(kept: Flown) -> Iterator[tuple[float, str, tuple[Any, ...]]]:
    for time_s, place, turn in zip(kept.time_s, kept.place_m, kept.world_from_body, strict=True):
        now = kept.stamp_us(float(time_s))
        north, east, down = (ENU_FROM_NED.T @ place).tolist()
        yield time_s, "vehicle_local_position", (
            now, 47.0, 8.0, 400.0, north, east, down, True, True,
        )  # fmt: skip
        frd = Rotation.from_matrix(ENU_FROM_NED.T @ turn @ FRD_FROM_FLU)
        x, y, z, w = frd.as_quat().tolist()
        yield time_s, "vehicle_attitude", (now, w, x, y, z)
    for time_s, points in kept.scans:
        now = kept.stamp_us(time_s)
        ranges, most = 100.0 * _sectors(points, ULOG_BINS, kept.sees_m), round(100 * kept.sees_m)
        bins = [round(one) if np.isfinite(one) else most + 1 for one in ranges]
        yield time_s, "obstacle_distance", (now, 5.0, 0.0, 10, most, *bins, 12, 0)
    for time_s in kept.dead_s:
        now = kept.stamp_us(time_s)
        bins, most = [UNKNOWN_CM] * ULOG_BINS, round(100 * kept.sees_m)
        yield time_s, "obstacle_distance", (now, 5.0, 0.0, 10, most, *bins, 12, 0)
    for time_s, east, north in kept.wind:
        now = kept.stamp_us(time_s)
        yield time_s, "wind", (now, north, east)


DATAFLASH = {
    # Name: number, its characters, struct's, columns.
    "FMT": (FMT, "BBnNZ", "<BB4s16s64s", "Type,Length,Name,Format,Columns"),
    "XKF1": (140, "QBccCfff", "<QBhhHfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD"),
    "PRX": (141, "QBBffffffff", "<QBBffffffff",
            "TimeUS,Layer,He,D0,D45,D90,D135,D180,D225,D270,D315"),
    "XKF2": (143, "QBff", "<QBff", "TimeUS,C,VWN,VWE"),
    "ERR": (142, "QBB", "<QBB", "TimeUS,Subsys,ECode"),
}  # fmt: skip


def write_dataflash(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    """A log of ArduPilot whose front sensor is reported as proximity (PRX)."""
    content = b""
    for name in DATAFLASH:
        number, characters, form, columns = DATAFLASH[name]
        words = (name.encode(), characters.encode(), columns.encode())
        content += _row("FMT", number, 3 + struct.calcsize(form), *words)
    rows = sorted(_dataflash_rows(change(flown(made))), key=_first)
    content += b"".join(_row(name, *values) for _, name, values in rows)
    path = folder / "made.bin"
    path.write_bytes(content)
    return path


def _row(name: str, *values: Any) -> bytes:
    number, _, form, _ = DATAFLASH[name]
    return HEAD + bytes((number,)) + struct.pack(form, *values)


def _dataflash_rows(kept: Flown) -> Iterator[tuple[float, str, tuple[Any, ...]]]:
    for time_s, place, turn in zip(kept.time_s, kept.place_m, kept.world_from_body, strict=True):
        now = kept.stamp_us(float(time_s))
        north, east, down = (ENU_FROM_NED.T @ place).tolist()
        frd = Rotation.from_matrix(ENU_FROM_NED.T @ turn @ FRD_FROM_FLU)
        yaw, pitch, roll = np.degrees(frd.as_euler("ZYX")).tolist()
        angles = (round(100 * roll), round(100 * pitch), round(100 * (yaw % 360.0)) % 36000)
        yield time_s, "XKF1", (now, 0, *angles, north, east, down)
    for time_s, points in kept.scans:
        now = kept.stamp_us(time_s)
        ranges = np.minimum(_sectors(points, 8, kept.sees_m), kept.sees_m)
        yield time_s, "PRX", (now, 0, GOOD, *ranges.tolist())
    for time_s in kept.dead_s:
        now = kept.stamp_us(time_s)
        yield time_s, "PRX", (now, 0, BAD, *[kept.sees_m] * 8)
    for time_s, east, north in kept.wind:
        now = kept.stamp_us(time_s)
        yield time_s, "XKF2", (now, 0, north, east)
    if kept.states_crash:
        now = kept.stamp_us(kept.ended_s + 1.2)
        yield kept.ended_s + 1.2, "ERR", (now, 12, 1)


def write_log(made: MadeCrash, folder: Path, change: Change = as_flown) -> Path:
    """A log of the format that was drawn; of ROS, of one of its three containers."""
    if made.form != "ROS":
        return WRITERS[made.form](made, folder, change)
    kind = str(np.random.default_rng([made.seed, 8]).choice(["MCAP", "ROS 1 bag", "ROS 2 bag"]))
    return WRITERS[kind](made, folder, change)


WRITERS: dict[str, Callable[..., Path]] = {
    "run": write_run,
    "MCAP": write_ros_mcap,
    "ULog": write_ulog,
    "DataFlash": write_dataflash,
    "ROS 1 bag": write_ros1,
    "ROS 2 bag": write_ros2,
}
