"""Three short programs: a scan rated in a notebook, a batch into a table, a live loop at 10 Hz."""

from __future__ import annotations

import ast
import json
import re
import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import clearway as cw
from repository import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
NOTEBOOK, BATCH, LIVE = (EXAMPLES / n for n in ("rate_a_scan.ipynb", "batch.py", "live_loop.py"))


def lines(code: str) -> int:
    """Lines that are neither empty nor a comment."""
    return sum(1 for line in code.splitlines() if line.strip() and not line.strip().startswith("#"))


def cells() -> list[str]:
    """Code of the notebook, cell by cell."""
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    assert all(not cell.get("outputs") for cell in notebook["cells"])
    return ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]


def shown(cell: str, names: dict[str, Any]) -> Any:
    """Run a cell as a notebook does: the value of its last line is what it shows."""
    *before, last = ast.parse(cell).body
    exec(compile(ast.Module(before, []), "cell", "exec"), names)
    assert isinstance(last, ast.Expr)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def test_the_programs_are_as_short_as_promised() -> None:
    assert lines("\n".join(cells())) <= 8
    assert lines(BATCH.read_text()) <= 10
    assert lines(LIVE.read_text()) <= 25


def test_they_use_promised_names_only() -> None:
    for code in ("\n".join(cells()), BATCH.read_text(), LIVE.read_text()):
        used = set(re.findall(r"\bcw\.(\w+)", code))
        assert len(used) >= 2
        assert used <= set(cw.__all__)
        assert "from clearway" not in code


def test_a_notebook_loads_a_scan_rates_it_and_draws_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(EXAMPLES)
    names: dict[str, Any] = {}
    scan, rated, drawn = (shown(cell, names) for cell in cells())
    assert "circle" in scan._repr_html_()
    assert "polyline" in rated._repr_html_()
    assert isinstance(drawn, Figure)
    assert rated.cells.obstacle.max() > 0.5


def test_a_batch_of_changed_missions_becomes_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    code = BATCH.read_text()
    assert "FLIGHTS, SHOWN = 100," in code
    names: dict[str, Any] = {}
    exec(
        compile(code.replace("FLIGHTS, SHOWN = 100,", "FLIGHTS, SHOWN = 2,"), "batch", "exec"),
        names,
    )
    flights = names["flights"]
    assert len(flights) == 2
    assert flights["safe"].all()
    assert flights["time_s"].nunique() == 2
    assert "min_obstacle_distance_m" in capsys.readouterr().out


def test_a_live_loop_passes_the_trunk_at_10_hz(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = [100.0]
    asleep: list[float] = []

    def sleep(seconds: float) -> None:
        asleep.append(seconds)
        clock[0] += seconds

    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(time, "sleep", sleep)
    names: dict[str, Any] = {}
    exec(compile(LIVE.read_text(), "live", "exec"), names)
    assert asleep == pytest.approx([0.1] * len(asleep))
    assert 120 <= len(asleep) <= 250
    system = names["system"]
    assert system.progress.is_done(names["mission"])
    assert not [reason for reason in system.counts if "contradict" in reason or "stale" in reason]
    told = capsys.readouterr().out
    assert "EMERGENCY" not in told
    assert "ruled out" in told


def test_the_scan_of_the_examples_is_made_up_and_small(tmp_path: Path) -> None:
    path = EXAMPLES / "scenes" / "street.pcd"
    assert path.stat().st_size < 50_000
    shutil.copy(path, tmp_path)
    assert cw.read_scan(tmp_path / "street.pcd").source.endswith("street.pcd")
