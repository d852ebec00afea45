"""A folder of results holds one run: it is looked at before any work, and replaced whole."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from clearway.base.errors import InputError
from clearway.io.results_folder import LIST, TELLING, ResultsFolder, refuse_unwritable_file
from in_process import clearway


def write(folder: ResultsFolder, *names: str) -> None:
    with folder.write() as scratch:
        for name in names:
            (scratch / name).parent.mkdir(parents=True, exist_ok=True)
            (scratch / name).write_text(f"{folder.of} {name}")


def names(path: Path) -> set[str]:
    return {found.relative_to(path).as_posix() for found in path.rglob("*") if found.is_file()} - {
        LIST
    }


def test_the_next_run_of_the_same_takes_the_place_of_the_last_one_whole(tmp_path: Path) -> None:
    out = tmp_path / "out"
    write(ResultsFolder.check(out, "fly", "a"), "summary.json", "run.mcap", "x/flight.png")
    (out / "notes.txt").write_text("somebody's own")
    write(ResultsFolder.check(out, "fly", "a"), "summary.json")
    assert names(out) == {"summary.json", "notes.txt"}


def test_what_adds_keeps_what_is_there_and_knows_it_afterwards(tmp_path: Path) -> None:
    for name in ("one.png", "two.png"):
        write(ResultsFolder.check(tmp_path / "out", "reach-set", "", adds=True), name)
    found = ResultsFolder.check(tmp_path / "out", "reach-set", "", adds=True)
    assert set(found.before) == names(tmp_path / "out") == {"one.png", "two.png"}


@pytest.mark.parametrize("of", ["a", "b"])
@pytest.mark.parametrize("before", [False, True])
def test_of_two_runs_at_once_the_first_to_end_stays(tmp_path: Path, of: str, before: bool) -> None:
    """Whether both are of the same thing or not, and whether something was there before."""
    out = tmp_path / "out"
    if before:
        write(ResultsFolder.check(out, "fly", "a"), "summary.json")
    slow = ResultsFolder.check(out, "fly", "a")
    if before and of != "a":
        return  # Refused when it began.
    quick = ResultsFolder.check(out, "fly", of)
    write(quick, "summary.json", "intruders.csv")
    with pytest.raises(InputError, match="another run has written into it since this one began"):
        write(slow, "summary.json", "flight.png")
    assert names(out) == {"summary.json", "intruders.csv"}
    assert (out / "summary.json").read_text() == f"{of} summary.json"


def test_what_two_runs_at_once_add_is_known_afterwards(tmp_path: Path) -> None:
    out = tmp_path / "out"
    one, two = (ResultsFolder.check(out, "reach-set", "", adds=True) for _ in range(2))
    write(one, "one.png")
    write(two, "two.png")
    found = ResultsFolder.check(out, "reach-set", "", adds=True)
    assert set(found.before) == names(out) == {"one.png", "two.png"}


@pytest.mark.parametrize(("command", "of"), [("fly", "b"), ("compare", "a")])
def test_results_of_something_else_are_refused(tmp_path: Path, command: str, of: str) -> None:
    write(ResultsFolder.check(tmp_path / "out", "fly", "a"), "summary.json")
    with pytest.raises(InputError, match=r"holds the results of `clearway fly a`; give another"):
        ResultsFolder.check(tmp_path / "out", command, of)
    assert names(tmp_path / "out") == {"summary.json"}


@pytest.mark.parametrize("name", TELLING)
def test_files_that_no_list_tells_of_are_not_replaced(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="is there already"):
        ResultsFolder.check(tmp_path, "fly", "a")
    assert (tmp_path / name).read_text() == "mine"


@pytest.mark.parametrize("text", ["", "[]", '{"command": "fly"}', '{"command": 1}', "\x00"])
def test_a_damaged_list_is_none(tmp_path: Path, text: str) -> None:
    write(ResultsFolder.check(tmp_path, "fly", "a"), "summary.json")
    (tmp_path / LIST).write_text(text)
    with pytest.raises(InputError, match="is there already"):
        ResultsFolder.check(tmp_path, "fly", "a")


@pytest.mark.parametrize("name", ["../mine.txt", "/etc/none", ""])
def test_a_list_never_removes_what_lies_elsewhere(tmp_path: Path, name: str) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    out = tmp_path / "out"
    out.mkdir()
    (out / LIST).write_text(json.dumps({"command": "fly", "of": "a", "files": [name]}))
    write(ResultsFolder.check(out, "fly", "a"), "flight.png")
    assert (tmp_path / "mine.txt").read_text() == "mine"


def planted(tmp_path: Path, files: list[object]) -> tuple[Path, Path]:
    """A stranger's run folder with a link to somebody's file and to its folder; that file."""
    mine = tmp_path / "home" / "mine.txt"
    mine.parent.mkdir()
    mine.write_text("mine")
    out = tmp_path / "out"
    out.mkdir()
    (out / "inner").symlink_to(mine.parent)
    (out / "flight.png").symlink_to(mine)
    (out / "track.csv").hardlink_to(mine)
    (out / LIST).write_text(json.dumps({"command": "fly", "of": "a", "files": files}))
    return out, mine


@pytest.mark.parametrize(
    "name", ["inner/mine.txt", "flight.png", "inner", "track.csv", "./inner/../inner/mine.txt"]
)
def test_a_run_removes_nothing_that_links_of_its_folder_lead_to(tmp_path: Path, name: str) -> None:
    out, mine = planted(tmp_path, [name, "summary.json"])
    (out / "summary.json").write_text("{}")
    if ".." in name:
        with pytest.raises(InputError, match="is there already"):
            ResultsFolder.check(out, "fly", "a")
    else:
        write(ResultsFolder.check(out, "fly", "a"), "run.mcap")
        assert not (out / "summary.json").exists()
    assert [one.name for one in mine.parent.iterdir()] == ["mine.txt"]
    assert mine.read_text() == "mine"


@pytest.mark.parametrize("name", ["flight.png", "track.csv", "inner/mine.txt", "inner/new.txt"])
def test_a_run_writes_nothing_that_links_of_its_folder_lead_to(tmp_path: Path, name: str) -> None:
    out, mine = planted(tmp_path, ["summary.json"])
    folder = ResultsFolder.check(out, "fly", "a")
    if name.startswith("inner"):
        with pytest.raises(InputError, match="inner: cannot be written into: it is a link"):
            write(folder, "summary.json", name)
        assert not (out / "summary.json").exists()
    else:
        write(folder, "summary.json", name)
        assert (out / name).read_text() == f"a {name}"
        assert not (out / name).is_symlink()
    assert [one.name for one in mine.parent.iterdir()] == ["mine.txt"]
    assert mine.read_text() == "mine"


@pytest.mark.parametrize(
    "files", [[1], [None], [["x"]], ["\0"], ["x" * 256], {"a": 1}, "summary.json"]
)
def test_a_list_of_what_is_no_name_is_none(tmp_path: Path, files: object) -> None:
    (tmp_path / "summary.json").write_text("{}")
    (tmp_path / LIST).write_text(json.dumps({"command": "fly", "of": "a", "files": files}))
    with pytest.raises(InputError, match="is there already"):
        ResultsFolder.check(tmp_path, "fly", "a")


def test_a_list_is_a_file_of_its_own(tmp_path: Path) -> None:
    """Neither a pipe, which to open blocks, nor one of somebody else's, nor one without end."""
    elsewhere = tmp_path / "list.json"
    elsewhere.write_text(json.dumps({"command": "fly", "of": "a", "files": []}))
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("{}")
    for plant in (
        lambda path: path.symlink_to(elsewhere),
        lambda path: path.symlink_to("/dev/zero"),
        os.mkfifo,
        lambda path: path.write_text("[" * 100_000),
        lambda path: path.write_bytes(b" " * 20_000_000),
    ):
        plant(out / LIST)
        with pytest.raises(InputError, match="is there already"):
            ResultsFolder.check(out, "fly", "a")
        (out / LIST).unlink()


