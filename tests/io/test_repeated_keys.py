"""Keys that an object of JSON has more than once: which value counts, nobody knows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.samples import plans, traffic
from clearway.io.traffic.traffic import read_traffic
from in_process import clearway

MAST = (
    '{"type": "Feature", "properties": {"height": 40, "height": 4}, '
    '"geometry": {"type": "Point", "coordinates": [14.5, 46.05]}}'
)
STATES = '{"time": 1, "states": [], "time": 2}'
ROW = '{"now": 10, "hex": "4b1801", "lat": 46.05, "lon": 14.5, "alt_baro": 3000}\n'
TWICE = ROW.replace('"alt_baro"', '"lat": 47.0, "alt_baro"')


@pytest.mark.parametrize(
    ("command", "name", "content", "key"),
    [
        ("map", "a.geojson", f'{{"type": "FeatureCollection", "features": [{MAST}]}}', "height"),
        ("map", "a.geojsonl", MAST, "height"),
        ("map", "a.json", '{"type": "CityJSON", "version": "2.0", "type": "x"}', "type"),
        ("traffic", "a.json", STATES, "time"),
        ("traffic", "a.jsonl", TWICE, "lat"),
        ("traffic", "a.jsonl", ROW + TWICE, "lat"),
        (
            "traffic",
            "a.json",
            '{"icao": "4b1801", "timestamp": 1, "trace": [], "icao": ""}',
            "icao",
        ),
    ],
)
def test_a_file_with_a_key_twice_is_refused(
    tmp_path: Path, command: str, name: str, content: str, key: str
) -> None:
    (tmp_path / name).write_text(content)
    options = ("--no-plots",) if command == "map" else ()
    done = clearway(command, name, *options, cwd=tmp_path)
    assert done.returncode == 2, done.stdout
    assert done.stderr.startswith(f"{name}: ")
    assert f"key {key!r} is there more than once in the same object" in done.stderr


def test_the_values_and_the_line_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.jsonl").write_text(ROW + TWICE)
    with pytest.raises(InputError, match=r"a\.jsonl: line 2: .*\(46\.05 and 47\.0\)"):
        read_traffic(tmp_path / "a.jsonl")


def test_a_plan_with_a_key_twice_is_refused(tmp_path: Path) -> None:
    plans.write_plan_sample(tmp_path / "a.plan", np.random.default_rng(0))
    content = (tmp_path / "a.plan").read_text()
    twice = content.replace('"fileType"', '"version": 9, "fileType"', 1)
    assert twice != content
    (tmp_path / "a.plan").write_text(twice)
    done = clearway("fly", "a.plan", "--no-plots", "--no-mcap", cwd=tmp_path)
    assert done.returncode == 2
    assert "a.plan: key 'version' is there more than once" in done.stderr


def test_columns_with_a_key_twice_are_refused(tmp_path: Path) -> None:
    traffic.write_trajectory_columns(tmp_path / "a.json", np.random.default_rng(0))
    content = (tmp_path / "a.json").read_text()
    (tmp_path / "a.json").write_text(content.rstrip().removesuffix("}") + ', "icao24": {}}')
    with pytest.raises(InputError, match="key 'icao24' is there more than once"):
        read_traffic(tmp_path / "a.json")


def test_the_same_key_in_several_objects_is_no_repetition(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps([json.loads(ROW), json.loads(ROW) | {"now": 11}]))
    assert len(read_traffic(tmp_path / "a.json").reports) == 2
