"""Runs as MCAP files: what stands in them, for clearway and for Foxglove."""

import json
import re
import struct
import time
from collections import defaultdict
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")

from mcap.reader import make_reader

from clearway.avoidance.rate.fusion import assess_cells, rating_named
from clearway.avoidance.rules import GroundHeights
from clearway.base.frames import world_from_body
from clearway.io.maps.map_features import Geodetic
from clearway.io.toml_writing import dump_toml
from clearway.live.mission import Mode
from clearway.missions.mission_place import MissionPlace
from clearway.missions.run_files import decision_record
from clearway.sensors import Scan
from clearway.view.replay import schemas
from clearway.view.replay.about import list_surveyed_points
from clearway.view.replay.entities import quaternion
from clearway.view.replay.foxglove_layout import foxglove_layout
from clearway.view.replay.messages import intruders_message, voxel_centers
from clearway.view.replay.reading import cloud_points, read_run
from clearway.view.replay.writing import write_mcap
from flown_missions import SHORT, flown, written_run

FOXGLOVE = {
    schemas.SCENE: "foxglove.SceneUpdate",
    schemas.PLAN_SCENE: "foxglove.SceneUpdate",
    schemas.WAY_OUT_SCENE: "foxglove.SceneUpdate",
    schemas.CELL_SCENE: "foxglove.SceneUpdate",
    schemas.REACH_SCENE: "foxglove.SceneUpdate",
    schemas.INTRUDER_SCENE: "foxglove.SceneUpdate",
    schemas.TRANSFORMS: "foxglove.FrameTransforms",
    schemas.POINTS: "foxglove.PointCloud",
    schemas.LOG: "foxglove.Log",
}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return written_run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def messages(path):
    found = defaultdict(list)
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            found[channel.topic].append((schema, channel, message))
    return found


def test_every_topic_has_its_schema_and_ascending_times(messages):
    assert set(messages) == set(FOXGLOVE) | set(schemas.SCHEMAS)
    for topic, entries in messages.items():
        schema, channel, _ = entries[0]
        if topic in FOXGLOVE:
            assert (schema.name, schema.encoding) == (FOXGLOVE[topic], "protobuf")
            assert channel.message_encoding == "protobuf"
        else:
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert json.loads(schema.data) == schemas.SCHEMAS[topic]
        times = [message.log_time for _, _, message in entries]
        assert times == sorted(times)


def test_own_messages_hold_what_their_schemas_promise(messages):
    kinds = {
        "number": (int, float),
        "integer": int,
        "string": str,
        "array": list,
        "object": dict,
        "null": type(None),
    }
    for topic, schema in schemas.SCHEMAS.items():
        for _, _, message in messages[topic]:
            values = json.loads(message.data)
            assert set(values) == set(schema["properties"]), topic
            for name, value in values.items():
                wanted = schema["properties"][name]["type"]
                allowed = [wanted] if isinstance(wanted, str) else wanted
                assert any(isinstance(value, kinds[kind]) for kind in allowed), (topic, name)


def test_there_is_one_message_a_decision_and_one_a_step(messages):
    run = flown().run
    for topic in (
        schemas.DECISION,
        schemas.SCALARS,
        schemas.CELLS,
        schemas.REACH,
        schemas.POINTS,
        schemas.LOG,
    ):
        assert len(messages[topic]) == len(run.decisions), topic
    for topic in (schemas.STATE, schemas.TRANSFORMS):
        assert len(messages[topic]) == len(run.time_s), topic
    for name in (schemas.MISSION, schemas.SCENE):
        assert len(messages[name]) == 1
    begins = round(json.loads(messages[schemas.MISSION][0][2].data)["begins_unix_s"] * 1e9)
    stamps = [message.log_time - begins for _, _, message in messages[schemas.DECISION]]
    assert stamps == [round(entry.flight.time_s * 1e9) for entry in run.decisions]
    assert abs(begins * 1e-9 - time.time()) < 3600.0  # The mission says no date: it is now.


def test_the_mission_that_was_flown_is_attached(path):
    with path.open("rb") as stream:
        attached = list(make_reader(stream).iter_attachments())
    assert [one.name for one in attached] == ["mission.toml"]
    assert attached[0].data.decode() == dump_toml(flown().file.effective())