def test_an_error_leaves_the_run_before(tmp_path: Path) -> None:
    write(ResultsFolder.check(tmp_path, "fly", "a"), "summary.json")

    def broken() -> None:
        with ResultsFolder.check(tmp_path, "fly", "a").write() as scratch:
            (scratch / "run.mcap").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken()
    assert names(tmp_path) == {"summary.json"}


def test_a_file_is_no_folder_and_a_folder_no_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out is a file; a folder is needed"):
        ResultsFolder.check(tmp_path / "file", "fly", "a")
    with pytest.raises(InputError, match="cannot be written"):
        ResultsFolder.check(tmp_path / "file" / "inner", "fly", "a")
    with pytest.raises(InputError, match="--out is a device; a folder is needed"):
        ResultsFolder.check(Path("/dev/null"), "fly", "a")
    with pytest.raises(InputError, match="--html is a device; a file is needed"):
        refuse_unwritable_file(Path("/dev/null"), "--html")
    with pytest.raises(InputError, match="--html is a folder; a file is needed"):
        refuse_unwritable_file(tmp_path, "--html")
    with pytest.raises(InputError, match="cannot be written"):
        ResultsFolder.check(Path("/proc/nowhere"), "fly", "a")


def test_to_look_leaves_nothing(tmp_path: Path) -> None:
    ResultsFolder.check(tmp_path / "a" / "b", "fly", "a")
    refuse_unwritable_file(tmp_path / "a" / "b.csv", "--out")
    assert list(tmp_path.iterdir()) == []


def test_nobody_is_told_to_read_the_folder_that_results_were_to_go_to(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"")
    (tmp_path / "summary.json").write_text("{}")
    done = clearway("fly", "intruders", "--no-plots", "--out", tmp_path)
    assert done.exit_code == 2
    assert "--out: " in done.stderr
    assert "it looks like" not in done.stderr
