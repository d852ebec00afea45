"""Reading in a process of its own: where a library may end its process, or never end.

The process, forked by `readers`, has so much memory and processor time, by the size of the file,
and nothing of what it prints is seen. What it sends back, or how it ended, is reported like
anything that a reader says.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import resource
import select
import signal
import struct
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import IO, Any, TypeVar

from clearway.base.errors import ClearwayError, InputError
from clearway.io.foreign_errors import TOO_MUCH
from clearway.io.readers import ALONE, Reader, folder, reader

MEMORY_BYTES = 700_000_000
MEMORY_PER_BYTE = 30
"""Of data, for the libraries and for each byte of the file."""
CPU_S = 20
CPU_S_PER_BYTE = 4e-6
LONGEST_WAIT_S = 600.0
"""For one answer, on a machine that is busy with something else."""
LENGTH = struct.Struct("<Q")
Result = TypeVar("Result")


def apart(
    path: Path,
    kind: str,
    function: Callable[..., Result],
    *arguments: object,
    size: int | None = None,
) -> Result:
    """What a function of a module returns, called elsewhere; it may raise ClearwayErrors.

    path, kind: the file that it reads, and what the file is called. size: bytes of all files that
    it reads, where these are others. Raises InputError where the call ends the process, or takes
    too much memory or time.
    """
    module = _module_of(function)
    work = (_one, function, *arguments)
    with contextlib.closing(_answers(path, kind, module, _size(path, size), *work)) as answers:
        result: Result = next(answers)
        return result


def items_apart(
    path: Path,
    kind: str,
    function: Callable[..., Iterator[Result]],
    *arguments: object,
    size: int | None = None,
) -> Generator[Result, None, None]:
    """The same of a function that yields: one item after the other, as they are asked for."""
    return _answers(path, kind, _module_of(function), _size(path, size), function, *arguments)


def _size(path: Path, known: int | None) -> int:
    if known is not None:
        return known
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _module_of(function: Callable[..., object]) -> str:
    return getattr(function, "__module__", None) or "builtins"


def _one(function: Callable[..., Result], *arguments: object) -> Iterator[Result]:
    yield function(*arguments)


def _answers(
    path: Path, kind: str, module: str, size: int, function: Any, *arguments: object
) -> Generator[Any, None, None]:
    limits = (MEMORY_BYTES + MEMORY_PER_BYTE * size, int(CPU_S + CPU_S_PER_BYTE * size))
    (receiving, sending), (asked, asking) = os.pipe(), os.pipe()
    try:
        process = reader(module, asked, sending)
    except BaseException:
        os.close(receiving)
        os.close(asking)
        raise
    finally:
        os.close(sending)
        os.close(asked)
    try:
        with contextlib.suppress(BrokenPipeError), os.fdopen(asking, "wb") as ask:
            pickle.dump((limits, folder(), {**os.environ, **ALONE}), ask, protocol=5)
            pickle.dump((function, arguments), ask, protocol=5)
        with os.fdopen(receiving, "rb", buffering=0) as pipe:
            while True:
                answer = _receive(pipe)
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
        process.close()


def _end_of(process: Reader) -> str:
    """Why a process sends no more."""
    status = process.status()
    if status is None or status == -signal.SIGXCPU:
        return "reading it does not come to an end"
    if status >= 0:
        return f"the library that reads it ended (status {status})"
    return f"the library that reads it broke down ({signal.Signals(-status).name})"


def _receive(pipe: IO[bytes]) -> Any:
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


def serve_fds(asked: int, sending: int) -> None:
    """What runs in the other process: call what is asked for, send what comes."""
    with os.fdopen(asked, "rb") as asking, os.fdopen(sending, "wb") as pipe:
        try:
            (memory_bytes, cpu_s), place, environment = pickle.load(asking)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_DATA, (memory_bytes, memory_bytes))
            resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
            os.environ.clear()
            os.environ.update(environment)
            with contextlib.suppress(OSError):
                os.chdir(place)
            function, arguments = pickle.load(asking)
            for item in function(*arguments):
                _send(pipe, ("item", item))
            _send(pipe, ("end", None))
        except ClearwayError as error:
            _send(pipe, ("error", error))
        except MemoryError:
            _send(pipe, ("damage", TOO_MUCH))
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