def test_scalars_repeat_what_decisions_tell(messages):
    told = [json.loads(message.data) for _, _, message in messages[schemas.DECISION]]
    scalars = [json.loads(message.data) for _, _, message in messages[schemas.SCALARS]]
    for whole, one in zip(told, scalars, strict=True):
        assert list(Mode)[one["mode"]] == whole["mode"]
        for name in ("cost_m", "rating", "clearance_m", "margin_asked_m", "elapsed_ms"):
            assert one[name] == whole[name]
        assert one["ruled_out"] == sum(whole["ruled_out_by"].values())
        assert (one["way_out_margin_m"] is None) == (whole["way_out"] is None)
        assert one["alert"] == 0


@pytest.fixture(scope="module")
def dated(tmp_path_factory):
    """A run above Cologne at noon, with raw scans and hills."""
    path = tmp_path_factory.mktemp("dated") / "run.mcap"
    short = flown()
    hills = np.where(np.arange(12.0).reshape(3, 4) > 10.0, np.nan, 2.5)
    ground = GroundHeights(hills, np.array([-5.0, -5.0]), 10.0)
    begins = datetime(2026, 7, 1, 12, tzinfo=UTC)
    place = MissionPlace(Geodetic(50.9, 6.9, 60.0), ground, begins)
    scans = [Scan(np.full((4, 3), at), at, sensor=short.setup.lidars[0].name) for at in (0.0, 1.0)]
    write_mcap(short.run, replace(short.setup, place=place), "", path, scans)
    return path


def doubles(data):
    """Fields of a protobuf message that are doubles at its top, by number."""
    found, at = {}, 0
    while at < len(data):
        number, wire = data[at] >> 3, data[at] & 7
        if wire == 1:
            found[number] = struct.unpack_from("<d", data, at + 1)[0]
        at += {1: 9, 2: 2 + data[at + 1]}[wire]
    return found


def test_a_dated_mission_on_earth_has_true_times_and_places(dated):
    with dated.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = list(reader.iter_messages(topics=[schemas.FIX]))
        (about,) = [one.metadata for one in reader.iter_metadata()]
    assert about["begins"] == "2026-07-01T12:00:00+00:00"
    assert about["begins_is"] == "by the mission"
    assert about["planner"] == "clearway"
    noon = int(datetime(2026, 7, 1, 12, tzinfo=UTC).timestamp()) * 10**9
    run = flown().run
    assert found[0][2].log_time == noon
    assert {schema.name for schema, _, _ in found} == {"foxglove.LocationFix"}
    for _, _, message in (found[0], found[len(found) // 2]):
        at = np.searchsorted(run.time_s, (message.log_time - noon) * 1e-9 - 1e-6)
        east, north, up = run.states[at, :3]
        latitude, longitude, height = (doubles(message.data).get(n, 0.0) for n in (1, 2, 3))
        assert latitude == pytest.approx(50.9 + np.degrees(north / 6.38e6), abs=1e-6)
        east_rad = east / 6.38e6 / np.cos(np.radians(50.9))
        assert longitude == pytest.approx(6.9 + np.degrees(east_rad), abs=1e-6)
        assert height == pytest.approx(60.0 + up, abs=0.01)


def test_raw_scans_and_the_ground_are_kept_where_asked(dated, messages):
    assert not any(topic.startswith(schemas.SCANS) for topic in messages)
    topic = f"{schemas.SCANS}{flown().setup.lidars[0].name}"
    with dated.open("rb") as stream:
        clouds = list(make_reader(stream).iter_messages(topics=[topic]))
    assert [cloud_points(message.data).tolist() for _, _, message in clouds] == [
        [[at] * 3] * 4 for at in (0.0, 1.0)
    ]
    terrain = read_run(dated).mission["terrain"]
    assert (terrain["rows"], terrain["columns"], terrain["step_m"]) == (3, 4, 10.0)
    assert terrain["heights_cm"] == [250] * 11 + [None]


def test_the_layout_names_what_a_run_has(messages):
    layout = json.loads(foxglove_layout())
    text = json.dumps(layout["configById"])
    topics = {*messages, schemas.FIX, schemas.WORLD_POINTS}
    assert set(layout["configById"]["3D!clearway"]["topics"]) <= topics
    for value in re.findall(r'"value": "([^"]+)"', text):
        topic, _, name = value.partition(".")
        assert name in schemas.SCHEMAS[topic]["properties"], value

    def panels(node):
        return [node] if isinstance(node, str) else panels(node["first"]) + panels(node["second"])

    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])


