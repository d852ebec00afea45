"""Results are whole or absent."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clearway.base.errors import InputError
from clearway.io.staging import RESULTS, growing_file, name_results_folder, stage_file, stage_folder


def test_files_arrive_when_the_block_ends(tmp_path: Path) -> None:
    with stage_folder(tmp_path / "a" / "out") as folder:
        (folder / "one.txt").write_text("1")
        (folder / "inner").mkdir()
        (folder / "inner" / "two.txt").write_text("2")
        assert not (tmp_path / "a").exists()
    assert (tmp_path / "a/out/one.txt").read_text() == "1"
    assert (tmp_path / "a/out/inner/two.txt").read_text() == "2"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_other_files_stay_and_same_names_are_replaced(tmp_path: Path) -> None:
    (tmp_path / "old.txt").write_text("old")
    (tmp_path / "one.txt").write_text("old")
    with stage_folder(tmp_path) as folder:
        (folder / "one.txt").write_text("1")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "old.txt": "old",
        "one.txt": "1",
    }


def test_nothing_is_left_after_an_error(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match="cannot be written"),
        stage_folder(tmp_path / "out") as folder,
    ):
        (folder / "one.txt").write_text("1") and (folder / "one.txt" / "two.txt").write_text("2")
    assert list(tmp_path.iterdir()) == []


def test_a_pipe_stays_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with stage_file(pipe) as file:
        file.write_text("all of it")
    assert os.read(reader, 100) == b"all of it"
    os.close(reader)
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_full_device_is_named_and_stays() -> None:
    with pytest.raises(InputError, match="/dev/full"), stage_file("/dev/full") as file:
        file.write_text("more than fits")
    assert Path("/dev/full").is_char_device()


def test_a_file_takes_the_place_of_another_whole_or_not_at_all(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("before")
    with pytest.raises(UnicodeEncodeError), stage_file(table) as file:
        file.write_text("half of it, and then \ud800")
    assert table.read_text() == "before"
    with stage_file(table) as file:
        file.write_text("after")
    assert table.read_text() == "after"
    assert list(tmp_path.iterdir()) == [table]


def test_a_link_is_replaced_and_not_what_it_leads_to(tmp_path: Path) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    (tmp_path / "page.html").symlink_to(mine)
    with stage_file(tmp_path / "page.html") as file:
        file.write_text("page")
    assert not (tmp_path / "page.html").is_symlink()
    assert ((tmp_path / "page.html").read_text(), mine.read_text()) == ("page", "mine")


def test_a_file_that_grows_is_no_link_no_pipe_and_has_no_other_name(tmp_path: Path) -> None:
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    (tmp_path / "link").symlink_to(mine)
    (tmp_path / "nowhere").symlink_to(tmp_path / "new")
    (tmp_path / "hard").hardlink_to(mine)
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "nowhere", "hard", "pipe"):
        with (
            pytest.raises(InputError, match="cannot be written: it is"),
            growing_file(tmp_path / name) as file,
        ):
            file.write(b"journal")
    assert mine.read_text() == "mine"
    assert not (tmp_path / "new").exists()
    for _ in range(2):
        with growing_file(tmp_path / "own") as file:
            file.write(b"row\n")
    assert (tmp_path / "own").read_bytes() == b"row\nrow\n"


def test_a_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InputError, match="cannot be written"), stage_folder(tmp_path / "out"):
        pass


@pytest.mark.parametrize(
    ("name", "folder"),
    [
        ("round-a-ball", "round-a-ball"),
        ("Übung 3.1", "Übung 3.1"),
        ("../../etc/x", "etc-x"),
        ("C:\\x", "C--x"),
        ("..", "unnamed"),
        ("", "unnamed"),
    ],
)
def test_names_lead_nowhere_else(name: str, folder: str) -> None:
    assert name_results_folder(name) == RESULTS / folder
