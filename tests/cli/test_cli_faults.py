"""`clearway faults`: ways out that are flown, what came of flights, and what the page says."""

import csv
import json
import re
from pathlib import Path

import pytest

from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.studies import faults
from clearway.studies.faults import ESCAPE, STUDIES, FaultFlight, Point, fly_one
from in_process import clearway

REPOSITORY = Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "docs" / "results" / "faults.md"
MARKED = "# Page\n<!-- faults-{0}:begin -->\nold\n<!-- faults-{0}:end -->\nend\n"
ROW = re.compile(r"^\| ([^|]+) \| ([^|]+) \| ([^|]+) \| (-?[\d.]+: [^|]+) \|$", re.MULTILINE)
FAULT, VARIANT = "report-loss", "tracker"


def flown_as(*outcomes, mode="strict"):
    """One level, with flights of which came what."""

    def fly_studies(names, seeds, *rest):
        flights = tuple(
            FaultFlight(seed, outcome, outcome in ("safe", "margin lost"), 1.0, mode)
            for seed, outcome in zip(seeds, outcomes, strict=True)
        )
        return [Point(names[0], VARIANT, 0.5, rest[-1], flights)]

    return fly_studies


def told(monkeypatch, tmp_path, *outcomes, mode="strict", more=()):
    monkeypatch.setattr(faults, "fly_studies", flown_as(*outcomes, mode=mode))
    out = ("--out", tmp_path / "out", "--flights", len(outcomes), "--workers", 1)
    return clearway("faults", FAULT, *out, *more, cwd=tmp_path)


def test_the_default_is_that_of_a_mission_file():
    assert ESCAPE == MissionFile.model_fields["safety"].default.escape == "strict"
    assert "default: strict" in clearway("faults", "--help").stdout


@pytest.mark.parametrize(
    ("outcomes", "status"),
    [
        (("safe", "safe"), 0),
        (("safe", "not reached"), 0),
        (("safe", "margin lost"), 1),
        (("not reached", "crashed"), 1),
    ],
)
def test_a_flight_that_holds_safely_is_safe(monkeypatch, tmp_path, outcomes, status):
    assert told(monkeypatch, tmp_path, *outcomes).returncode == status


def test_what_came_of_flights_is_told_in_full(monkeypatch, tmp_path):
    outcomes = ("safe", "not reached", "safe", "margin lost", "crashed", "crashed")
    done = told(monkeypatch, tmp_path, *outcomes, more=("--json", "--escape", "known"))
    result = json.loads(done.stdout)
    (point,) = result["points"]
    assert result["escape_asked"] == point["escape_asked"] == "known"
    assert point["escape_mode"] == "strict"
    counts = ("kept", "not_reached", "margin_lost", "crashed", "margin_kept", "reached", "flights")
    assert [point[name] for name in counts] == [2, 1, 1, 2, 3, 3, 6]
    assert (point["not_kept"], point["unsafe"]) == ([1, 3, 4, 5], [3, 4, 5])
    written = json.loads((tmp_path / "out" / "faults.json").read_text())
    assert written["points"] == result["points"]
    with (tmp_path / "out" / "faults.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["outcome"] for row in rows] == list(outcomes)
    assert {(row["escape_asked"], row["escape_mode"]) for row in rows} == {("known", "strict")}


def test_table_and_page_say_which_ways_out_were_flown(monkeypatch, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(MARKED.format("strict"))
    outcomes = ("safe", "not reached", "margin lost", "crashed")
    done = told(monkeypatch, tmp_path, *outcomes, mode="known", more=("--docs", page))
    for text in (done.stdout, page.read_text()):
        assert "0.5: 1, 1 crashed, 1 lost the margin" in text
        assert "Reports of traffic lost: share (flown as known)" in text
    assert '4 flights at each level, escape = "strict"' in done.stdout
    assert 'Of 4 flights at each level, flown with `escape = "strict"`' in page.read_text()
    assert "old" not in page.read_text()
    other = told(monkeypatch, tmp_path, "safe", more=("--docs", page, "--escape", "off"))
    assert other.returncode == 2
    assert "no <!-- faults-off:begin -->" in other.stderr


def test_other_ways_out_are_refused(tmp_path):
    for other, near in (("strikt", " (did you mean 'strict'?)"), ("mapped", "")):
        done = clearway("faults", FAULT, "--escape", other, cwd=tmp_path)
        assert done.returncode == 2
        assert f"--escape: {other!r}{near}: there are strict, known, off" in done.stderr
    assert not (tmp_path / "clearway-out").exists()


def test_missions_that_are_written_ask_for_the_same_ways_out(tmp_path):
    done = clearway(
        "faults", "latency", "--missions", "--escape", "off", "--out", tmp_path, "--json"
    )
    missions = json.loads(done.stdout)["missions"]
    assert len(missions) == len(STUDIES["latency"].levels)
    assert {read_mission_file(one).safety.escape for one in missions} == {"off"}


def test_a_flight_is_flown_as_asked_for():
    off = fly_one("dead-sensor", "LiDAR alone", 20.0, 0, "off")
    strict = fly_one("dead-sensor", "LiDAR alone", 20.0, 0)
    assert (off.escape_mode, strict.escape_mode) == ("off", "strict")
    assert not off.margin_kept
    assert strict.not_reached
    assert strict.margin_kept, "the way out in hand is stayed in"


def test_the_first_level_of_a_dead_sensor_is_no_fault():
    first = STUDIES["dead-sensor"].levels[0]
    assert fly_one("dead-sensor", "LiDAR alone", first, 1) == fly_one("gusts", "LiDAR alone", 0, 1)


@pytest.mark.parametrize("escape", ["strict", "off"])
def test_the_page_tells_of_every_level(escape):
    rows = ROW.findall(_part(PAGE.read_text(), escape))
    expected = [
        (study.title, study.unit, variant, [f"{level:g}" for level in study.levels])
        for study in STUDIES.values()
        for variant in study.variants
    ]
    assert [
        (title.removesuffix(" (flown as known)"), unit, variant, re.findall(r"(-?[\d.]+): ", cells))
        for title, unit, variant, cells in rows
    ] == expected


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "escape"), [("report-loss", "strict"), ("report-loss", "off"), ("latency", "strict")]
)
def test_the_page_is_what_the_command_puts_there(tmp_path, name, escape):
    there = _part(PAGE.read_text(), escape)
    flights = int(re.findall(r"Of (\d+) flights", there)[0])
    page = tmp_path / "page.md"
    page.write_text(MARKED.format(escape))
    options = ("--escape", escape, "--flights", flights, "--workers", 1, "--docs", page)
    clearway("faults", name, *options, "--out", tmp_path / "out")
    rows = ROW.findall(_part(page.read_text(), escape))
    assert rows
    assert set(rows) <= set(ROW.findall(there))


def _part(page, escape):
    found, _, rest = page.partition(f"<!-- faults-{escape}:begin -->")
    assert found != page
    return rest.partition(f"<!-- faults-{escape}:end -->")[0]
