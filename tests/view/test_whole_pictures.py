"""Pictures cut off nothing that they show, and their legends name what is drawn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from tools.contact_sheet import DRAWINGS

from clearway.view.plot.style import Pictures
from flown_missions import SHORT
from in_process import clearway
from whole_pictures import flaws_of

GO_ON = frozenset(
    {"seen so far", "executed", "waypoints", "decisions", "intruder tracks", "intruders"}
)
"""What a picture of one moment shows only as far as it is near."""
LONG = "through the old town, past the tower and over the river to the northern landing place " * 2


Drawn = Callable[..., dict[str, list[str]]]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, samples: Path) -> Drawn:
    """Runs a command; the flaws of each picture that it keeps, as it keeps it."""
    found: dict[str, list[str]] = {}
    keep = Pictures.save

    def watched(self: Pictures, figure: Figure, folder: Path, name: str) -> str:
        file = keep(self, figure, folder, name)
        moment = name.startswith("snapshot") or name.endswith("first")
        found[name] = flaws_of(figure, GO_ON if moment else frozenset())
        return file

    monkeypatch.setattr(Pictures, "save", watched)

    def run(command: str) -> dict[str, list[str]]:
        out = tmp_path / "out"
        words = [word.replace("SAMPLES/", f"{samples}/") for word in command.split()]
        words = [word.replace("OUT/", f"{out}/") for word in words]
        done = clearway(*words, *([] if "OUT/" in command else ["--out", out]))
        assert done.exit_code in (0, 1, 3), done.stderr
        return found

    return run


@pytest.mark.parametrize(
    "command",
    [
        "map SAMPLES/masts.csv SAMPLES/zones-ed318.json",
        "map SAMPLES/place.osm",
        "map SAMPLES/zones-ed318.json",
        "traffic SAMPLES/copter.bin",
        "alerts SAMPLES/encounter.daa",
        "assess --scan SAMPLES/velodyne --poses SAMPLES/way.csv --all",
    ],
)
def test_nothing_is_cut_off_or_without_a_name(drawn: Drawn, command: str) -> None:
    pictures = drawn(command)
    assert pictures
    assert {name: flaws for name, flaws in pictures.items() if flaws} == {}


@pytest.mark.nightly
def test_a_flight_of_a_long_name_is_drawn_whole(drawn: Drawn, tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text(SHORT.replace("short <one>", LONG[:120].strip()))
    pictures = drawn(f"fly {tmp_path / 'long.toml'} --no-mcap")
    assert {"traffic", "obstacle-distance", "collision-distance", "visibility"} <= set(pictures)
    assert {name: flaws for name, flaws in pictures.items() if flaws} == {}


@pytest.mark.nightly
@pytest.mark.parametrize("command", [one.command for one in DRAWINGS if "SHEET" not in one.command])
def test_no_command_cuts_anything_off(drawn: Drawn, command: str) -> None:
    assert {name: flaws for name, flaws in drawn(command).items() if flaws} == {}


def test_what_is_cut_off_is_found() -> None:
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.subplots()
    axes.plot([0.0, 2.0], [0.0, 1.0], label="a", color="#123456")
    axes.set(xlim=(0.0, 1.0), title="far wider than three inches can be at this size of letters")
    flaws = " ".join(flaws_of(figure))
    for told in ("cut off at 0 and 1", "at the rim", "in no legend", "nothing names #123456"):
        assert told in flaws
