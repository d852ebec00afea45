"""Files of 10 MB that ask for much: nothing at all millions of times, or packed a thousandfold.

`python -m tools.fuzz.heavy [--only WORD]` reads each through its command in a process of its own
and prints the most memory that it and its children had together, the time, and what it said.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from tools.fuzz.heavy_files import HEAVY
from tools.fuzz.run import placed
from tools.fuzz.seeds import FORMATS

MOST_BYTES, MOST_S = 1_000_000_000, 300.0
"""That a command may take; of processor time."""
POLLED_S = 0.02
LASTS_S = 900.0


class Taken(NamedTuple):
    """What reading a file took and said."""

    memory_bytes: int
    """Of the process and its children, at once."""
    cpu_s: float
    status: int
    said: str
    """On standard error."""
    ended: bool = True


def taken(name: str, limit_s: float = LASTS_S) -> Taken:
    """A heavy file through its command, in a process of its own."""
    heavy = HEAVY[name]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        words, _ = placed(FORMATS[heavy.format], heavy.format, heavy.make(), folder)
        with (folder / "said").open("wb") as said:
            process = subprocess.Popen(
                [sys.executable, "-m", "clearway", *words],
                cwd=folder,
                stdout=subprocess.DEVNULL,
                stderr=said,
                start_new_session=True,
            )
            most, cpu, started = 0, 0.0, time.monotonic()
            while process.poll() is None:
                now, used = _of_tree(process.pid)
                most, cpu = max(most, now), max(cpu, used)
                if time.monotonic() - started > limit_s:
                    process.kill()
                    process.wait()
                    return Taken(most, cpu, -1, "", ended=False)
                time.sleep(POLLED_S)
        return Taken(most, cpu, process.returncode, (folder / "said").read_text("utf-8", "replace"))


def _of_tree(pid: int) -> tuple[int, float]:
    """Memory and processor time of a process and its children; the most that each has had."""
    memory, cpu = 0, 0.0
    for one in (pid, *_children(pid)):
        try:
            status = Path(f"/proc/{one}/status").read_text()
            times = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        memory += next(
            (1024 * int(line.split()[1]) for line in status.splitlines() if "VmHWM" in line), 0
        )
        cpu += 0.01 * sum(map(int, times[11:15]))
    return memory, cpu


def _children(pid: int) -> list[int]:
    try:
        words = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return []
    return [int(word) for word in words]


def wrong(one: Taken) -> list[str]:
    """What a command may not do with such a file."""
    found = []
    if not one.ended or one.cpu_s > MOST_S:
        found.append(f"{one.cpu_s:.0f} s of processor time")
    if one.memory_bytes > MOST_BYTES:
        found.append(f"{one.memory_bytes / 1e6:.0f} MB")
    if one.status not in (-1, 0, 1, 2, 3):
        found.append(f"status {one.status}")
    if "takes more memory" in one.said or "Traceback" in one.said:
        found.append(one.said[:300])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="parts of the names of those to try, by commas")
    parser.add_argument("--after", default="", help="those after this one")
    options = parser.parse_args()
    names = list(HEAVY)
    names = names[names.index(options.after) + 1 :] if options.after else names
    for name in names:
        if any(part in name for part in options.only.split(",")):
            one = taken(name)
            said = " | ".join(
                line for line in one.said.splitlines() if not line.startswith("preparing")
            )
            print(
                f"{name:24} {one.memory_bytes / 1e6:6.0f} MB {one.cpu_s:6.1f} s "
                f"status {one.status:3d} {'WRONG ' if wrong(one) else ''}{said[:110]}",
                flush=True,
            )


if __name__ == "__main__":
    main()
