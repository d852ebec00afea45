"""Results of a campaign as Parquet: a row a flight, settings in the file's metadata."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.version import SCHEMA_VERSION
from clearway.io.apart import apart
from clearway.io.staging import stage_file
from clearway.io.what_file import require_file
from clearway.studies.campaigns.row import COLUMN_TYPES, FlightRow

LOADED_APART = ("pyarrow.parquet",)
META = "clearway_"


def need_parquet() -> None:
    """Raise MissingExtraError without pyarrow: better before than after the flights."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError("keeping the results of a campaign", "parquet") from cause


def write_results(path: Path, rows: Sequence[FlightRow], settings: dict[str, str]) -> None:
    """Replace the file by one with these rows: afterwards the old or the new one is there, whole.

    Raises InputError where it cannot be written, MissingExtraError without pyarrow.
    """
    need_parquet()
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([_column(pa, name, kind) for name, kind in COLUMN_TYPES.items()])
    about = {META + name: value for name, value in settings.items()}
    schema = schema.with_metadata({"schema_version": str(SCHEMA_VERSION), **about})
    table = pa.Table.from_pylist([asdict(row) for row in rows], schema=schema)
    with stage_file(path) as scratch, scratch.open("wb") as file:
        pq.write_table(table, file, compression="zstd")
        file.flush()
        os.fsync(file.fileno())


def read_results(path: Path) -> tuple[list[FlightRow], dict[str, str]]:
    """Rows and settings of a results file.

    Raises InputError where it is none, MissingExtraError without pyarrow.
    """
    require_file(path)
    need_parquet()
    return apart(path, "Parquet file", _read, path)


def _read(path: Path) -> tuple[list[FlightRow], dict[str, str]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with naming(path, "read"):
            # `read_table` waits for threads even so, of which a forked process has none.
            table = pq.ParquetFile(path).read(use_threads=False)
    except pa.ArrowException as cause:
        raise InputError(str(path), f"no Parquet file: {cause}") from cause
    missing = [name for name in COLUMN_TYPES if name not in table.column_names]
    if missing:
        raise InputError(str(path), f"no results of a campaign: without {', '.join(missing)}")
    metadata: dict[bytes, bytes] = table.schema.metadata or {}
    settings = {
        key.decode().removeprefix(META): value.decode()
        for key, value in metadata.items()
        if key.decode().startswith(META)
    }
    rows = table.select(list(COLUMN_TYPES)).to_pylist()
    return [FlightRow(**row) for row in rows], settings


def _column(pa: Any, name: str, kind: Any) -> Any:
    """The column of a type: text, whole and real numbers, truth, or one of them or nothing."""
    inner = [part for part in get_args(kind) if part is not type(None)]
    optional = len(inner) < len(get_args(kind))
    plain = inner[0] if optional else kind
    types = {int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    return pa.field(name, types.get(plain, pa.string()), nullable=optional)
