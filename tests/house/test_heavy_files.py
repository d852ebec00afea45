"""Files of 10 MB that ask for much: bounded memory and time, and a message where one is due."""

from __future__ import annotations

import pytest
from tools.fuzz.heavy import taken, wrong
from tools.fuzz.heavy_files import HEAVY


@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(HEAVY))
def test_heavy_files_take_little(name: str) -> None:
    one = taken(name)
    assert not wrong(one), one


def test_a_list_of_nothing_is_told_after_a_few() -> None:
    """Of 200,000 wrong entries the first fifty are put into words."""
    one = taken("geojson-short")
    assert not wrong(one), one
    assert one.status == 2
    assert one.memory_bytes < 250_000_000
    assert "features[0]: should be a table" in one.said
