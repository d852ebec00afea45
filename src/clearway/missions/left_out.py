"""Keys that a file leaves out and its vehicle decides, and what is stated of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clearway.vehicle.scale import Scale


def values_left_out(keys: Mapping[str, str], tables: Mapping[str, Any]) -> dict[str, float]:
    """Return the values of keys that the tables leave out and that count, as `table.key`.

    keys: one of each table, by its name.
    """
    return {
        f"{table}.{key}": getattr(tables[table], key)
        for table, key in keys.items()
        if key not in tables[table].model_fields_set and _counts(tables[table], key)
    }


def _counts(table: Any, key: str) -> bool:
    """Whether a key says anything, beside others that take its place."""
    return not hasattr(table, "effective") or key in table.effective()


def describe_left_out(
    keys: Mapping[str, str], tables: Mapping[str, Any], scale: Scale | None
) -> str | None:
    """Return which values follow from the vehicle; None where they are those of 1 m/s."""
    usual = {f"{t}.{key}": type(tables[t]).model_fields[key].default for t, key in keys.items()}
    left_out = values_left_out(keys, tables)
    told = [f"{key} = {value:g}" for key, value in left_out.items() if value != usual[key]]
    if not told or scale is None:
        return None
    return f"note: not in the mission, so chosen for {scale.why}: {', '.join(told)}"
