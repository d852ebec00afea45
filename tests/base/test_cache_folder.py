"""A cache is code: one that others can write into is refused, and nothing in it is loaded."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clearway.base.cache_folder import NAMED, cache_folder, is_private_folder, make_own, why_refused
from clearway.base.errors import InputError
from clearway.vehicle.automaton import MovementAutomaton
from own_process import run_clearway

IS_ROOT = os.geteuid() == 0


@pytest.fixture(autouse=True)
def forgetful() -> None:
    is_private_folder.cache_clear()


def test_a_folder_of_ones_own_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in (tmp_path, tmp_path / "new" / "one"):
        monkeypatch.setenv(NAMED, str(folder))
        assert cache_folder() == folder


@pytest.mark.parametrize("mode", [0o775, 0o757, 0o777, 0o1777])
def test_a_named_folder_that_others_can_write_into_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int
) -> None:
    tmp_path.chmod(mode)
    monkeypatch.setenv(NAMED, str(tmp_path))
    with pytest.raises(InputError, match=rf"mode {mode:o}.*chmod go-w {tmp_path}"):
        cache_folder()


def test_a_folder_below_one_that_everybody_can_write_into_is_refused(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    tmp_path.chmod(0o777)
    assert f"{tmp_path}: others can write" in str(why_refused(inner))
    assert why_refused(tmp_path / "new") is not None
    tmp_path.chmod(0o1777)  # As /tmp: nobody can put another folder in its place.
    assert why_refused(inner) is None


@pytest.mark.skipif(not IS_ROOT, reason="needs root: gives a folder away")
def test_a_folder_of_somebody_else_is_refused_but_one_of_root_is_not(tmp_path: Path) -> None:
    os.chown(tmp_path, 12345, 12345)
    assert "belongs to user 12345" in str(why_refused(tmp_path))
    link = tmp_path.parent / f"{tmp_path.name}-link"
    link.symlink_to(tmp_path.parent)
    assert why_refused(link) is None
    os.lchown(link, 12345, 12345)
    assert "belongs to user 12345" in str(why_refused(link))


def test_the_users_cache_is_left_alone_with_a_warning_if_others_can_write_into_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.delenv(NAMED, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = tmp_path / "clearway"
    assert cache_folder() == folder
    folder.mkdir()
    folder.chmod(0o777)
    is_private_folder.cache_clear()
    assert cache_folder() is cache_folder() is None
    assert [record.getMessage() for record in caplog.records] == [
        f"not used as a cache: {why_refused(folder)}"
    ]


def test_what_is_made_is_for_its_owner_alone_to_write(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        make_own(tmp_path / "one" / "two")
    finally:
        os.umask(before)
    assert why_refused(tmp_path / "one" / "two") is None
    assert {(tmp_path / name).stat().st_mode & 0o777 for name in ("one", "one/two")} == {0o755}


def test_a_command_names_the_folder_and_what_to_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(0o777)
    monkeypatch.setenv(NAMED, str(tmp_path))
    done = run_clearway("fly", "static-obstacles", "--no-plots", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert f"\n{NAMED}: {tmp_path}: others can write into it (mode 777)" in done.stderr
    assert not list(tmp_path.iterdir())


def test_reach_sets_are_built_where_no_cache_is_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    from clearway.base.grid import AvoidanceGrid
    from clearway.reach import store

    monkeypatch.setattr(store, "cache_folder", lambda: None)
    grid = AvoidanceGrid.uniform(4.0, 4, columns=3, rows=3)
    library = store.ReachLibrary.load_or_build(MovementAutomaton.plane(), grid)
    assert library.reach_sets
