"""Files that nothing damaged, but somebody made: schemas that compute, nothing packed, links."""

from __future__ import annotations

import gzip
import json
import sqlite3
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from random import Random

from tools.fuzz.mutate import mutated
from tools.fuzz.texts import SCENES

ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT "
MINE = b"mine"
"""What lies outside of the folder of results, and must stay."""
NAMES = ("scene.toml", "result.json", "inner/mine.txt", "link.txt", "inner", "hard.txt",
         "deep/inner/mine.txt", "deep", ".clearway.json", "result.json/x", "absent", "x" * 300,
         "../home/mine.txt", "/etc/hostname", ".", "", "a\0b", "\ud800")  # fmt: skip
INSIDE = 12
"""So many of them are names within the folder."""


def schema_changed(data: bytes, random: Random, others: tuple[bytes, ...]) -> bytes:
    """A SQLite file whose tables became views, virtual tables, or compute their columns."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.db"
        path.write_bytes(data)
        base = sqlite3.connect(path)
        base.execute("PRAGMA writable_schema = ON")
        try:
            found = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
            for _ in range(random.choice((1, 1, 2))):
                _change_schema(base, random, random.choice(found)[0])
            base.commit()
        except sqlite3.Error:
            base.rollback()  # Not every change can follow another.
        base.close()
        changed = path.read_bytes()
    return mutated(changed, random, others) if random.random() < 0.3 else changed


def _change_schema(base: sqlite3.Connection, random: Random, name: str) -> None:
    columns = [row[1] for row in base.execute(f'PRAGMA table_info("{name}")')]
    some = random.choice(columns)
    view = random.choice((
        f"{ENDLESS}o.* FROM n, old AS o",
        f"{ENDLESS}" + ", ".join(f'x AS "{one}"' for one in columns) + " FROM n",
        "SELECT " + ", ".join(
            f'zeroblob({random.choice((1, 10**6, 9 * 10**8))}) AS "{one}"' if one == some
            else f'"{one}"' for one in columns) + " FROM old",
        "SELECT a.* FROM old a, old b, old c, old d, old e, old f, old g, old h",
        "SELECT load_extension('x') AS y, * FROM old",
        "SELECT * FROM old WHERE hex(zeroblob(1000000)) LIKE '%0%0%0%0%0%0%0%0%0%1'",
    ))  # fmt: skip
    match random.randrange(6):
        case 0 | 1 | 2:
            base.execute(f'ALTER TABLE "{name}" RENAME TO old')
            base.execute(f'CREATE VIEW "{name}" AS {view}')
            if random.random() < 0.5:
                lie = "UPDATE sqlite_master SET type = 'table', rootpage = ? WHERE type = 'view'"
                base.execute(lie, (random.choice((0, 1, 2, 9)),))
        case 3:
            base.execute(f'ALTER TABLE "{name}" RENAME TO old')
            kind = random.choice(("fts5", "rtree", "fts4"))
            base.execute(f'CREATE VIRTUAL TABLE "{name}" USING {kind}({", ".join(columns)})')
        case 4:
            worth = random.choice(
                ("zeroblob(900000000)", "hex(zeroblob(99999999))", "randomblob(9)")
            )
            base.execute(f'ALTER TABLE "{name}" ADD COLUMN made AS ({worth})')
        case _:
            values = (random.choice((None, 10**18, b"x" * 9000, "y", -1.5)),)
            base.execute(f'UPDATE "{name}" SET "{some}" = ?', values)


def members(data: bytes, random: Random, others: tuple[bytes, ...]) -> bytes:
    """A gzip file of very many members, most of them empty."""
    plain = gzip.decompress(data)
    size = random.choice((1, 7, 100, len(plain)))
    pieces = [plain[at : at + size] for at in range(0, min(len(plain), 4000 * size), size)]
    empty = gzip.compress(b"", mtime=0) * random.choice((0, 1, 3000, 30_000))
    whole = empty + b"".join(gzip.compress(one, mtime=0) for one in pieces) + empty
    return mutated(whole, random, others) if random.random() < 0.5 else whole


def chunks_lying(data: bytes, random: Random, others: tuple[bytes, ...]) -> bytes:
    """An MCAP file whose records tell other lengths, sizes and ways of packing than they have."""
    changed = bytearray(data)
    chunks, at = [], 8
    while at + 9 < len(changed):
        (length,) = struct.unpack_from("<Q", changed, at + 1)
        if changed[at] == 6:
            chunks.append(at)
        at += 9 + length
    for at in random.sample(chunks, min(len(chunks), random.choice((1, 2)))):
        size = random.choice((0, 1, 10**6, 10**9, 2**40, 2**63, 2**64 - 1))
        match random.randrange(4):
            case 0:
                struct.pack_into("<Q", changed, at + 25, size)
            case 1:
                struct.pack_into("<Q", changed, at + 1, size)
            case 2:
                changed[at + 41 : at + 45] = random.choice(
                    (b"lz4\0", b"none", b"\0\0\0\0", b"ZSTD")
                )
            case _:
                struct.pack_into("<I", changed, at + 33, random.choice((0, 1, 0xFFFFFFFF)))
    return mutated(bytes(changed), random, others) if random.random() < 0.3 else bytes(changed)


def packed_nothing(folder: Path) -> list[bytes]:
    """MCAP files of clouds that hold no point, and of one that unpacks to 200 MB of zeros."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/PointCloud2"
    text, _ = store.generate_msgdef(kind, ros_version=2)
    found = []
    for size in (0, 4, 60, 100_000_000):
        with (folder / "a.mcap").open("wb") as file:
            writer = Writer(file)
            writer.start("ros2")
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channel = writer.register_channel("/points", "cdr", schema)
            for n in range(2):
                writer.add_message(channel, n, b"\0\1\0\0" + bytes(size), n)
            writer.finish()
        found.append((folder / "a.mcap").read_bytes())
    return found


def lists(_folder: Path) -> list[bytes]:
    """What tells of the results of an earlier run, for `planted`."""
    told = {"schema_version": 1, "command": "assess", "of": "damaged-file", "files": NAMES[:3]}
    return [json.dumps(told).encode()]


def list_changed(data: bytes, random: Random, others: tuple[bytes, ...]) -> bytes:
    """A list of other names."""
    told = json.loads(data)
    names = NAMES if random.random() < 0.2 else NAMES[:INSIDE]
    told["files"] = [random.choice(names) for _ in range(random.choice((0, 1, 3, 9)))]
    changed = json.dumps(told).encode()
    return mutated(changed, random, others) if random.random() < 0.3 else changed


def planted(folder: Path, data: bytes) -> None:
    """A folder of results with such a list, whose links lead to what is not in it."""
    home, out = folder / "home", folder / "out"
    (out / "deep").mkdir(parents=True)
    home.mkdir()
    (home / "mine.txt").write_bytes(MINE)
    for name in ("inner", "deep/inner"):
        (out / name).symlink_to(home)
    for name in ("link.txt", "result.json"):
        (out / name).symlink_to(home / "mine.txt")
    (out / "hard.txt").hardlink_to(home / "mine.txt")
    (out / ".clearway.json").write_bytes(data)
    (folder / "damaged-file.toml").write_text(SCENES[0])


def is_intact(folder: Path) -> bool:
    """Whether what `planted` put outside of the folder of results is as it was."""
    home = folder / "home"
    return [one.name for one in home.iterdir()] == ["mine.txt"] and (
        home / "mine.txt"
    ).read_bytes() == MINE


Damage = Callable[[bytes, Random, tuple[bytes, ...]], bytes]
