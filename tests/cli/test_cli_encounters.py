"""`clearway encounters` through its real entry point."""

import csv
import json
from functools import partial

import pytest

from clearway.base.intervals import wilson
from clearway.studies.encounters.encounter import EncounterSettings, random_encounter
from clearway.studies.encounters.flights import fly_encounter
from in_process import clearway as run_here
from own_process import run_clearway

run = partial(run_clearway, "encounters")


@pytest.mark.nightly
def test_the_command_prints_intervals_and_writes_every_encounter(tmp_path):
    done = run("--count", 8, "--detected-at", 4, "--workers", 1, "--json", "--out", "all.csv",
               cwd=tmp_path)  # fmt: skip
    assert done.returncode == 3, "eight do not show 99 %: " + done.stderr
    (result,) = json.loads(done.stdout)["encounters"]
    assert result["encounters"] == 8
    assert result["kept"] == result["avoidable"] < 8
    assert tuple(result["wilson_95"]) == wilson(result["kept"], result["avoidable"])
    assert result["failures"] == []
    assert result["verdict"] == "not shown"
    rows = list(csv.DictReader((tmp_path / "all.csv").read_text().splitlines()))
    assert [int(row["seed"]) for row in rows] == list(range(8))


def test_one_encounter_is_replayed_with_its_decisions(tmp_path):
    done = run_here("encounters", "--only", 3, "--detected-at", 4, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    flown = fly_encounter(random_encounter(3, EncounterSettings(4.0)), EncounterSettings(4.0))
    assert told["min_distance_m"] == flown.metrics.intruders.min_distance_m
    assert [each["explanation"] for each in told["decisions"]] == [
        entry.flight.explanation for entry in flown.decisions
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--noise", "much"), "--noise"),
        (("--scale", "-2"), "scale: must be a number from 0.001 to 10000"),
        (("--scale", "1e8"), "scale: must be a number from 0.001 to 10000"),
        (("--detected-at", "nan"), "detected"),
    ],
)
def test_bad_options_end_with_2(arguments, said, tmp_path):
    done = run_here("encounters", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stdout == ""