def test_decisions_are_those_of_the_log_with_plan_and_movers(path):
    recording, run = read_run(path), flown().run
    for told, entry in zip(recording.decisions, run.decisions, strict=True):
        decision = entry.flight.decision
        extra = {name: told[name] for name in ("path_m", "way_out_m", "movers")}
        assert told == json.loads(json.dumps(decision_record(entry))) | extra
        np.testing.assert_allclose(told["path_m"], decision.path_m, atol=1e-3)
        np.testing.assert_allclose(
            np.reshape(told["way_out_m"], (-1, 3)), decision.way_out_path_m, atol=1e-3
        )
        assert bool(told["way_out_m"]) == (decision.way_out is not None)
        assert [moving["name"] for moving in told["movers"]] == list(decision.intruders)
    known = next(one["movers"][0] for one in recording.decisions if one["movers"])
    assert known["position_m"] == pytest.approx([12, 7, 0], abs=1.0)
    assert known["velocity_mps"] == pytest.approx([0, -0.8, 0.1], abs=1e-3)


def test_cells_and_ratings_are_those_of_the_decision(path):
    recording, run = read_run(path), flown().run
    settings = flown().setup.planner.settings
    told = 0.0
    for cells, reach, entry in zip(recording.cells, recording.reach, run.decisions, strict=True):
        decision = entry.flight.decision
        expected = {
            "obstacle": decision.cells.obstacle,
            "visibility": decision.cells.evidence.visibility,
            "reachability": decision.reach.reachability,
            "rating_total": decision.cells.rating,
            "intruder": decision.cells.evidence.intruder,
            "map": decision.cells.map,
            "detected": decision.cells.evidence.detected,
            "passed": decision.reach.passed,
            "coated": decision.cells.evidence.coated,
            "seen": decision.cells.evidence.seen,
        }
        for name in ("printed", "visible", "evidence"):
            expected[f"rating_{name}"] = assess_cells(
                decision.cells.evidence,
                rating_named(name),
                settings.unknown,
                settings.unknown_unseen,
            ).rating
        for name, values in expected.items():
            np.testing.assert_allclose(cells[name], values, atol=5.1e-4, err_msg=name)
        np.testing.assert_allclose(reach["rating"], decision.reach.node_rating, atol=5.1e-4)
        assert reach["chosen"] == decision.choice.node
        told = max(told, *cells["obstacle"])
    assert told > 0.5


def test_reach_sets_are_kept_with_their_geometry(path):
    recording, run = read_run(path), flown().run
    for told in recording.reach_sets:
        entry = next(
            e for e in run.decisions
            if e.flight.decision.prepared.reach_set.start_pitch_rad == told["start_pitch_rad"]
        )  # fmt: skip
        reach_set = entry.flight.decision.prepared.reach_set
        assert told["parent"] == reach_set.parent.tolist()
        samples = np.array(told["samples_mm"]).reshape(reach_set.samples_m.shape) / 1e3
        np.testing.assert_allclose(samples, reach_set.samples_m, atol=5.1e-4)


def test_points_are_the_voxels_that_hold_what_was_reckoned_with(path):
    recording, run = read_run(path), flown().run
    voxel, most = recording.mission["voxel_m"], 0
    for points, entry in zip(recording.points_m, run.decisions, strict=True):
        decision = entry.flight.decision
        known = decision.hazards.points.position_m
        most = max(most, len(points))
        assert len(points) <= len(known)
        if not len(known):
            continue
        _, pitch, yaw = decision.state.attitude_rad
        rotation = world_from_body([0.0, pitch, yaw])
        places = known @ rotation.T + decision.state.position_m
        apart = np.abs(places[:, None, :] - points[None]).max(axis=2)
        assert apart.min(axis=1).max() <= 0.5 * voxel + 1e-5
        assert apart.min(axis=0).max() <= 0.5 * voxel + 1e-5
    assert most > 20


