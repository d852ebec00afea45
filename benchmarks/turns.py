"""This version against another by turns: `python -m benchmarks.turns OTHER/src`.

A process of each does the same rows one after the other, a round of one and then a round of the
other, so that what slows the machine slows both. Times are CPU of one thread; ratios are medians
over the rounds, with their least and greatest.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import turn_rows

HERE = Path(__file__).resolve().parent.parent


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.turns", description=__doc__)
    parser.add_argument("other", type=Path, help="folder that holds the other version's package")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--only", default="", help="rows whose name contains it")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    sides = {
        "other": _worker(options.other, ""),
        "off": _worker(HERE / "src", "off"),
        "strict": _worker(HERE / "src", "strict"),
    }
    print(f"against {_ask(sides['other'], 'version')}, load {load:.1f} before; ms of CPU")
    print("| what | other | `off` | to other | `strict` | to other |\n|---|---|---|---|---|---|")
    for name in turn_rows.ROWS:
        if options.only in name:
            print(_row(name, sides, options.rounds), flush=True)
    for side in sides.values():
        side.communicate("")


def _row(name: str, sides: dict[str, Any], rounds: int) -> str:
    taken: dict[str, list[list[float]]] = {side: [] for side in sides}
    for _ in range(rounds + 1):  # The first one warms up.
        for side, worker in sides.items():
            taken[side].append(_ask(worker, name))
    table = {side: np.array(found[1:]) for side, found in taken.items()}
    cells = [name, _told(table["other"])]
    for side in ("off", "strict"):
        ratio = table[side][:, 0] / table["other"][:, 0]
        spread = f"{np.median(ratio):.2f} ({ratio.min():.2f} to {ratio.max():.2f})"
        cells += [_told(table[side]), spread]
    return "| " + " | ".join(cells) + " |"


def _told(rounds: Any) -> str:
    median, p99 = np.median(rounds, axis=0)
    return f"{median:.2f}, p99 {p99:.2f}"


def _worker(source: Path, escape: str) -> Any:
    words = [sys.executable, "-W", "ignore", str(Path(turn_rows.__file__).resolve()), escape]
    environment = os.environ | {"PYTHONPATH": str(source.resolve())}
    return subprocess.Popen(
        words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip


def _ask(worker: Any, name: str) -> Any:
    worker.stdin.write(name + "\n")
    worker.stdin.flush()
    return json.loads(worker.stdout.readline())


if __name__ == "__main__":
    main()
