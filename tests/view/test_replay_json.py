"""Messages of a replay as JSON: as Python writes it, and never what is no number."""

from __future__ import annotations

import json

import pytest

from clearway.view.replay.writing import _as_json


def test_messages_are_written_as_python_writes_them() -> None:
    message = {"time_s": 0.1, "cells": [1e-5, 1.0, 84.65], "told": "NaN of Infinity", "none": None}
    assert _as_json(message) == json.dumps(message, separators=(",", ":")).encode()
    assert json.loads(_as_json({"small": 1e-300, "large": 1e300})) == {
        "small": 1e-300,
        "large": 1e300,
    }


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_no_finite_number_is_not_written(value: float) -> None:
    with pytest.raises(ValueError, match="JSON compliant"):
        _as_json({"margin_m": [1.0, value]})
