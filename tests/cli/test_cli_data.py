"""Public files come whole and with their hash, or not at all, and what is wrong is told."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from clearway.base.errors import InputError
from clearway.io import public_data
from clearway.io.public_data import FILES, PublicFile, fetch_file, where_from
from clearway.missions.world_file import read_mission
from in_process import clearway
from repository import REPOSITORY

CONTENT = bytes(range(256)) * 1000
GETS = "`clearway data --fetch DIR` gets"


class Source(BaseHTTPRequestHandler):
    """A source that is good, lies, breaks off, or has nothing."""

    def do_GET(self) -> None:
        if self.path == "/absent":
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Length", str(len(CONTENT)))
        self.end_headers()
        if self.path == "/other":
            self.wfile.write(CONTENT[::-1])
        else:
            self.wfile.write(CONTENT[: len(CONTENT) // 2 if self.path == "/cut" else None])

    def log_message(self, *given: object) -> None:
        del given


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Source)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def public(address: str, name: str = "lidar/a.las") -> PublicFile:
    return PublicFile(
        name, address, hashlib.sha256(CONTENT).hexdigest(), len(CONTENT), "MIT", "a", "b"
    )


def files(folder: Path) -> list[str]:
    return [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]


def test_a_file_comes_whole_and_once(address: str, tmp_path: Path) -> None:
    came: list[int] = []
    assert fetch_file(public(f"{address}/good"), tmp_path, came.append)
    assert (tmp_path / "lidar/a.las").read_bytes() == CONTENT
    assert sum(came) == len(CONTENT)
    assert not fetch_file(public("http://127.0.0.1:1/nobody"), tmp_path)
    assert files(tmp_path) == ["lidar/a.las"]


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("/cut", "cut off after 128,000"),
        ("/other", "gives another file .* nothing of it was kept"),
        ("/absent", "404"),
    ],
)
def test_what_is_wrong_is_told_and_nothing_kept(
    address: str, path: str, told: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=told):
        fetch_file(public(address + path), tmp_path)
    assert files(tmp_path) == []


def test_a_damaged_file_is_brought_anew(address: str, tmp_path: Path) -> None:
    (tmp_path / "lidar").mkdir()
    (tmp_path / "lidar" / "a.las").write_bytes(CONTENT[:100])
    assert fetch_file(public(f"{address}/good"), tmp_path)
    assert (tmp_path / "lidar/a.las").read_bytes() == CONTENT


def test_without_a_network_it_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot be fetched from .* put it there by hand"):
        fetch_file(public("http://127.0.0.1:1/nobody"), tmp_path)
    assert files(tmp_path) == []


def test_an_interruption_leaves_nothing_half(address: str, tmp_path: Path) -> None:
    def interrupt(_more: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fetch_file(public(f"{address}/good"), tmp_path, interrupt)
    assert files(tmp_path) == []


def test_the_command_brings_what_it_can_and_tells_the_rest(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = (public(f"{address}/good"), public(f"{address}/cut", "maps/b.tif"))
    monkeypatch.setattr(public_data, "FILES", known)
    done = clearway("data", "--fetch", tmp_path, "--json")
    assert done.exit_code == 2
    assert "lidar/a.las: fetched" in done.stderr
    assert "maps/b.tif: cut off" in done.stderr
    assert files(tmp_path) == ["lidar/a.las"]
    done = clearway("data", "--fetch", tmp_path, "--only", "a.las", "--json")
    assert (done.exit_code, json.loads(done.stdout)["files"][0]["there"]) == (0, True)


def test_the_list_has_source_licence_and_hash_of_each() -> None:
    told = json.loads(clearway("data", "--json").stdout)["files"]
    assert [one["name"] for one in told] == [one.name for one in FILES]
    for one in told:
        assert one["address"].startswith("https://")
        assert len(one["sha256"]) == 64
        assert one["licence"]
        assert one["used_by"]


def test_the_list_is_of_the_files_that_are_at_hand(data_dir: Path) -> None:
    for one in FILES:
        if (data_dir / one.name).is_file():
            assert public_data.is_there(one, data_dir), one.name
            assert (data_dir / one.name).stat().st_size == one.size


def test_what_needs_a_public_file_says_how_to_get_it(tmp_path: Path) -> None:
    mission = REPOSITORY / "examples" / "missions" / "tree-and-building.toml"
    (tmp_path / "tree.toml").write_text(mission.read_text())
    with pytest.raises(InputError, match="clearway data --fetch DIR"):
        read_mission(tmp_path / "tree.toml")
    assert where_from("somebody's.las") == ""


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("risk", "daa/em-models/uncor_1200only_fwse_v1p2.txt"),
        ("traffic", "adsb/tracks_brc_20min_20230830.jsonl"),
        ("assess --no-plots --scan", "lidar/ouster/OS-1-128_v2.3.0_1024x10_lb_n3.pcap"),
    ],
)
def test_commands_find_a_public_file_by_its_name_or_say_how_to_get_it(
    command: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(public_data.FOLDER, raising=False)
    words = (*command.split(), Path(name).name)
    done = clearway(*words, cwd=tmp_path)
    assert done.exit_code == 2
    assert f"no such file; it is public and no part of clearway: {GETS} {name}" in done.stderr
    # One that is there, and is none: what is said is about its content.
    kept = tmp_path / "kept" / name
    kept.parent.mkdir(parents=True)
    kept.write_bytes(b"nothing of the kind\n")
    monkeypatch.setenv(public_data.FOLDER, str(tmp_path / "kept"))
    done = clearway(*words, cwd=tmp_path)
    assert done.exit_code == 2
    assert "no such file" not in done.stderr
    assert str(kept) in done.stderr


def test_public_files_are_looked_for_in_the_folder_of_data_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept" / "lidar" / "aerial" / "nebraska_tree_building.las"
    asked = tmp_path / "shared" / kept.name
    monkeypatch.delenv(public_data.FOLDER, raising=False)
    kept.parent.mkdir(parents=True)
    kept.write_bytes(b"")
    assert public_data.at_hand(asked) == asked
    monkeypatch.setenv(public_data.FOLDER, str(tmp_path / "kept"))
    assert public_data.at_hand(asked) == kept
    assert public_data.at_hand(tmp_path / "own.las") == tmp_path / "own.las"
    asked.parent.mkdir()
    asked.write_bytes(b"")
    assert public_data.at_hand(asked) == asked


@pytest.mark.parametrize(
    "name", ["tree-and-building", "power-line", "delft-streets", "cologne-masts"]
)
def test_examples_fly_from_anywhere_by_the_folder_of_data(
    name: str, tmp_path: Path, data_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / f"{name}.toml"
    copy.write_text((REPOSITORY / "examples" / "missions" / copy.name).read_text())
    monkeypatch.setenv(public_data.FOLDER, str(data_dir))
    file = read_mission(copy)
    named = file.map.files if file.map else (file.point_cloud.file,)
    assert all(Path(one).is_relative_to(data_dir) for one in named)
