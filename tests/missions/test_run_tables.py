"""The log as Parquet tables, read back."""

import json

import numpy as np
import pytest

pytest.importorskip("pyarrow")

from pyarrow import parquet

from clearway.base.version import SCHEMA_VERSION
from clearway.missions.run_files import decision_record
from clearway.missions.run_tables import DECISIONS, INTRUDERS, TRACK, write_tables
from flown_missions import flown


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    write_tables(flown().run, folder)
    return {path.name: parquet.read_table(path) for path in folder.iterdir()}


def test_there_is_one_row_a_decision_as_the_log_has_it(tables):
    rows, run = tables[DECISIONS].to_pylist(), flown().run
    assert len(rows) == len(run.decisions)
    for row, entry in zip(rows, run.decisions, strict=True):
        record = decision_record(entry)
        assert [row["x_m"], row["y_m"], row["z_m"]] == record.pop("position_m")
        attitude = record.pop("attitude_rad")
        assert [row["roll_rad"], row["pitch_rad"], row["yaw_rad"]] == attitude
        for name in ("ruled_out_by", "data_left_out"):
            assert dict(row[name]) == record.pop(name)
        for name, value in record.items():
            assert row[name] == value, name
    assert any(row["ruled_out"] for row in rows)


def test_columns_are_typed(tables):
    types = {field.name: str(field.type) for field in tables[DECISIONS].schema}
    assert types["time_s"] == types["clearance_m"] == types["yaw_rad"] == "double"
    assert types["goal"] == types["candidates"] == "int32"
    assert types["mode"] == types["explanation"] == "string"
    assert types["movements"].startswith("list<")


def test_every_table_tells_the_version_of_its_form(tables):
    for table in tables.values():
        assert table.schema.metadata[b"schema_version"] == str(SCHEMA_VERSION).encode()


def test_the_track_and_the_intruders_are_the_true_ones(tables):
    run, track, intruders = flown().run, tables[TRACK], tables[INTRUDERS]
    np.testing.assert_array_equal(track["time_s"].to_numpy(), run.time_s)
    np.testing.assert_array_equal(track["yaw_rad"].to_numpy(), run.states[:, 5])
    np.testing.assert_array_equal(
        track["obstacle_distance_m"].to_numpy(), run.metrics.obstacle_distance_m
    )
    before = run.time_s < run.intruder_tracks["crossing"][0, 0] - 1e-9
    assert track["intruder_distance_m"].null_count == before.sum() > 0
    assert set(intruders["name"].to_pylist()) == {"crossing"}
    np.testing.assert_array_equal(
        intruders["y_m"].to_numpy(), run.intruder_tracks["crossing"][:, 2]
    )


def test_every_table_tells_of_which_run_it_is(tables):
    assert set(tables) == {DECISIONS, TRACK, INTRUDERS}
    for table in tables.values():
        about = json.loads(table.schema.metadata[b"clearway"])
        assert about == json.loads(json.dumps(flown().run.summary()))


def test_other_planners_have_nulls_where_they_tell_nothing(tmp_path):
    run = flown().setup.fly_with("straight")
    write_tables(run, tmp_path)
    table = parquet.read_table(tmp_path / DECISIONS)
    assert table["clearance_m"].null_count == len(run.decisions)
    assert table["explanation"].null_count == 0
