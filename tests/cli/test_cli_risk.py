"""`clearway risk` through its real entry point."""

from __future__ import annotations

import csv
import json
from functools import partial
from pathlib import Path

import pytest

from clearway.base.provenance import sha256_of
from clearway.base.version import __version__
from clearway.studies.encounter_model import make_up_model
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.flight import STRAIGHT, separation_of
from clearway.studies.risk.settings import RiskSettings
from in_process import clearway as run_here
from own_process import run_clearway

run = partial(run_clearway, "risk")


def test_ratios_are_printed_and_every_encounter_is_written(tmp_path):
    done = run(
        "--count", 5, "--planners", "mvp", "--workers", 1, "--json", "--out", "all", cwd=tmp_path
    )
    assert done.returncode == 3, "five encounters show nothing: " + done.stderr
    assert "made up" in done.stderr
    told = json.loads(done.stdout)
    assert told["encounters"] == 5
    assert set(told["planners"]) == {"mvp"}
    measure = told["planners"]["mvp"]["lost_well_clear"]
    assert measure["ratio"] == pytest.approx(measure["unresolved"] + measure["induced"])
    assert measure["verdict"] == "not shown"
    assert measure["ratio_95"][1] > measure["limit"]
    assert told["verdict"] == "not shown"
    assert told["limits"] == {"near_collision": 0.18, "lost_well_clear": 0.4}
    assert told["dynamics"] == "50 kt, 5 deg/s"
    assert told["surveillance"] == "reports every 1 s"
    assert told["version"] == told["provenance"]["clearway"] == __version__
    assert told["model_sha256"] == sha256_of(Path(make_up_model().source))
    assert told["command"] == told["provenance"]["command"]
    assert told["command"].startswith("clearway risk --count 5 --planners mvp")
    assert json.loads((tmp_path / "all" / "risk.json").read_text()) == told
    rows = list(csv.DictReader((tmp_path / "all" / "encounters.csv").read_text().splitlines()))
    assert [(row["number"], row["planner"]) for row in rows[:2]] == [
        ("0", "straight"),
        ("0", "mvp"),
    ]
    encounter = sample_encounter(make_up_model(), 4, RiskSettings())
    straight, _ = separation_of(encounter, STRAIGHT, RiskSettings())
    assert float(rows[-2]["nearest_m"]) == pytest.approx(straight.nearest_m, abs=1e-3)


def test_one_encounter_shows_nothing(tmp_path):
    done = run_here("risk", "--count", 1, "--workers", 1, cwd=tmp_path)
    assert done.returncode == 3
    assert "not shown" in done.stdout or "no case" in done.stdout


def test_one_encounter_is_replayed_drawn_and_explained(tmp_path):
    done = run_here("risk", "--only", 4, "--out", "one", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "one" / "encounter-4.png").stat().st_size > 20_000
    encounter = sample_encounter(make_up_model(), 4, RiskSettings())
    straight, _ = separation_of(encounter, STRAIGHT, RiskSettings())
    assert f"nearest {straight.nearest_m / 0.3048:.0f} ft" in done.stdout
    assert "clearway:" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere.txt",), "nowhere.txt: cannot be read"),
        (("--planners", "wish"), "valid planners are clearway, straight"),
        (("--noise", "much"), "--noise"),
        (("--layers", "9"), "--layers: the model has layers 1 to 4"),
        (("--own-kt", "-3"), "own_kt: must be a number from 1 to 1000"),
        (("--own-kt", "1e8"), "own_kt: must be a number from 1 to 1000"),
        (("--stretch", "1e8"), "stretch"),
        (("--limits", "nan,nan"), "--limits: two numbers from 0 to 100 are needed"),
        (("--limits", "0.1,inf"), "--limits: two numbers from 0 to 100 are needed"),
        (("--limits=-1,-1",), "--limits: two numbers from 0 to 100 are needed"),
        (("--vehicle", "kite"), "valid vehicles are copter or wing"),
        (("--surveillance", "ears"), "remote-id"),
        (("--vehicle", "wing", "--planners", "turn-back"), "velocity-obstacle"),
        (("--vehicle", "wing", "--range-m", "-5"), "range_m"),
        (("--range-m", "-5"), "--range-m: is for --vehicle or --surveillance"),
        (("--reaction-s", "30"), "--reaction-s: is for --vehicle or --surveillance"),
        (("--floor-ft", "50"), "--floor-ft: is for --vehicle or --surveillance"),
        (("--models", "."), "--models: is for --vehicle or --surveillance"),
        (("--within-s", "300"), "--within-s: is for --vehicle or --surveillance"),
        (("--vehicle", "wing", "--models", "."), "holds no encounter models"),
        (("--vehicle", "wing", "--models", ".", "--only", "3"), "--only: is of one model"),
        (("--vehicle", "wing", "--docs", "page.md"), "--docs: is for --models"),
        (("--vehicle", "wing", "--planners", "horizontalcas:nowhere"), "cannot be read"),
        (("--vehicle", "wing", "--own-kt", "200"), "--own-kt: is of the stretched world"),
        (("--surveillance", "ads-b", "--noise", "0,0"), "--noise: is of the stretched world"),
        (("--vehicle", "wing", "--stretch", "9"), "--stretch: is of the stretched world"),
        (("--curves", "nowhere.json"), "--out"),
        (("--curves", "nowhere.json", "--out", "x"), "nowhere.json"),
    ],
)
def test_bad_options_end_with_2(arguments, said, tmp_path):
    done = run_here("risk", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stdout == ""


def test_every_model_of_a_folder_in_one_command(tmp_path):
    folder = tmp_path / "models"
    folder.mkdir()
    made_up = Path(make_up_model().source).read_text()
    for name in ("one", "two"):
        (folder / f"{name}.txt").write_text(made_up)
    (tmp_path / "page.md").write_text(
        "<!-- encounter-models:begin -->\n<!-- encounter-models:end -->\n"
    )
    done = run_here(
        "risk", "--models", "models", "--vehicle", "wing", "--count", 3, "--workers", 1,
        "--journal", "kept", "--docs", "page.md", "--json", "--out", "all", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    told = json.loads(done.stdout)
    assert list(told["models"]) == ["one", "two"]
    one = told["models"]["one"]
    assert one["straight"] == told["models"]["two"]["straight"], "the same model twice"
    assert set(one["planners"]["clearway"]["nuisance"]) >= {"of_clear", "of_manoeuvres"}
    assert one["layers"][0]["altitude_ft"][0] >= 50.0
    assert json.loads((tmp_path / "all" / "risk.json").read_text()) == told
    assert {file.name for file in (tmp_path / "kept").iterdir()} == {"one.jsonl", "two.jsonl"}
    assert (tmp_path / "page.md").read_text().count("| 3 |") == 2
