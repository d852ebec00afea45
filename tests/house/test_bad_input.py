"""Files that once ended, blocked or filled the program, and own ones of their kinds, through it."""

from __future__ import annotations

import gzip
import os
import shutil
import socket
import struct
from pathlib import Path

import numpy as np
import pytest
from tools.fuzz.judge import Outcome, faults
from tools.fuzz.made import DATA, real
from tools.fuzz.run import called, tried, whole_files
from tools.fuzz.seeds import FORMATS, SMALL

from own_process import run_clearway

BAD = DATA.parent / "bad_input"
COMMANDS = {
    ".toml": ("mission", "scene", "campaign"),
    ".csv": ("point-table", "obstacle-table", "mode-s-hex"),
    ".txt": ("poses", "point-table", "encounter-model", "sbs", "waypoints"),
    ".laz": ("laz", "replay"),
    ".las": ("las",),
    ".pcd": ("pcd",),
    ".npy": ("npy",),
    ".mcap": ("replay", "mcap"),
    ".ulg": ("poses-ulog", "traffic-ulog"),
    ".tif": ("terrain",),
    ".daa": ("daa",),
    ".geojson": ("geojson",),
    ".pcap": ("pcap",),
    ".bag": ("bag",),
    ".db3": ("db3", "gpkg"),
    ".gz": ("traffic-gzip",),
    ".jsonl": ("aircraft-json", "geojson"),
    ".json": ("cityjson", "trajectories"),
}
"""Every command that could take a file, by formats of the fuzzer."""


def bad_files() -> list[Path]:
    return sorted(BAD.iterdir()) if BAD.is_dir() else []


@pytest.mark.nightly
@pytest.mark.parametrize("path", bad_files(), ids=lambda path: path.name)
def test_files_that_once_went_wrong(path: Path, tmp_path: Path) -> None:
    for name in COMMANDS[path.suffix]:
        form = FORMATS[name]
        folder = tmp_path / name
        folder.mkdir()
        for one in BAD.glob(f"{path.stem}.*"):
            shutil.copy(one, folder)
        shutil.copy(path, folder / f"{path.stem}{form.suffix}")
        (folder / "scan.bin").write_bytes(whole_files("kitti")[0])
        place = folder / f"{path.stem}{form.suffix}"
        words = [word.format(place, stem=str(place.with_suffix(""))) for word in form.command]
        outcome = called(words, folder)
        # Names of these files hold the word.
        printed = outcome.errors.replace(path.stem, "the-file")
        outcome = outcome._replace(errors=printed, output=outcome.output.replace(path.stem, ""))
        assert not faults(outcome, ("the-file",)), (name, outcome)


def test_the_folder_of_bad_files_is_here() -> None:
    if not bad_files():
        pytest.skip("needs data: no folder bad_input beside the data folder")


def laz_that_promises(count: int) -> bytes:
    data = bytearray(whole_files("laz")[0])
    struct.pack_into("<Q", data, 247, count)
    return bytes(data)


def zipped_points() -> bytes:
    head = (
        b"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        b"WIDTH 99999999999999999999\nHEIGHT 1\nPOINTS 99999999999999999999\nDATA binary\n"
    )
    return head + bytes(1200)


DIGITS = b"9" * 5000
OWN = {
    "toml-integer": ("mission", b"[mission]\nname = " + DIGITS + b"\n"),
    "toml-integer-in-scene": ("scene", b"[grid]\nlayers = " + DIGITS + b"\n"),
    "toml-wide": ("scene", b"[grid]\nlayers = 9999999999999999999999\nrange_m = 1e300\n"),
    "toml-deep": ("scene", b"a = " + b"[" * 5000 + b"]" * 5000),
    "toml-many-problems": ("scene", b"\n".join(b"key%d = 1" % n for n in range(2000))),
    "toml-control": ("scene", b'["\\u001b[31mred\\u0007"]\nx = 1\n'),
    "mission-huge": (
        "mission",
        b'[mission]\nname = "x"\nwaypoints_m = [[1e308, 0, 0]]\n[grid]\nelevation_deg = 1e308\n',
    ),
    "campaign-many": (
        "campaign",
        b'name = "x"\nseeds = 999999999\nplanners = ["clearway"]\n[[family]]\nfamily = "balls"\n',
    ),
    "pcd-count": ("pcd", zipped_points()),
    "pcd-digits": ("pcd", zipped_points().replace(b"99999999999999999999", DIGITS)),
    "pcd-control": ("pcd", zipped_points().replace(b"DATA binary", b"DATA \x1b[31mred")),
    "laz-count": ("laz", laz_that_promises(2**40) if whole_files("laz") else b""),
    "npy-nan": ("npy", whole_files("npy")[0][:128] + np.full(375, 1e308).tobytes()),
    "poses-inf": ("poses", b"inf 0 0 0 0 1 0 0 0 0 1 0\n" * 3),
    "table-nothing": ("point-table", b"\x00\x01\x02"),
    "json-deep": ("geojson", b"[" * 100_000),
    "json-integer": ("geojson", b'{"type": "FeatureCollection", "features": ' + DIGITS + b"}"),
    "json-surrogate": ("trajectories", b'[{"icao24": "\\ud800", "latitude": "\\u001b[2J"}]'),
    "gzip-bomb": ("traffic-gzip", gzip.compress(bytes(100_000_000), 9)),
    "obstacles-control": ("obstacle-table", b"name,\x1b]0;title\x07\n1,2\n"),
    "plan-null": ("plan", b'{"fileType": "Plan", "mission": null}'),
    "empty-run": ("replay", b"\x89MCAP0\r\n" * 2),
}


