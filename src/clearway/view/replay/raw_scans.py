"""Raw scans and the mission of a run's MCAP file, as `clearway fly --scans` keeps them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from clearway.base.errors import MissingExtraError, naming
from clearway.base.frames import FloatArray
from clearway.io.foreign_errors import COMPLAINTS, damage_told
from clearway.view.replay import schemas
from clearway.view.replay.reading import cloud_points

NANOSECOND_S = 1e-9
MISSION_FILE = "mission.toml"


class RawScan(NamedTuple):
    """One reading of a sensor, sensor frame."""

    after_s: float
    """Since the run began."""
    points_m: FloatArray


class KeptReadings(NamedTuple):
    """What a run keeps beside what is replayed."""

    scans: dict[str, list[RawScan]]
    """By sensor; empty without `--scans`."""
    mission_toml: bytes | None


def is_run_file(path: Path) -> bool:
    """Whether an MCAP file is a run of clearway."""
    try:
        from mcap.exceptions import McapError
        from mcap.reader import SeekingReader
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "foxglove") from cause
    unreadable: tuple[type[Exception], ...] = (*COMPLAINTS, McapError)
    with naming(path, "read"), path.open("rb") as stream:
        try:
            summary = SeekingReader(stream).get_summary()
        except unreadable:
            return False  # Whoever reads it tells what is wrong with it.
    channels = summary.channels.values() if summary else ()
    return any(channel.topic == schemas.MISSION for channel in channels)


def read_raw_scans(path: Path) -> KeptReadings:
    """The raw scans of a run that `read_run` has found sound, and the mission attached to it."""
    try:
        from mcap.reader import SeekingReader
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "foxglove") from cause
    scans: dict[str, list[RawScan]] = {}
    with naming(path, "read"), damage_told(path, "run"), path.open("rb") as stream:
        reader = SeekingReader(stream)
        missions = [one.data for one in reader.iter_attachments() if one.name == MISSION_FILE]
        summary = reader.get_summary()
        channels = [] if summary is None else [one.topic for one in summary.channels.values()]
        wanted = [one for one in channels if one.startswith(schemas.SCANS)]
        start_ns = None
        for _, channel, message in reader.iter_messages(topics=[schemas.MISSION, *wanted]):
            if channel.topic == schemas.MISSION:
                start_ns = message.log_time if start_ns is None else start_ns
            elif start_ns is not None:
                after_s = (message.log_time - start_ns) * NANOSECOND_S
                name = channel.topic.removeprefix(schemas.SCANS)
                scans.setdefault(name, []).append(RawScan(after_s, cloud_points(message.data)))
    return KeptReadings(scans, missions[0] if missions else None)
