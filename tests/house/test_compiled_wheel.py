"""Compiled code for the wheel: all of it each time, with what another Python has added."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tools import compiled


def test_a_second_build_has_all_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "shipped"
    loops = ["a-1/f.cpython-311.kernel", "b-1/g.cpython-311.kernel"]

    def warm_up(_command: list[str], *, env: dict[str, str], check: bool) -> None:
        """As the real one: what is shipped already is loaded, and not compiled."""
        assert check
        for loop in loops:
            if not (folder / loop).is_file():
                made = Path(env["CLEARWAY_CACHE"]) / "compiled" / loop
                made.parent.mkdir(parents=True, exist_ok=True)
                made.write_bytes(b"code")

    def held() -> list[Any]:
        return sorted(one.relative_to(folder).as_posix() for one in folder.rglob("*.kernel"))

    monkeypatch.setattr(compiled.subprocess, "run", warm_up)
    assert compiled.make(folder) == 2
    for stale in ("a-1/f.cpython-312.kernel", "a-0/f.cpython-311.kernel"):
        (folder / stale).parent.mkdir(exist_ok=True)
        (folder / stale).write_bytes(b"code")
    assert compiled.make(folder) == 3
    assert held() == ["a-1/f.cpython-311.kernel", "a-1/f.cpython-312.kernel", loops[1]]
