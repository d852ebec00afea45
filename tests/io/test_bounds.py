"""Small files that ask for much: each ends with an error of the file, soon and in little memory."""

from __future__ import annotations

import sqlite3
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tools.fuzz.made import DATA

from clearway.base.errors import InputError
from clearway.io.scans.sequences import open_scans
from recordings_for_tests import POINTS, bag1, bag2_bare
from robot_messages import Message, Types

pytest.importorskip("rosbags")

ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT "
ROW = "x AS id, 1 AS topic_id, x AS timestamp, data FROM n, old"
CLOUD2 = "sensor_msgs/msg/PointCloud2"
LARGE = 150_000_000


def recorded(maker: Callable[[Path, list[Message]], Path], folder: Path, count: int = 2) -> Path:
    types = Types(ros2=maker is not bag1)
    return maker(
        folder,
        [Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS)) for n in range(count)],
    )


def changed(path: Path, *statements: str, schema: bool = False) -> Path:
    base = sqlite3.connect(path)
    if schema:
        base.execute("PRAGMA writable_schema = ON")
    for statement in statements:
        base.execute(statement)
    base.commit()
    base.close()
    return path


OLD = "ALTER TABLE messages RENAME TO old"
SCHEMAS = {
    "endless view": (OLD, f"CREATE VIEW messages AS {ENDLESS}{ROW}"),
    "large view": (
        OLD,
        "CREATE VIEW messages AS SELECT id, topic_id, timestamp, zeroblob(900000000) AS data "
        "FROM old",
    ),
    "view of topics": (
        "ALTER TABLE topics RENAME TO before",
        f"CREATE VIEW topics AS {ENDLESS} before.*, x AS y FROM n, before",
    ),
    "virtual table": (
        OLD,
        "CREATE VIRTUAL TABLE messages USING fts5(id, topic_id, timestamp, data)",
    ),
    "computed column": (
        OLD,
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
        "data BLOB AS (replace(hex(zeroblob(1000000)), '0', hex(zeroblob(200)))))",
        "INSERT INTO messages SELECT id, topic_id, timestamp FROM old",
    ),
    "trigger": ("CREATE TRIGGER t AFTER INSERT ON messages BEGIN SELECT 1; END",),
}


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_recording_is_made_of_tables_alone(name: str, tmp_path: Path) -> None:
    path = changed(recorded(bag2_bare, tmp_path), *SCHEMAS[name])
    with pytest.raises(InputError, match=r"no recording: .* (is made by CREATE|has computed)"):
        open_scans(path)


def test_a_schema_that_lies_about_its_kinds_is_refused(tmp_path: Path) -> None:
    path = changed(recorded(bag2_bare, tmp_path), *SCHEMAS["endless view"])
    changed(path, "UPDATE sqlite_master SET type = 'table', rootpage = 2 WHERE type = 'view'",
            schema=True)  # fmt: skip
    with pytest.raises(InputError, match=r"no recording|damaged"):
        open_scans(path)


def test_no_blob_is_larger_than_its_file(tmp_path: Path) -> None:
    path = recorded(bag2_bare, tmp_path)
    data = bytearray(path.read_bytes())
    (raw,) = sqlite3.connect(path).execute("SELECT data FROM messages").fetchone()
    serial = 12 + 2 * len(raw)
    varint = bytes([0x80 | serial >> 7, serial & 0x7F])
    assert varint in data
    huge = bytes([0x8F, 0xFF, 0xFF, 0xFF, 0x7F])
    at = data.index(varint)
    data[at : at + len(huge)] = huge
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"damaged|truncated|no message"):
        [scan.read() for scan in open_scans(path)]


def mcap_of(path: Path, definition: str, raw: bytes) -> Path:
    """One message of /points, with a definition of the type of clouds."""
    from mcap.writer import CompressionType, Writer

    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2")
        schema = writer.register_schema(CLOUD2, "ros2msg", definition.encode())
        writer.add_message(writer.register_channel("/points", "cdr", schema), 1, raw, 1)
        writer.finish()
    return path


