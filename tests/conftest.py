"""Fixtures that find the shared data, and skip with a reason where it is absent."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from repository import REPOSITORY

# No deadline: a machine may have other work. The same commit draws the same cases, so that a test
# fails for its author, not for the next one; a search for new cases is asked for:
# CLEARWAY_CASES=new.
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("new", deadline=None)
settings.load_profile(os.environ.get("CLEARWAY_CASES", "same"))


def shared_data() -> Path:
    """`CLEARWAY_DATA`, else `../shared/data` beside the checkout."""
    return Path(os.environ.get("CLEARWAY_DATA", REPOSITORY.parent / "shared" / "data"))


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of real scans, traffic, maps and missions."""
    folder = shared_data()
    if not folder.is_dir():
        pytest.skip("needs data: no real data; set CLEARWAY_DATA to its folder")
    return folder


@pytest.fixture(scope="session")
def known_answers() -> dict[str, Any]:
    """Reference arrays of an independent implementation."""
    path = shared_data().parent / "known_answers.json"
    if not path.is_file():
        pytest.skip("needs data: no known_answers.json beside the data folder")
    answers: dict[str, Any] = json.loads(path.read_text())
    return answers


@pytest.fixture(scope="session")
def made_samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `clearway sample` writes, once a process; `samples` is a copy of it."""
    from in_process import clearway

    folder = tmp_path_factory.mktemp("made") / "samples"
    assert clearway("sample", folder).exit_code == 0
    return folder


@pytest.fixture(scope="module")
def samples(made_samples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Samples that the tests of a file may write into."""
    folder = tmp_path_factory.mktemp("copied").resolve() / "samples"
    return Path(shutil.copytree(made_samples, folder))
