"""The house style: clearway's colour is nobody else's, vectors are the same each time."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from clearway.base.errors import InputError
from clearway.sim.baselines import PLANNERS
from clearway.view.plot.style import FORMATS, OWN, Pictures, house_style, line_of
from in_process import clearway
from repository import REPOSITORY

SIGNS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def figure() -> Figure:
    drawn = Figure(figsize=(3.0, 2.0))
    drawn.add_subplot().plot([0.0, 1.0], [0.0, 1.0], label="a")
    return drawn


def test_every_planner_has_a_look_of_its_own() -> None:
    looks = [line_of(number) for number in range(len(PLANNERS) - 1)]
    assert len(set(looks)) == len(looks)
    assert OWN not in {color for color, _ in looks}


@pytest.mark.parametrize("form", FORMATS)
def test_pictures_come_in_the_format_asked_for_and_alike_each_time(
    form: str, tmp_path: Path
) -> None:
    with house_style():
        names = [Pictures(form, 80).save(figure(), tmp_path, name) for name in ("a", "b")]
    first, second = ((tmp_path / name).read_bytes() for name in names)
    assert first.startswith(SIGNS[form])
    assert first == second


def test_the_style_ends_with_its_block() -> None:
    before = dict(mpl.rcParams)
    with house_style():
        assert mpl.rcParams["axes.spines.top"] is False
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(("form", "dpi", "told"), [("jpeg", 100, "--format"), ("png", 5, "--dpi")])
def test_what_is_no_format_is_refused(form: str, dpi: int, told: str) -> None:
    with pytest.raises(InputError, match=told):
        Pictures.check(form, dpi)


@pytest.mark.nightly
def test_a_command_draws_in_the_format_asked_for(tmp_path: Path) -> None:
    scene = REPOSITORY / "examples" / "scenes" / "two-balls.toml"
    done = clearway("assess", scene, "--out", tmp_path / "out", "--format", "svg")
    assert done.exit_code == 0, done.stderr
    assert list((tmp_path / "out").glob("*.svg"))
    assert not list((tmp_path / "out").glob("*.png"))
    done = clearway("assess", scene, "--out", tmp_path / "no", "--format", "svgg")
    assert (done.exit_code, "did you mean 'svg'?" in done.stderr) == (2, True)
    assert not (tmp_path / "no").exists()