def packed_bag1(path: Path) -> Path:
    from rosbags.rosbag1 import Writer

    types, writer = Types(ros2=False), Writer(path)
    writer.set_compression(Writer.CompressionFormat.LZ4)
    with writer:
        connection = writer.add_connection("/points", CLOUD2, typestore=types.store)
        writer.write(connection, 1, bytes(LARGE))
    return path


@pytest.mark.parametrize(
    "make",
    [
        lambda path: mcap_of(path.with_suffix(".mcap"), "uint8[] data", bytes(LARGE)),
        lambda path: packed_bag1(path.with_suffix(".bag")),
    ],
    ids=["MCAP", "ROS 1 bag"],
)
def test_what_unpacks_to_more_than_it_may_need_is_refused(
    make: Callable[[Path], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = make(tmp_path / "a")
    assert path.stat().st_size < LARGE / 100
    monkeypatch.setattr("clearway.io.apart.MEMORY_BYTES", LARGE + 200_000_000)
    with pytest.raises(InputError, match="takes more memory than such a file can need"):
        [scan.read() for scan in open_scans(path)]


HEADER = (
    "std_msgs/Header header\n{}\n" + "=" * 80 + "\nMSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80 + "\n"
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + "=" * 80 + "\n"
    "MSG: x/Nothing\n" + "=" * 80 + "\nMSG: x/Loop\nx/Loop again\n"
)
DEFINITIONS = {
    "long array": "string[4000000000] data",
    "long array of nothing": "x/Nothing[1000000000] data",
    "sequence of nothing": "x/Nothing[] data",
    "of itself": "x/Loop data",
    "no definition": "((((((",
    "code": "string A=1)]; import os; os.abort() #",
}


@pytest.mark.parametrize("name", DEFINITIONS)
def test_definitions_of_messages_are_bounded_too(name: str, tmp_path: Path) -> None:
    raw = struct.pack("<4xiIIII", 1, 0, 1, 0, 0xFFFFFFFF)
    path = mcap_of(tmp_path / "a.mcap", HEADER.format(DEFINITIONS[name]), raw)
    with pytest.raises(InputError, match=r"a\.mcap"):
        [scan.read() for scan in open_scans(path)]


BAD = DATA.parent / "bad_input"
MEASURED = """
import json, resource, sys, time
from clearway.cli.app import main
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
sys.argv[0] = "clearway"
try:
    main()
except SystemExit as end:
    status = end.code or 0
used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
# Not ru_maxrss, which a process has from the one that it was forked from.
own_kb = next(int(line.split()[1]) for line in open("/proc/self/status") if "VmHWM" in line)
told = [status, max(own_kb, used[1].ru_maxrss), sum(one.ru_utime for one in used)]
print("measured", *told, file=sys.stderr)
"""


def measured(*words: object, cwd: Path) -> tuple[int, float, float, str]:
    """Exit status, largest size in MB of a process, processor time in s, and messages."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, *map(str, words)],
        cwd=cwd, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    said, _, numbers = done.stderr.rpartition("measured ")
    status, size_kb, cpu_s = map(float, numbers.split())
    return int(status), size_kb / 1000, cpu_s, said


@pytest.mark.skipif(not BAD.is_dir(), reason="needs data: no folder bad_input beside the checkout")
@pytest.mark.parametrize("name", ["endless_view.db3", "blob_view_900MB.db3", "bomb_honest.mcap"])
def test_recordings_that_once_took_everything(name: str, tmp_path: Path) -> None:
    words = ("assess", "--scan", BAD / name, "--no-plots", "--out", "out")
    status, size_mb, cpu_s, said = measured(*words, cwd=tmp_path)
    assert status == 2
    assert name in said
    assert "Traceback" not in said
    assert size_mb < 1000
    assert cpu_s < 30


def test_results_that_unpack_to_far_more_than_they_take_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    from clearway.studies.campaigns.results import read_results

    path = tmp_path / "results.parquet"
    zeros = pyarrow.table({"planner": pyarrow.array(np.zeros(LARGE // 8))})
    parquet.write_table(zeros, path, compression="zstd")
    assert path.stat().st_size < LARGE / 100
    monkeypatch.setattr("clearway.io.apart.MEMORY_BYTES", 200_000_000)
    with pytest.raises(InputError, match=r"results\.parquet"):
        read_results(path)
