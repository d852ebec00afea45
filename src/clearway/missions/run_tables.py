"""The log of a run as Parquet tables for notebooks: decisions, track and intruders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.base.errors import MissingExtraError
from clearway.base.version import SCHEMA_VERSION
from clearway.missions.run_files import TRACK_COLUMNS, decision_record
from clearway.sim import Run
from clearway.sim.pilot import Steering

if TYPE_CHECKING:
    import pyarrow

DECISIONS = "decisions.parquet"
TRACK = "track.parquet"
INTRUDERS = "intruders.parquet"

NUMBERS = (
    "cost_m",
    "rating",
    "feasibility",
    "continuations",
    "clearance_m",
    "kept_clearance_m",
    "kept_predicted_m",
    "kept_level",
    "margin_asked_m",
    "margin_kept_m",
    "scan_age_s",
    "decide_within_s",
    "elapsed_ms",
)
TEXTS = (
    "why_now",
    "mode",
    "mode_before",
    "why_mode",
    "basis",
    "limited_by",
    "side",
    "explanation",
    "alert",
)
COUNTS = ("goal", "candidates", "below_threshold")
TOGETHER = 256
"""Decisions whose rows are made together."""
AXES = ("x_m", "y_m", "z_m"), ("roll_rad", "pitch_rad", "yaw_rad")


def check_tables() -> None:
    """Raise MissingExtraError where the extra `parquet` is absent: better before a flight."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError("writing Parquet", "parquet") from cause


def write_tables(run: Run[Steering], folder: Path) -> None:
    """`decisions.parquet`, `track.parquet` and, if there were any, `intruders.parquet`.

    Every table carries the JSON of `summary.json` in its metadata, under `clearway`, and the
    version of its form under `schema_version`. Raises
    MissingExtraError without the extra `parquet`.
    """
    check_tables()
    from pyarrow.parquet import write_table

    about = {"clearway": json.dumps(run.summary()), "schema_version": str(SCHEMA_VERSION)}
    tables = {DECISIONS: decision_table(run), TRACK: track_table(run)}
    if run.intruder_tracks:
        tables[INTRUDERS] = tabulate_intruders(run)
    for name, table in tables.items():
        write_table(table.replace_schema_metadata(about), folder / name, compression="zstd")


def decision_table(run: Run[Steering]) -> pyarrow.Table:
    """One row per decision; what other planners than clearway do not tell is null."""
    import pyarrow as pa

    ruled_out = pa.struct(
        [
            ("movements", pa.list_(pa.string())),
            ("cost_m", pa.float64()),
            ("cause", pa.string()),
            ("clearance_m", pa.float64()),
        ]
    )
    rule = pa.struct(
        [
            ("name", pa.string()),
            ("reason", pa.string()),
            ("forbidden", pa.int32()),
            ("broken", pa.bool_()),
            ("decided", pa.bool_()),
        ]
    )
    way_out = pa.struct(
        [
            ("movements", pa.list_(pa.string())),
            ("loop", pa.list_(pa.string())),
            ("margin_kept_m", pa.float64()),
            ("certain", pa.bool_()),
        ]
    )
    fields = [
        ("time_s", pa.float64()),
        *((name, pa.string()) for name in TEXTS),
        *((name, pa.int32()) for name in COUNTS),
        *((name, pa.float64()) for axes in AXES for name in axes),
        *((name, pa.float64()) for name in NUMBERS),
        ("movements", pa.list_(pa.string())),
        ("way_out", way_out),
        ("no_way_out", pa.list_(pa.string())),
        ("ruled_out", pa.list_(ruled_out)),
        ("rules", pa.list_(rule)),
        ("ruled_out_by", pa.map_(pa.string(), pa.int32())),
        ("data_left_out", pa.map_(pa.string(), pa.int32())),
    ]
    schema = pa.schema(fields)
    return pa.concat_tables(
        pa.Table.from_pylist(
            [_row(decision_record(entry)) for entry in run.decisions[begin : begin + TOGETHER]],
            schema=schema,
        )
        for begin in range(0, max(len(run.decisions), 1), TOGETHER)
    ).combine_chunks()


def _row(record: dict[str, Any]) -> dict[str, Any]:
    row = dict(record)
    row.pop("long_range", None)
    row["alert"] = row.pop("traffic", {}).get("level")
    for names, values in zip(AXES, (row.pop("position_m"), row.pop("attitude_rad")), strict=True):
        row |= dict(zip(names, values, strict=True))
    for name in ("ruled_out_by", "data_left_out"):
        row[name] = list(row.get(name, {}).items())
    return row


def track_table(run: Run[Steering]) -> pyarrow.Table:
    """One row per step of the true track, with the distances to what is nearest; null for none."""
    import pyarrow as pa

    columns = dict(zip(TRACK_COLUMNS, (run.time_s, *run.states.T), strict=True))
    traffic = run.metrics.intruders
    columns["obstacle_distance_m"] = run.metrics.obstacle_distance_m
    columns["intruder_distance_m"] = (
        np.full(len(run.time_s), np.inf) if traffic is None else traffic.distance_m.min(axis=0)
    )
    return pa.table(
        {
            name: pa.array(values, pa.float64(), mask=~np.isfinite(values))
            for name, values in columns.items()
        }
    )


def tabulate_intruders(run: Run[Steering]) -> pyarrow.Table:
    """One row per step and intruder: its true place."""
    import pyarrow as pa

    tracks = run.intruder_tracks
    names = [name for name, track in tracks.items() for _ in range(len(track))]
    rows = np.concatenate(list(tracks.values()))
    columns = dict(zip(TRACK_COLUMNS, rows.T, strict=False))
    return pa.table(
        {
            "name": pa.array(names).dictionary_encode(),
            **{name: pa.array(np.ascontiguousarray(v)) for name, v in columns.items()},
        }
    )
