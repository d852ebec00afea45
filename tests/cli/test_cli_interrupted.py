"""Ctrl-C ends a command with a word and 130 at any time, also while it is being loaded."""

from __future__ import annotations

import subprocess
import sys

import pytest

INTERRUPTED_AT = """
import sys

class Interrupts:
    def find_spec(self, name, *_):
        if name == {module!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupts())
from clearway.__main__ import main
main()
"""


@pytest.mark.parametrize(
    "module", ["clearway.cli.app", "typer", "clearway.cli.warm_up", "clearway.missions.setup"]
)
def test_while_a_module_is_loaded(module: str, tmp_path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_AT.format(module=module), "fly", "static-obstacles"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 130
    assert done.stderr.strip().splitlines()[-1].endswith("interrupted")
    assert "Traceback" not in done.stderr
