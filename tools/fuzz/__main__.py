"""Damaged files through the commands until the time is over: `python -m tools.fuzz --minutes 5`.

Each case is a function of format, seed and number, and runs in a worker that is watched: one that
dies, takes 20 s of processor time, or a gigabyte, is a finding like a traceback. Files that did so
are kept with what happened; `--replay FILE` tries one again.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import sys
import time
from collections import Counter, defaultdict
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from tools.fuzz.judge import Outcome
from tools.fuzz.run import Case, tried, whole_files
from tools.fuzz.seeds import FORMATS

CPU_S, WALL_S = 20.0, 300.0
MEMORY_BYTES = 1_000_000_000
"""Of data, beside what a worker has already."""
AT_LEAST_S = 0.005
"""Every format has the same time, of which a case takes this at least."""


def main() -> None:
    options = _options()
    if options.replay is not None:
        _replay(options.replay, options.format)
        return
    names = options.formats.split(",") if options.formats else list(FORMATS)
    names = [name for name in names if _usable(name)]
    options.out.mkdir(parents=True, exist_ok=True)
    count: Counter[str] = Counter()
    found: Counter[str] = Counter()
    end = time.monotonic() + 60.0 * options.minutes
    taken: dict[str, float] = defaultdict(float)
    worker = Worker()
    try:
        while time.monotonic() < end and sum(count.values()) < options.count:
            name = min(names, key=lambda one: (taken[one] + AT_LEAST_S * count[one], one))
            number = options.first + count[name]
            started = time.monotonic()
            outcome, faults = worker.tried(name, options.seed, number)
            if count[name]:  # The first one loads modules.
                taken[name] += time.monotonic() - started
            count[name] += 1
            if faults:
                _keep(options.out, name, options.seed, number, outcome, faults, found)
            if sum(count.values()) % 500 == 0:
                _progress(options.out, count, found)
    finally:
        worker.end()
        _progress(options.out, count, found)
    print(json.dumps({"tried": sum(count.values()), "by_format": dict(count),
                      "found": dict(found)}, indent=1))  # fmt: skip
    sys.exit(1 if found else 0)


def _options() -> Any:
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--count", type=int, default=10**9, help="cases at most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--formats", help=f"with commas between; there are {', '.join(FORMATS)}")
    parser.add_argument("--out", type=Path, default=Path("clearway-out/fuzz"))
    parser.add_argument("--replay", type=Path, help="a kept file")
    parser.add_argument("--format", help="of the file to replay; default: as its name says")
    return parser.parse_args()


def _usable(name: str) -> bool:
    try:
        if whole_files(name):
            return True
        why = "no whole file at hand"
    except ImportError as error:
        why = str(error)
    print(f"{name}: left out: {why}", file=sys.stderr)
    return False


class Worker:
    """A process that tries cases, and is started anew when one has ended it."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("fork")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_serve, args=(other,), daemon=False)
        self.process.start()
        other.close()

    def tried(self, name: str, seed: int, number: int) -> tuple[Outcome, list[str]]:
        self.pipe.send((name, seed, number))
        started, cpu = time.monotonic(), _cpu_s(self.process.pid)
        while not self.pipe.poll(0.5):
            used, passed = _cpu_s(self.process.pid) - cpu, time.monotonic() - started
            if used > CPU_S or passed > WALL_S:
                self.process.kill()
                self.process.join()
                self._start()
                fault = f"no end after {used:.0f} s of processor time, {passed:.0f} s in all"
                return Outcome(-1, "", ""), [fault]
        try:
            answer: tuple[Outcome, list[str]] = self.pipe.recv()
        except EOFError:
            self.process.join()
            status = self.process.exitcode
            self._start()
            return Outcome(-1, "", ""), [f"process ended with status {status}"]
        return answer

    def end(self) -> None:
        self.process.kill()
        self.process.join()


def _cpu_s(pid: int | None) -> float:
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, words[11:15])) / os.sysconf("SC_CLK_TCK")


def _serve(pipe: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    limited, loaded = False, set()
    while True:
        try:
            name, seed, number = pipe.recv()
        except EOFError:
            return
        if name not in loaded:
            loaded.add(name)
            tried(name, whole_files(name)[0])
        if not limited and len(loaded) == len(FORMATS):
            _limit_memory()
            limited = True
        case = Case(name, seed, number, whole_files(name))
        outcome, faults = tried(name, case.data)
        if "takes more memory than there is" in outcome.errors:
            faults.append("memory")
        pipe.send((outcome, faults))


def _limit_memory() -> None:
    data_pages = int(Path("/proc/self/statm").read_text().split()[5])
    most = data_pages * os.sysconf("SC_PAGE_SIZE") + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))


def _keep(
    out: Path,
    name: str,
    seed: int,
    number: int,
    outcome: Outcome,
    faults: list[str],
    found: Counter[str],
) -> None:
    """The file and what happened; of what happened before, only the first few."""
    kind = f"{name}: {faults[0][:70]}"
    found[kind] += 1
    if found[kind] > 3:
        return
    case = Case(name, seed, number, whole_files(name))
    path = out / f"{name}-{seed}-{number}{FORMATS[name].suffix}"
    path.write_bytes(case.data)
    told = [*faults, f"status {outcome.status}", outcome.raised, outcome.errors, outcome.output]
    path.with_name(path.name + ".told").write_text("\n".join(told), errors="backslashreplace")
    print(f"{path}: {'; '.join(faults)[:300]}", flush=True)


def _progress(out: Path, count: Counter[str], found: Counter[str]) -> None:
    state = {"tried": sum(count.values()), "by_format": dict(count), "found": dict(found)}
    (out / "progress.json").write_text(json.dumps(state, indent=1))


def _replay(path: Path, name: str | None) -> None:
    form = name or next(
        one for one in sorted(FORMATS, key=len, reverse=True) if path.name.startswith(one)
    )
    outcome, faults = tried(form, path.read_bytes())
    print(outcome.errors or outcome.output)
    print(f"status {outcome.status} {outcome.raised}; {'; '.join(faults) or 'nothing wrong'}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