@pytest.mark.parametrize("kind", sorted(OWN))
def test_made_files_of_the_same_kinds(kind: str) -> None:
    name, data = OWN[kind]
    outcome, found = tried(name, data)
    assert not found, outcome
    assert outcome.status == 2, outcome


def test_ouster_metadata_that_end_the_library() -> None:
    whole = real("lidar/ouster/OS-0*.json", most=10**6)
    if not whole:
        pytest.skip("needs data: no Ouster recording")
    for data in (
        whole[0].replace(b'"columns_per_packet": 16', b'"columns_per_packet": 0'),
        whole[0].replace(b'"pixels_per_column": 128', b'"pixels_per_column": 2000000000'),
        b"{}",
    ):
        outcome, found = tried("pcap-json", data)
        assert not found, outcome
        assert outcome.status == 2, outcome


@pytest.mark.parametrize(
    "words",
    [
        ("assess", "--scan", "{}", *SMALL, "--no-plots"),
        ("assess", "{}"),
        ("assess", "--scan", "scan.bin", "--poses", "{}", *SMALL, "--no-plots"),
        ("map", "{}", "--no-plots"),
        ("traffic", "{}"),
        ("fly", "{}", "--no-plots"),
        ("campaign", "{}"),
        ("risk", "{}"),
        ("replay", "{}", "--html", "page.html"),
    ],
    ids=lambda words: "-".join(words[:2]),
)
@pytest.mark.parametrize("kind", ["pipe", "socket", "device", "folder", "latin"])
def test_what_is_no_file_never_blocks(words: tuple[str, ...], kind: str, tmp_path: Path) -> None:
    (tmp_path / "scan.bin").write_bytes(whole_files("kitti")[0])
    name = "odd.toml" if words[0] in ("fly", "campaign") else "odd.csv"
    path = tmp_path / name
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "latin":
        path = tmp_path / os.fsdecode(b"odd-\xfc\xff.csv")
        path.write_bytes(b"1,2,3\n")
    server = socket.socket(socket.AF_UNIX)
    try:
        if kind == "socket":
            server.bind(str(path))
        outcome = called([word.format(path) for word in words], tmp_path)
    finally:
        server.close()
    assert not faults(outcome, ("odd",)), outcome
    assert outcome.status == 2


def test_pipes_that_files_name_never_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    os.mkfifo(tmp_path / "pipe.plan")
    mission = '[mission]\nname = "x"\nwaypoints_m = [[3, 0, 0]]\n'
    for text in (
        mission + '[map]\nfiles = ["pipe.csv"]\n',
        mission + '[point_cloud]\nfile = "pipe.csv"\n',
        '[mission]\nplan = "pipe.plan"\n',
    ):
        (tmp_path / "odd.toml").write_text(text)
        outcome = called(["fly", str(tmp_path / "odd.toml"), "--no-plots"], tmp_path)
        assert outcome.status == 2, outcome
        assert not faults(outcome, ("odd", "pipe")), outcome


def test_the_program_itself_shows_no_traceback_and_no_warning(tmp_path: Path) -> None:
    """What nobody foresaw is one line, with a status of its own."""
    (tmp_path / "scan.csv").write_text("1,2,3\n")
    done = run_clearway(
        "assess",
        "--scan",
        tmp_path / "scan.csv",
        cwd=tmp_path,
        absent="clearway.missions.scene_result",
    )
    assert done.returncode == 70
    outcome = Outcome(2, done.stdout, done.stderr)
    assert faults(outcome, ("scan.csv",)) == ["traceback"]
    assert "Traceback (most" not in done.stderr
