"""A checkout of one loop, to be built in a second or two."""

from __future__ import annotations

from pathlib import Path

LOOP = '''"""One loop."""

from clearway.base.arrays import Floats1
from clearway.base.compiled import compiled


@compiled
def shifted(values: Floats1, by: float) -> float:
    """The sum of values, each shifted."""
    total = 0.0
    for k in range(len(values)):
        total += values[k] {sign} by
    return total
'''


def write_loop(root: Path, sign: str = "+") -> Path:
    """The file of the loop, written."""
    path = root / "src" / "clearway" / "base" / "small.py"
    path.write_text(LOOP.replace("{sign}", sign))
    return path


def small_tree(root: Path, arrays: Path) -> Path:
    """A checkout, with the names of array types that loops use."""
    base = root / "src" / "clearway" / "base"
    base.mkdir(parents=True)
    for folder in (base, base.parent):
        (folder / "__init__.py").touch()
    (base / "arrays.py").write_text(arrays.read_text())
    (base / "compiled.py").touch()
    write_loop(root)
    return root
