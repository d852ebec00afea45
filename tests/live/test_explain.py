"""What decisions say of themselves."""

from __future__ import annotations

import pytest

from clearway.live.explain import called


@pytest.mark.parametrize(
    ("kind", "name", "said"),
    [
        ("intruder", "N1", "intruder N1"),
        ("intruder", "number 2", "intruder number 2"),
        ("intruder", "intruder", "intruder"),
        ("intruder", "Intruder 3", "Intruder 3"),
        ("intruder", "intruders of old", "intruder intruders of old"),
        ("map obstacle", "obstacle 4", "map obstacle 4"),
        ("map obstacle", "mast", "map obstacle mast"),
    ],
)
def test_a_name_that_says_what_it_names_is_not_said_twice(kind: str, name: str, said: str) -> None:
    assert called(kind, name) == said