def test_obstacles_tell_where_they_are_known(path):
    known = {one["name"]: one["known"] for one in read_run(path).mission["obstacles"]}
    assert known.pop("school") == "rule"
    assert known == {"ball": "world", "mast": "both", "zone": "map", "wall": "both"}


def test_intruders_fly_as_they_did(path):
    recording, run = read_run(path), flown().run
    track = run.intruder_tracks["crossing"]
    assert recording.intruders[0]["time_s"] == pytest.approx(track[0, 0], abs=0.2)
    for message in recording.intruders:
        (one,) = message["intruders"]
        at = np.searchsorted(track[:, 0], message["time_s"] - 1e-6)
        np.testing.assert_allclose(one["position_m"], track[at, 1:], atol=1e-3)
        assert one["velocity_mps"] == pytest.approx([0, -0.8, 0.1], abs=2e-3)
    assert recording.mission["intruder_radius_m"] == {"crossing": pytest.approx(0.5)}


def test_an_intruder_that_is_silent_is_not_there():
    run = flown().run
    track = run.intruder_tracks["crossing"]
    middle = float(track[len(track) // 2, 0])
    kept = (track[:, 0] < middle) | (track[:, 0] > middle + 3.0)
    silent = replace(run, intruder_tracks={"crossing": track[kept]})
    for time_s, there in ((middle - 0.5, 1), (middle + 1.0, 0), (middle + 3.5, 1)):
        assert len(intruders_message(silent, time_s)["intruders"]) == there
    (one,) = intruders_message(silent, middle - 0.5)["intruders"]
    assert one["velocity_mps"] == pytest.approx([0, -0.8, 0.1], abs=2e-3)
    assert intruders_message(run, float(track[0, 0]) - 0.5)["intruders"] == []


def test_quaternions_turn_as_the_rotation_does():
    for attitude in np.random.default_rng(1).uniform(-1.4, 1.4, (20, 3)):
        # Four doubles, each after the byte with the number of its field.
        keys_and_values = struct.unpack("<" + 4 * "Bd", quaternion(attitude).encode())
        v, w = np.array(keys_and_values[1:7:2]), keys_and_values[7]
        for axis in np.eye(3):
            turned = axis + 2.0 * w * np.cross(v, axis) + 2.0 * np.cross(v, np.cross(v, axis))
            np.testing.assert_allclose(turned, world_from_body(attitude) @ axis, atol=1e-12)


def test_voxel_centres_hold_every_point_once():
    points = np.random.default_rng(2).uniform(-3.0, 5.0, (500, 3))
    centres = voxel_centers(points, 0.7)
    cells = np.unique(np.floor(points / 0.7), axis=0)
    np.testing.assert_allclose(np.unique(centres, axis=0), (cells + 0.5) * 0.7)
    assert voxel_centers(np.zeros((0, 3)), 0.7).shape == (0, 3)


def test_a_run_of_another_planner_has_decisions_without_cells(tmp_path):
    short = flown()
    run = short.setup.fly_with("straight")
    write_mcap(run, short.setup, "", tmp_path / "run.mcap")
    recording = read_run(tmp_path)
    assert recording.mission["planner"] == "straight"
    assert len(recording.decisions) == len(run.decisions) > 0
    assert recording.cells == recording.reach == recording.points_m == ()
    assert all(one["explanation"] for one in recording.decisions)


def test_a_surveyed_world_is_thinned():
    from clearway.obstacles.point_world import PointWorld
    from clearway.obstacles.world import CombinedWorld

    points = np.random.default_rng(3).uniform(0.0, 20.0, (150_000, 3))
    thinned = list_surveyed_points(CombinedWorld([PointWorld(points, 0.1)]))
    assert 20_000 < len(thinned) <= 60_000
    assert {tuple(point) for point in thinned} <= {tuple(point) for point in points}
    assert len(np.unique(np.floor(thinned / 4.0), axis=0)) == 125  # Some of every part of it.
    assert list_surveyed_points(flown(SHORT).setup.world).shape == (0, 3)
