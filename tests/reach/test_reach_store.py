"""The library: what is loaded equals what was built, and nothing damaged is used."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.reach import store
from clearway.reach.store import ReachLibrary
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton
from damage import DAMAGES

PLANE = MovementAutomaton.plane()
GRID = AvoidanceGrid.uniform(6.0, 6)


@pytest.fixture
def library(tmp_path):
    return ReachLibrary.load_or_build(PLANE, GRID, folder=tmp_path)


def same(first, second):
    for one, other in zip(first.reach_sets, second.reach_sets, strict=True):
        for field in dataclasses.fields(ReachSet):
            a, b = getattr(one, field.name), getattr(other, field.name)
            if isinstance(a, np.ndarray):
                assert (a.dtype, a.tobytes()) == (b.dtype, b.tobytes()), field.name
            elif field.name != "grid":
                assert a == b
    return True


def load(folder, **options):
    heard, steps = [], []
    loaded = ReachLibrary.load_or_build(
        MovementAutomaton.plane(),
        AvoidanceGrid.uniform(6.0, 6),
        folder=folder,
        notice=heard.append,
        progress=lambda done, total: steps.append((done, total)),
        **options,
    )
    return loaded, heard, steps


def test_one_set_per_start_pitch(library):
    pitches = [each.start_pitch_rad for each in library.reach_sets]
    assert np.degrees(pitches) == pytest.approx([-30, -15, 0, 15, 30])
    assert library.nearest(np.radians(9)) is library.reach_sets[3]
    assert library.nearest(np.radians(-80)) is library.reach_sets[0]
    assert library.nearest(np.radians(7.5)) is library.reach_sets[2]


def test_loaded_equals_built_bit_for_bit(library, tmp_path):
    loaded, heard, steps = load(tmp_path)
    assert same(library, loaded)
    assert (heard, steps) == ([], [])
    assert same(loaded, ReachLibrary.build(PLANE, GRID))


def older(data):
    return data[: len(store.KIND.magic)] + struct.pack("<I", 0) + data[19:]


@pytest.mark.parametrize("damage", [*DAMAGES.values(), older], ids=[*DAMAGES, "old"])
def test_damaged_file_is_rebuilt_with_a_notice(library, tmp_path, damage):
    (path,) = tmp_path.glob("*.bin")
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    rebuilt, heard, steps = load(tmp_path)
    assert len(heard) == 1
    assert "building the reach sets anew" in heard[0]
    assert steps[-1] == (5, 5)
    assert same(library, rebuilt)
    assert path.read_bytes() == whole


def test_other_settings_take_another_file(tmp_path):
    load(tmp_path)
    for other in (
        lambda: load(tmp_path, method="harmonic"),
        lambda: load(tmp_path, tuning={"nodes_per_cell": 3.0}),
        lambda: ReachLibrary.load_or_build(
            MovementAutomaton.plane(speed_mps=1.01), GRID, folder=tmp_path
        ),
        lambda: ReachLibrary.load_or_build(
            PLANE, AvoidanceGrid.uniform(6.0, 6, azimuth_deg=44.0), folder=tmp_path
        ),
    ):
        before = len(list(tmp_path.iterdir()))
        other()
        assert len(list(tmp_path.iterdir())) == before + 1


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    built, heard, _ = load(blocked / "cache")
    assert len(built.reach_sets) == 5
    assert len(heard) == 1
    assert "cannot be stored" in heard[0]


def test_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    assert store.cache_folder() == tmp_path
    monkeypatch.delenv("CLEARWAY_CACHE")
    assert store.cache_folder().name == "clearway"


def test_a_set_alone_equals_the_one_in_the_library(library):
    from clearway.reach.sets import build_reach_set

    pitch = PLANE.start_pitches_rad[1]
    alone = build_reach_set(PLANE, GRID, method="flying", start_pitch_rad=pitch)
    assert alone.samples_m.tobytes() == library.reach_sets[1].samples_m.tobytes()


def test_shipped_libraries_are_those_that_would_be_built(tmp_path):
    """Whoever changes a selection runs `python -m clearway.reach.standard`, and raises VERSION."""
    from clearway.reach.standard import standard_automata, standard_libraries

    for automaton, grid in standard_libraries():
        shipped = ReachLibrary.load_or_build(
            automaton, grid, folder=tmp_path, progress=lambda *_: pytest.fail("it builds")
        )
        assert same(shipped, ReachLibrary.build(automaton, grid))
    assert not list(tmp_path.iterdir())
    files = list(store.SHIPPED.glob("*.bin"))
    assert len(files) == len(standard_libraries()) + len(standard_automata())
    assert sum(file.stat().st_size for file in files) < 2_000_000
