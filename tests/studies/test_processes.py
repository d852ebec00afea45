"""Worker processes: they find what users named, and nothing else of the working folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clearway.base import own_code
from clearway.studies.processes import run_in_processes

OWN = """
class Job:
    def __init__(self, number):
        self.number = number

    def __repr__(self):
        return f"job {self.number}"
"""


def test_workers_find_a_named_module_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own_job.py").write_text(OWN)
    for name in ("signal", "numpy", "pickle", "multiprocessing", "clearway"):
        (tmp_path / f"{name}.py").write_text("open('ran.txt', 'a').write(__name__)")
    beside = list(own_code.list_looked_beside())
    job = own_code.load_own("job", "own_job:Job")
    try:
        found = set(run_in_processes(repr, [job(1), job(2), job(3)], 2))
    finally:
        own_code._NEIGHBOURS.folders[:] = beside
    assert found == {"job 1", "job 2", "job 3"}
    assert not (tmp_path / "ran.txt").exists()
    assert "PYTHONSAFEPATH" not in os.environ
