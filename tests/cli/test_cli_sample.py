"""Every format has a sample; the same seed writes the same files; every command takes its own."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import shlex
from pathlib import Path

import pytest
from tools.transcripts import BLOCK, pages

from clearway.io.foreign import read_json
from clearway.io.maps.json_sequence import read_sequence
from clearway.io.maps.map_formats import JSON_FORMATS, SEQUENCES
from clearway.io.maps.map_formats import MAP_FORMATS as MAPS
from clearway.io.poses.pose_file import POSE_FORMATS as POSES
from clearway.io.results_folder import LIST
from clearway.io.scans.scan_formats import SCAN_FORMATS as SCANS
from clearway.io.traffic.traffic_formats import TRAFFIC_FORMATS as TRAFFIC
from clearway.missions.planned import FORMATS as PLANS
from clearway.studies.samples import SAMPLES
from in_process import clearway
from repository import REPOSITORY

LONG = ("campaign", "compare", "risk")
"""Commands that fly more than once, or long: a night run tries them too."""
SLOW = ("survey-mission.toml", "way.kml", "dji.kmz", "N50E008.hgt")
DRAWS = ("assess", "fly", "map", "compare")
COMMANDS = [one.command for one in SAMPLES if one.command]
SHOWN = {
    re.sub(r" --no-plots| \|.*| 2>.*", "", block[1])
    for text in pages().values()
    for block in BLOCK.finditer(text)
}
"""Commands that pages show: `tests/house/test_transcripts.py` runs them, and reads the result."""


def hashes(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples") / "made"
    done = clearway("sample", folder, "--json")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["left_out"] == {}
    assert [one["file"] for one in told["samples"]] == [one.name for one in SAMPLES]
    return folder


@pytest.mark.nightly
def test_the_same_seed_writes_the_same_files_and_another_one_others(
    samples: Path, tmp_path: Path
) -> None:
    before = hashes(samples)
    clearway("sample", tmp_path / "again")
    assert hashes(tmp_path / "again") == before
    clearway("sample", tmp_path / "other", "--seed", "1")
    other = hashes(tmp_path / "other")
    assert other.keys() == before.keys()
    assert other["sweep.pcd"] != before["sweep.pcd"]


def test_what_names_another_sample_is_written_only_where_that_one_is(samples: Path) -> None:
    named = [
        (one, other)
        for one in SAMPLES
        if one.name.endswith((".toml", ".yaml"))
        for other in SAMPLES
        if f'"{other.name}"' in (samples / one.name).read_text()
    ]
    assert named
    assert [(a.name, b.name) for a, b in named if b.needs not in ("", a.needs)] == []


def test_the_page_tells_every_command(samples: Path) -> None:
    page = (samples / "README.md").read_text()
    assert [command for command in COMMANDS if f"`{command}`" not in page] == []
    assert (samples / "commands.txt").read_text().splitlines() == COMMANDS


def test_results_that_are_there_are_not_mixed_with_samples(samples: Path, tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("{}")
    done = clearway("sample", tmp_path)
    assert done.exit_code == 2
    assert "is there already" in done.stderr
    assert (samples / LIST).exists()


def test_what_another_hand_wrote_or_changed_stays(tmp_path: Path) -> None:
    (tmp_path / "my-scene.toml").write_text("# mine\n")
    done = clearway("sample", tmp_path)
    assert done.exit_code == 2
    assert "my-scene.toml: another hand wrote or changed what is there" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["my-scene.toml"]
    (tmp_path / "my-scene.toml").unlink()
    assert clearway("sample", tmp_path).exit_code == 0
    assert clearway("sample", tmp_path, "--seed", "1").exit_code == 0, "nobody touched any"
    for name in ("my-mission.toml", "README.md"):
        (tmp_path / name).write_text("# mine\n")
    done = clearway("sample", tmp_path)
    assert done.exit_code == 2
    assert " and 1 more: another hand" in done.stderr
    assert (tmp_path / "my-mission.toml").read_text() == "# mine\n"


@pytest.mark.parametrize("suffix", [suffix for one in SCANS for suffix in one.suffixes])
def test_every_format_of_scans_has_a_sample(suffix: str, samples: Path) -> None:
    if suffix not in (".xyz", ".txt"):  # tables by other names
        assert list(samples.rglob(f"*{suffix}"))


@pytest.mark.parametrize("form", TRAFFIC, ids=lambda form: form.name)
def test_every_kind_of_traffic_has_a_sample(form: object, samples: Path) -> None:
    names = [one.name for one in SAMPLES if one.kind == "traffic"]
    contents = [(samples / name).read_bytes() for name in names]
    contents = [gzip.decompress(one) if one[:2] == b"\x1f\x8b" else one for one in contents]
    assert form in [
        next((one for one in TRAFFIC if one.recognises(each)), None) for each in contents
    ]


@pytest.mark.parametrize("suffix", [suffix for one in MAPS for suffix in one.suffixes])
def test_every_suffix_of_maps_has_a_sample(suffix: str, samples: Path) -> None:
    if suffix not in (".tsv", ".tiff", ".ndjson", ".dt1", ".dt2"):  # the same by other names
        assert list(samples.glob(f"*{suffix}"))


@pytest.mark.parametrize("form", JSON_FORMATS, ids=lambda form: form.name)
def test_every_kind_of_map_in_json_has_a_sample(form: object, samples: Path) -> None:
    files = [samples / one.name for one in SAMPLES if one.kind == "map" and "json" in one.name]
    read = [read_sequence(one) if one.suffix in SEQUENCES else read_json(one) for one in files]
    assert form in [
        next((one for one in JSON_FORMATS if one.recognises(each)), None) for each in read
    ]


def test_every_kind_of_plans_and_poses_has_a_sample() -> None:
    names = [one.name for one in SAMPLES]
    assert all(any(name.endswith(one.suffix) for name in names) for one in PLANS)
    assert all(one.example in names for one in POSES)


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(command, marks=pytest.mark.nightly)
        if command.split()[1] in LONG or command.endswith(SLOW) or command in SHOWN
        else command
        for command in COMMANDS
    ],
)
def test_every_command_takes_its_sample(command: str, samples: Path, tmp_path: Path) -> None:
    words = shlex.split(command)[1:]
    out = () if words[0] in ("traffic", "map", "ros2", "guard") else ("--out", tmp_path / "out")
    done = clearway(*words, *out, *(["--no-plots"] if words[0] in DRAWS else []), cwd=samples)
    # A small study shows nothing, which is no success either.
    assert done.exit_code in ((0, 1, 3) if words[0] in LONG else (0,)), done.stderr
    assert done.stdout.strip()
    assert "truncated" not in done.stderr


def test_a_guardian_lets_the_recorded_commands_through_until_the_house_is_near(
    samples: Path,
) -> None:
    done = clearway("guard", "guarded.yaml", "--bag", "commanded", "--json", cwd=samples)
    told = json.loads(done.stdout)
    assert told["wishes"] == 35
    assert told["passed"] >= 20
    assert told["replaced"] >= 3
    assert not told["missing"]


def test_the_plant_is_that_of_the_example(samples: Path) -> None:
    shown = (REPOSITORY / "examples" / "own_plant.py").read_text()
    assert (samples / "own_plant.py").read_text().partition("class")[2].strip() in shown
