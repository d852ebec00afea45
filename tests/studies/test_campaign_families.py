"""What campaigns fly: families of cases, conflicts, and what a campaign file may say."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from campaign_for_tests import SMALL
from clearway.base.errors import InputError
from clearway.base.frames import world_from_body
from clearway.cli.campaign_table import print_campaign
from clearway.studies.campaigns.conflicts import KINDS, ConflictParameters, conflict
from clearway.studies.campaigns.engines import make_process_engine
from clearway.studies.campaigns.families import CAMPAIGN_FAMILIES, make_case
from clearway.studies.campaigns.file import list_built_in_campaigns, read_campaign
from clearway.studies.campaigns.results import read_results
from clearway.studies.campaigns.run import absent, run_campaign
from clearway.studies.campaigns.task import tasks_of
from clearway.studies.encounter_model import make_up_model
from clearway.studies.encounters.flights import RADIUS_M
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.settings import NEAR_COLLISION, RiskSettings
from in_process import clearway
from repository import REPOSITORY

DOCS = REPOSITORY / "docs"


@pytest.mark.parametrize("kind", KINDS)
def test_straight_flight_meets_every_intruder_of_a_conflict(kind: str) -> None:
    for seed in range(8):
        file = conflict(kind, seed, ConflictParameters())
        assert (len(file.intruder) > 1) == (kind == "several")
        for intruder in file.intruder:
            place, velocity = np.array(intruder.position_m), np.array(intruder.velocity_mps)
            assert np.linalg.norm(place) == pytest.approx(10.0)
            closing = velocity - [1.0, 0.0, 0.0]
            meets_s = float(-place @ closing / (closing @ closing))
            assert np.linalg.norm(place + meets_s * closing) == pytest.approx(0.0, abs=1e-9)
            assert meets_s + intruder.appears_s < file.mission.waypoints_m[-1][0]
            assert intruder.radius_m == RADIUS_M


def test_kinds_of_conflict_are_what_they_are_called() -> None:
    for seed in range(20):
        velocity = {
            kind: np.array(conflict(kind, seed, ConflictParameters()).intruder[0].velocity_mps)
            for kind in KINDS
        }
        assert velocity["head-on"][0] < -0.9 * np.linalg.norm(velocity["head-on"])
        assert 0.25 < velocity["overtaking"][0] < 0.7
        assert velocity["overtaken"][0] > 1.2
        assert abs(velocity["climbing"][2]) > 0.3 * np.linalg.norm(velocity["climbing"])
        assert abs(velocity["converging"][1]) > 0.65 * np.linalg.norm(velocity["converging"])


def test_a_case_is_the_mission_with_its_changes_and_seed() -> None:
    changes = {"simulation": {"scan_latency_s": 0.5}, "lidar": {"dropout": 0.25}}
    case = make_case("mission", 7, {"mission": "static-obstacles"}, changes, Path())
    assert (case.file.simulation.scan_latency_s, case.file.lidar[0].dropout) == (0.5, 0.25)
    assert (case.setup.simulation.seed, case.setup.simulation.scan_latency_s) == (7, 0.5)
    plain = make_case("mission", 7, {"mission": "static-obstacles"}, {}, Path())
    assert plain.file.lidar[0].dropout == 0.05


def test_changes_of_a_campaign_are_made_in_all_families_which_may_say_otherwise(
    tmp_path: Path,
) -> None:
    path = tmp_path / "c.toml"
    path.write_text(
        'name = "c"\nplanners = ["straight"]\n'
        "changes.lidar = { dropout = 0.25, sigma_m = 0.1 }\n"
        '[[family]]\nfamily = "head-on"\n'
        '[[family]]\nfamily = "forest"\nchanges.lidar = { dropout = 0.5 }\n'
    )
    plain, own = (json.loads(task.changes) for task in tasks_of(read_campaign(str(path))))
    assert plain == {"lidar": {"dropout": 0.25, "sigma_m": 0.1}}
    assert own == {"lidar": {"dropout": 0.5, "sigma_m": 0.1}}
    ids = {task.settings_id for task in tasks_of(read_campaign(str(path)))}
    path.write_text(path.read_text().replace("sigma_m = 0.1", "sigma_m = 0.2"))
    assert ids.isdisjoint(task.settings_id for task in tasks_of(read_campaign(str(path))))
    path.write_text(path.read_text().replace("changes.lidar", "changes.radar", 1))
    with pytest.raises(InputError, match="radar"):
        read_campaign(str(path))


def test_a_sampled_intruder_flies_the_track_that_the_model_gives() -> None:
    case = make_case("sampled", 5, {}, {}, Path())
    run = case.setup.fly_with("straight")
    drawn = sample_encounter(make_up_model(), 5, RiskSettings())
    time_s, *place = run.intruder_tracks["intruder"].T
    true = drawn.at_all(time_s) * [1.0, 1.0, RiskSettings().stretch]
    assert pytest.approx(true, abs=1.0) == np.array(place).T
    keep_m = np.hypot(NEAR_COLLISION.radius_m, 4.0 * NEAR_COLLISION.half_height_m)
    assert run.metrics.intruders is not None
    assert run.metrics.intruders.margin_m == pytest.approx([keep_m])


def test_absent_data_are_skipped_with_a_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "place.toml").write_text(
        '[mission]\nname = "place"\nwaypoints_m = [[20, 0, 0]]\n'
        '[point_cloud]\nfile = "survey.laz"\npoint_radius_m = 0.2\n'
    )
    file = tmp_path / "c.toml"
    file.write_text(
        'name = "c"\nplanners = ["straight"]\n'
        '[[family]]\nfamily = "place"\nparameters = { mission = "place.toml" }\n'
        '[[family]]\nfamily = "place"\nlabel = "gone"\nparameters = { mission = "gone.toml" }\n'
        '[[family]]\nfamily = "head-on"\n'
    )
    flown = run_campaign(read_campaign(str(file)), tmp_path / "out", make_process_engine(1))
    assert [row.label for row in flown.rows] == ["head-on"]
    assert "survey.laz" in flown.skipped["place"]
    assert "gone.toml" in flown.skipped["gone"]
    rows, settings = read_results(tmp_path / "out" / "results.parquet")
    print_campaign(rows, settings, json.loads(settings["skipped"]))
    assert "skipped place: place.toml needs survey.laz" in capsys.readouterr().out


def test_families_that_were_not_asked_for_are_not_skipped(tmp_path: Path) -> None:
    """What `--only` flies is all there: exit status 0, and no word about what it did not name."""
    file = tmp_path / "c.toml"
    file.write_text(
        'name = "c"\nplanners = ["clearway"]\n'
        '[[family]]\nfamily = "place"\nlabel = "gone"\nparameters = { mission = "gone.toml" }\n'
        '[[family]]\nfamily = "head-on"\n'
    )
    own = ("campaign", file, "--workers", "1", "--out", tmp_path / "out")
    done = clearway(*own, "--only", "head-on/*")
    assert done.exit_code == 0
    assert "skipped gone" not in done.stderr
    assert "skipped gone" in done.stdout, "the table says what is not in it"
    done = clearway(*own, "--only", "haed-on/*")
    assert "no flight 'haed-on/*' (did you mean 'head-on'?)" in done.stderr
    done = clearway(*own, "--only", "head-on/vfh/*")
    assert "did you mean" not in done.stderr
    done = clearway(*own, "--only", "gone/*")
    assert (done.exit_code, "skipped gone" in done.stderr) == (3, True)


def test_surveyed_places_without_their_public_files_are_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CLEARWAY_DATA", raising=False)
    places = Path(__file__).parents[2] / "examples" / "missions"
    names = ("tree-and-building", "power-line", "delft-streets", "cologne-masts")
    for name in names:
        text = (places / f"{name}.toml").read_text().replace("../../../shared", "nowhere")
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "c.toml").write_text(
        'name = "c"\nplanners = ["straight"]\n'
        + "".join(
            f'[[family]]\nfamily = "place"\nlabel = "{name}"\n'
            f'parameters = {{ mission = "{name}.toml" }}\n'
            for name in names
        )
        + '[[family]]\nfamily = "sampled"\n'
        'parameters = { model = "uncor_1200only_fwse_v1p2.txt" }\n'
    )
    skipped = absent(tasks_of(read_campaign(str(tmp_path / "c.toml"))))
    assert set(skipped) == {*names, "sampled"}
    assert all("`clearway data --fetch DIR` gets" in why for why in skipped.values())


def test_every_built_in_campaign_flies_known_families_in_distinct_flights() -> None:
    assert {"standard", "quick", "dead-ends"} <= set(list_built_in_campaigns())
    for name in list_built_in_campaigns():
        keys = [task.key for task in tasks_of(read_campaign(name))]
        assert len(keys) == len(set(keys))
    labels = {section.name for section in read_campaign("standard").file.family}
    assert len([label for label in labels if label.startswith("balls-")]) == 6
    assert {"forest", "street", "wires", "walls", "pockets", "maze"} <= labels
    assert set(KINDS) <= labels


def test_the_standard_campaign_has_thirty_seeds_of_all_that_is_drawn_at_random() -> None:
    tasks = tasks_of(read_campaign("standard"))
    flights = Counter(task.label for task in tasks if task.planner == "clearway")
    fewer = {label: number for label, number in flights.items() if number < 30}
    assert len(flights) == 28
    assert fewer == {"intruders": 1, "intruders-collision": 1}


def test_the_page_names_every_family_and_its_parameters() -> None:
    page = (DOCS / "campaign.md").read_text()
    for name, family in CAMPAIGN_FAMILIES.items():
        assert f"`{name}`" in page
        for parameter in family.parameters.model_fields:
            assert f"`{parameter}`" in page


# Bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SMALL.replace('"head-on"', '"swamp"'), "forest"),
        (SMALL.replace("balls = 60", "balls = 0"), "balls"),
        (SMALL.replace("balls = 60", "bulls = 60"), "did you mean"),
        (SMALL.replace('"straight"', '"best"'), "potential-field"),
        (SMALL.replace('label = "noisy"', 'label = "several"'), "several"),
        (SMALL.replace('label = "noisy"', 'label = "a/b"'), "label"),
        (SMALL.replace("changes.lidar", "changes.radar"), "lidar"),
        (SMALL.replace("dropout = 0.5", "dropout = 1.5"), "dropout"),
        (SMALL.replace("seeds = 4", "seeds = 0"), "seeds"),
        ("name = [", "no valid TOML"),
    ],
)
def test_bad_campaign_files_say_where_and_what_is_valid(
    text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=re.escape(said)):
        run_campaign(read_campaign(str(path)), tmp_path / "out", make_process_engine(1))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("family", ["dead-end", "balls", "street"])
def test_a_world_anywhere_is_the_same_seen_from_its_start(family: str) -> None:
    """Moved and turned, with start and goals: no start is at whole metres, or along an axis."""
    made, moved = (
        make_case(family, 4, {"anywhere": anywhere}, {}, Path()).setup for anywhere in (False, True)
    )
    ways = []
    for setup in (made, moved):
        start = setup.mission.start
        turn = world_from_body(start.attitude_rad)
        seen = np.array([[3.0, 1.0, 0.5], [9.0, -2.0, 1.0], [20.0, 4.0, -2.0]])
        goals = (setup.mission.goals_m - start.position_m) @ turn
        ways.append((setup.world.distance_m(start.position_m + seen @ turn.T), goals))
    for one, other in zip(*ways, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    start = moved.mission.start
    assert np.abs(start.position_m - np.round(start.position_m)).min() > 1e-6
    again = make_case(family, 4, {"anywhere": True}, {}, Path()).setup
    assert np.array_equal(again.mission.start.vector, start.vector)


def test_a_place_may_have_a_sensor_of_ones_own_with_settings() -> None:
    mission = REPOSITORY / "examples" / "missions" / "own-parts.toml"
    case = make_case("place", 3, {"mission": str(mission)}, {}, REPOSITORY)
    assert [one.name for one in case.setup.sensors] == ["lidar", "radar"]
    assert case.setup.simulation.seed == 3


@pytest.mark.parametrize("family", ["wires", "columns"])
def test_a_world_ten_times_larger_lies_ten_times_as_far_from_places_as_far(family: str) -> None:
    given = {"anywhere": False}
    small = make_case(family, 3, given, {}, Path())
    large = make_case(family, 3, {**given, "times_larger": 10.0}, {}, Path())
    mission, longer = (each.file.to_mission() for each in (small, large))
    start_m = mission.start.position_m
    assert longer.start.position_m == pytest.approx(10.0 * start_m)
    assert longer.waypoints_m == pytest.approx(10.0 * mission.waypoints_m)
    places_m = start_m + np.random.default_rng(4).uniform(0.0, 20.0, (50, 3))
    near_m, far_m = (
        case.setup.world.distance_m(times * places_m) for case, times in ((small, 1), (large, 10))
    )
    assert far_m == pytest.approx(10.0 * near_m, abs=1e-6)
