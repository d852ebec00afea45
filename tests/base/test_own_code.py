"""Functions of users by `module:name`: found where they lie, and told apart when they fail."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.rate.fusion import RATINGS, Evidence, assess_cells, rating_named
from clearway.base import own_code
from clearway.base.errors import ClearwayError, InputError, MissingExtraError, OwnCodeError
from clearway.base.grid import AvoidanceGrid
from clearway.base.own_code import load_own, shorten_own_name
from clearway.sim.baselines import PLANNERS

GOOD = """
from neighbour_{tag} import HALF

def careful(evidence, obstacle, unknown):
    return HALF * (1.0 - obstacle)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of the user's, the current one; what is imported from it is forgotten again."""
    monkeypatch.chdir(tmp_path)
    modules, path = set(sys.modules), list(sys.path)
    beside = list(own_code.list_looked_beside())
    yield tmp_path
    for name in set(sys.modules) - modules:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
    sys.path[:] = path
    own_code._NEIGHBOURS.folders[:] = beside


def written(folder: Path, name: str, text: str) -> None:
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(text)


def evidence() -> Evidence:
    return Evidence.free(AvoidanceGrid.uniform(10.0))


def test_a_module_of_the_current_folder_is_found_and_may_import_its_neighbours(
    folder: Path,
) -> None:
    written(folder, "mine_a", GOOD.format(tag="a"))
    written(folder, "neighbour_a", "HALF = 0.5")
    for name in ("mine_a:careful", "mine_a.py:careful", f"{folder}/mine_a.py:careful"):
        assert assess_cells(evidence(), rating_named(name)).rating == pytest.approx(0.5)
    assert AvoidanceSettings(rating="mine_a:careful").rating == "mine_a:careful"


def test_the_folder_of_the_file_comes_first_and_the_name_then_holds_anywhere(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place, value in ((folder, 0.25), (folder / "beside", 0.75)):
        written(place, "mine_b", f"def flat(e, o, u):\n    return {value} + 0.0 * o")
    there = RATINGS.locate("mine_b:flat", folder / "beside")
    assert there == f"{folder / 'beside' / 'mine_b.py'}:flat"
    assert shorten_own_name(there) == "mine_b.py:flat"
    here = RATINGS.locate("mine_b:flat")
    monkeypatch.chdir("/")
    # Both are called mine_b: neither takes the place of the other.
    assert assess_cells(evidence(), rating_named(there)).rating == pytest.approx(0.75)
    assert assess_cells(evidence(), rating_named(here)).rating == pytest.approx(0.25)


def test_a_file_of_the_name_of_a_library_is_itself_and_hides_nothing(folder: Path) -> None:
    written(folder, "json", "def flat(e, o, u):\n    return 0.5 + 0.0 * o")
    assert assess_cells(evidence(), rating_named("json:flat")).rating == pytest.approx(0.5)
    import json

    assert json.loads("1") == 1


def test_packages_are_imported_as_packages(folder: Path) -> None:
    written(folder / "pack_c", "__init__", "")
    written(folder / "pack_c", "values", "HALF = 0.5")
    written(
        folder / "pack_c", "mine", "from .values import HALF\ndef f(e, o, u): return HALF + 0 * o"
    )
    assert assess_cells(evidence(), rating_named("pack_c.mine:f")).rating == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("text", "name", "said"),
    [
        (None, "nowhere:careful", r"no module 'nowhere' in .*, or among installed packages"),
        (None, "nowhere.py:careful", r"no such file: .*nowhere\.py"),
        (None, "bad name:careful", "is no module"),
        (None, ":careful", "is not module:name"),
        (None, "mine_d:", "is not module:name"),
        ("def careful(): pass", "mine_d:carefull", r"did you mean 'careful'\?.*it has careful"),
        ("import sys; careful = 3.0", "mine_d:careful", r"is no function but float"),
        ("def careful(a): pass", "mine_d:careful", r"takes \(a\), but is called with \(evid"),
        ("1 / 0", "mine_d:careful", r"raised ZeroDivisionError: .*mine_d\.py, line 1\)"),
        ("import no_such_thing", "mine_d:careful", r"No module named 'no_such_thing'.*line 1"),
        ("import sys\nsys.exit(3)", "mine_d:careful", r"raised SystemExit: 3.*line 2"),
        ("def careful(:", "mine_d:careful", r"no valid Python: .*mine_d\.py, line 1"),
    ],
)
def test_what_cannot_be_used_says_where_and_why(
    folder: Path, text: str | None, name: str, said: str
) -> None:
    if text is not None:
        written(folder, "mine_d", text)
    with pytest.raises(OwnCodeError, match=said) as caught:
        rating_named(name)
    assert str(caught.value).startswith(f"rating {name}: ")


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return 1 / 0", r"raised ZeroDivisionError: division by zero \(.*mine_e\.py, line 2\)"),
        ("return obstacle[:-1]", r"an array \(349,\); one number a cell is \(350,\)"),
        ("return obstacle + 2.0", r"2 to 2: a rating is within \[0, 1\]"),
        ("return obstacle * float('nan')", "a rating is within"),
        ("return 'safe'", "gave str, no numbers"),
        ("return None", "a rating is within|an array"),
    ],
)
def test_a_rating_that_fails_in_flight_names_its_line(folder: Path, body: str, said: str) -> None:
    written(folder, "mine_e", f"def careful(evidence, obstacle, unknown):\n    {body}")
    with pytest.raises(OwnCodeError, match=said):
        assess_cells(evidence(), rating_named("mine_e:careful"))


def test_own_ratings_need_not_be_arrays_of_floats(folder: Path) -> None:
    written(folder, "mine_f", "def careful(e, o, u):\n    return [1] * len(o)")
    rated = assess_cells(evidence(), rating_named("mine_f:careful")).rating
    assert rated.dtype == np.float64


def test_without_a_colon_a_name_is_one_of_ours() -> None:
    for registry in (RATINGS, PLANNERS):
        with pytest.raises(ClearwayError, match="or your own as module:name"):
            registry.find("best")
    assert load_own("thing", "os.path:join") is not None


@pytest.mark.parametrize(
    "error",
    [
        OwnCodeError("planner mine:make", "raised"),
        InputError("file", ["one", "two"]),
        MissingExtraError("reading", "lidar"),
    ],
)
def test_errors_come_back_whole_from_worker_processes(error: ClearwayError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
