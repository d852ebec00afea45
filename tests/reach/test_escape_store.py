"""Ways out kept between runs: what is loaded equals what was searched; nothing damaged is used."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from clearway.reach.escapes import store as escape_store
from clearway.reach.escapes.legs import Legs, legs_from_level
from clearway.reach.escapes.store import FoundWays, load_or_search, search_escapes
from clearway.reach.escapes.ways import BEGINNINGS, Ways
from clearway.reach.standard import standard_automata
from clearway.reach.store import SHIPPED
from clearway.vehicle.automaton import MovementAutomaton
from damage import DAMAGES

OTHER = MovementAutomaton.plane(turn_step_deg=30.0)
"""Of which nothing ships."""


def legs_for(automaton: MovementAutomaton) -> Legs:
    return legs_from_level(automaton)[1]


def same(one: FoundWays, other: FoundWays) -> bool:
    assert one.reach == other.widest
    for ways, others in zip(one.ways, other.ways, strict=True):
        for field, a, b in zip(Ways._fields, ways, others, strict=True):
            assert (a.dtype, a.tobytes()) == (b.dtype, b.tobytes()), field
    return True


@pytest.fixture
def never_searched(monkeypatch):
    monkeypatch.setattr(escape_store, "search_escapes", lambda *_: pytest.fail("it searches"))


def test_loaded_equals_searched_bit_for_bit(tmp_path, request):
    legs = legs_for(OTHER)
    searched = load_or_search(OTHER, legs, tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    request.getfixturevalue("never_searched")
    assert same(searched, load_or_search(OTHER, legs, tmp_path))


@pytest.mark.usefixtures("never_searched")
@pytest.mark.parametrize("speed_mps", [1.0, 15.0])
def test_what_ships_serves_every_speed(tmp_path, speed_mps):
    automaton = MovementAutomaton.plane(speed_mps=speed_mps)
    assert load_or_search(automaton, legs_for(automaton), tmp_path).reach > 0.0
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_searched_anew(tmp_path, damage):
    legs = legs_for(OTHER)
    searched = load_or_search(OTHER, legs, tmp_path)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert same(searched, load_or_search(OTHER, legs, tmp_path))
    assert path.read_bytes() == whole


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    assert load_or_search(OTHER, legs_for(OTHER), blocked / "cache").ways


def test_what_ships_is_what_would_be_found():
    """Whoever changes the search runs `python -m clearway.reach.standard`, raising the version."""
    for automaton in standard_automata():
        legs = legs_for(automaton)
        assert (SHIPPED / escape_store.name_of(escape_store.hash_escapes(automaton, legs))).exists()
        assert same(load_or_search(automaton, legs), search_escapes(automaton, legs))


def flown(ways: Ways, legs: Legs, at: int) -> tuple[list[int], np.ndarray]:
    """Movements of a beginning, and the pose [4] at its end."""
    movements: list[int] = []
    chain = [at]
    while ways.parent[chain[0]] >= 0:
        movements.insert(0, int(ways.movement[chain[0]]))
        chain.insert(0, int(ways.parent[chain[0]]))
    pose = np.zeros(4)
    for before, movement in zip(chain, movements, strict=False):
        step = legs.path[ways.attitude[before], movement, -1]
        cosine, sine = np.cos(pose[3]), np.sin(pose[3])
        turned = [cosine * step[0] - sine * step[1], sine * step[0] + cosine * step[1], *step[2:]]
        pose = pose + turned
    return movements, pose


def test_beginnings_come_by_their_length_and_change_no_oftener_than_allowed():
    automaton = MovementAutomaton.plane()
    legs = legs_for(automaton)
    ways = search_escapes(automaton, legs).ways[0]
    lengths, places = [], set()
    for at in range(len(ways.parent)):
        assert ways.parent[at] < at
        movements, pose = flown(ways, legs, at)
        lengths.append(len(movements))
        changes = min(len(movements), 1) + sum(a != b for a, b in pairwise(movements))
        assert any(changes <= most and len(movements) <= deep for most, deep in BEGINNINGS)
        places.add((*np.round(pose, 3).tolist(), int(ways.attitude[at])))
    # Three changes are allowed in short ones, and lead where two do not.
    assert any(
        len(movements) == 4 and len(set(pairwise(movements))) == 3
        for movements in (flown(ways, legs, at)[0] for at in range(len(lengths)))
    )
    assert lengths == sorted(lengths)
    assert len(places) == len(lengths)
    assert np.all(np.diff(ways.begins) >= 0)
