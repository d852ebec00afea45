"""Reading in a process of its own: where a library may end its process, or never end.

The process has so much memory and processor time, by the size of the file, and nothing of what it
prints is seen. What it sends back, or how it ended, is told like anything that a reader says.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import resource
import select
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import IO, Any, TypeVar

from clearway.base.errors import ClearwayError, InputError

MEMORY_BYTES, MEMORY_PER_BYTE = 700_000_000, 30
"""Of data, for the libraries and for each byte of the file."""
CPU_S, CPU_S_PER_BYTE = 20, 4e-6
LONGEST_WAIT_S = 600.0
"""For one answer, on a machine that is busy with something else."""
START = "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from clearway.io import apart; "
LENGTH = struct.Struct("<Q")
Result = TypeVar("Result")


def apart(path: Path, kind: str, function: Callable[..., Result], *arguments: object) -> Result:
    """What a function of a module returns, called elsewhere; it may raise ClearwayErrors.

    path, kind: the file that it reads, and what the file is called. Raises InputError where the
    call ends the process, or takes too much memory or time.
    """
    with contextlib.closing(_answers(path, kind, _one, function, *arguments)) as answers:
        result: Result = next(answers)
        return result


def items_apart(
    path: Path, kind: str, function: Callable[..., Iterator[Result]], *arguments: object
) -> Generator[Result, None, None]:
    """The same of a function that yields: one item after the other, as they are asked for."""
    return _answers(path, kind, function, *arguments)


def _one(function: Callable[..., Result], *arguments: object) -> Iterator[Result]:
    yield function(*arguments)


def _answers(
    path: Path, kind: str, function: Any, *arguments: object
) -> Generator[Any, None, None]:
    try:
        size = path.stat().st_size
    except OSError:
        size = 0
    limits = (MEMORY_BYTES + MEMORY_PER_BYTE * size, int(CPU_S + CPU_S_PER_BYTE * size))
    receiving, sending = os.pipe()
    command = f"{START}apart.serve({sending}, {limits})"
    process = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", command, json.dumps(sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        pass_fds=(sending,),
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )
    os.close(sending)
    try:
        with os.fdopen(receiving, "rb", buffering=0) as pipe:
            assert process.stdin is not None
            with contextlib.suppress(BrokenPipeError), process.stdin:
                pickle.dump((function, arguments), process.stdin, protocol=5)
            while True:
                answer = _received(pipe)
                if answer is None:
                    raise InputError(str(path), f"damaged {kind}: {_end_of(process)}")
                what, value = answer
                if what == "end":
                    return
                if what == "error":
                    raise value
                if what == "damage":
                    raise InputError(str(path), f"damaged or truncated {kind} ({value})")
                yield value
    finally:
        process.kill()
        process.wait()


def _end_of(process: subprocess.Popen[bytes]) -> str:
    """Why a process sends no more."""
    try:
        status = process.wait(1.0)
    except subprocess.TimeoutExpired:
        return "reading it does not come to an end"
    if status == -signal.SIGXCPU:
        return "reading it does not come to an end"
    if status >= 0:
        return f"the library that reads it ended (status {status})"
    return f"the library that reads it broke down ({signal.Signals(-status).name})"


def _received(pipe: IO[bytes]) -> Any:
    """The next answer; None where there is none any more."""
    deadline = time.monotonic() + LONGEST_WAIT_S
    count = _bytes(pipe, LENGTH.size, deadline)
    if count is None:
        return None
    parts = []
    for _ in range(LENGTH.unpack(count)[0]):
        size = _bytes(pipe, LENGTH.size, deadline)
        part = None if size is None else _bytes(pipe, LENGTH.unpack(size)[0], deadline)
        if part is None:
            return None
        parts.append(part)
    return pickle.loads(parts[0], buffers=parts[1:])


def _bytes(pipe: IO[bytes], count: int, deadline: float) -> bytearray | None:
    found = bytearray(count)
    view, at = memoryview(found), 0
    while at < count:
        ready, _, _ = select.select([pipe], [], [], max(0.0, deadline - time.monotonic()))
        read = pipe.readinto(view[at:]) if ready else 0  # type: ignore[attr-defined]
        if not read:
            return None
        at += read
    return found


def serve(sending: int, limits: tuple[int, int]) -> None:
    """What runs in the other process: call what is asked for on standard input, send what comes."""
    memory_bytes, cpu_s = limits
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_DATA, (memory_bytes, memory_bytes))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
    with os.fdopen(sending, "wb") as pipe:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)
            for item in function(*arguments):
                _send(pipe, ("item", item))
            _send(pipe, ("end", None))
        except ClearwayError as error:
            _send(pipe, ("error", error))
        except MemoryError:
            _send(pipe, ("damage", "it takes more memory than such a file can need"))
        except BaseException as error:  # a panic in Rust is no Exception
            reason = " ".join(str(error).split())[:160]
            _send(pipe, ("damage", f"{type(error).__name__}: {reason}"))


def _send(pipe: IO[bytes], answer: tuple[str, object]) -> None:
    """Pickled, large arrays as they are: the number of parts, then the size of each and itself."""
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(answer, protocol=5, buffer_callback=buffers.append)
    parts = [memoryview(head), *(one.raw() for one in buffers)]
    pipe.write(LENGTH.pack(len(parts)))
    for part in parts:
        pipe.write(LENGTH.pack(part.nbytes))
        pipe.write(part)
    pipe.flush()
