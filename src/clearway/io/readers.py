"""The process that readers are forked from: it has their libraries loaded, and touches no file.

The first reading starts it, which takes as long as Python and the libraries take to load; every
later one begins at once. It has one thread, so that what is forked from it can be used, and ends
with the process that asked for it.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

START = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from clearway.io import apart, readers; readers.keep({}, apart.serve_fds)"
)
ALONE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Libraries of linear algebra start no threads then."""
LOADED = "LOADED_APART"
"""In a module that reads: names of the modules to have loaded before a reader is forked."""
LONGEST_REQUEST = 65536
FDS = 3
"""The first brings what is asked for, the second takes answers, the third asks how it ended."""
HOW_IT_ENDED = b"?"
STILL_RUNS = b"."
LOST = -int(signal.SIGKILL)
"""The status of what ended together with the process that it was forked from."""
Serve = Callable[[int, int], None]
"""What a reader does with the descriptors that bring what is asked for and take answers."""


@dataclass(frozen=True, eq=False)
class Reader:
    """One forked process."""

    life: socket.socket
    """The process is ended where this is closed."""

    def status(self) -> int | None:
        """How it ended, below 0 by a signal, as of `subprocess`; None where it still runs."""
        with contextlib.suppress(OSError):
            self.life.send(HOW_IT_ENDED)
            told = self.life.recv(16)
            return None if told == STILL_RUNS else int(told or LOST)
        return LOST

    def close(self) -> None:
        """End it if it still runs."""
        self.life.close()


@dataclass(eq=False)
class Keeper:
    """The process that forks readers, as those who ask see it."""

    control: socket.socket
    process: subprocess.Popen[bytes]
    begun_by: tuple[int, tuple[str, ...]]
    lock: threading.Lock = field(default_factory=threading.Lock)

    @classmethod
    def start(cls) -> Keeper:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            process = subprocess.Popen(
                # -P: no module of the working folder takes the place of Python's own.
                [sys.executable, "-P", "-W", "ignore", "-c", START.format(theirs.fileno()),
                 json.dumps([os.path.join(folder(), each) for each in sys.path])],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                env={**os.environ, **ALONE},
                cwd="/",  # Readers go to the folder of whoever asks, once all is loaded.
            )  # fmt: skip
        return cls(ours, process, _asker())

    def fork(self, module: str, asking: int, sending: int) -> Reader:
        """A reader that runs `apart.serve_fds` with two file descriptors. Raises OSError where the
        process that forks is gone."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            with theirs, self.lock:
                socket.send_fds(self.control, [module.encode()], [asking, sending, theirs.fileno()])
        except OSError:
            ours.close()
            raise
        return Reader(ours)

    def close(self) -> None:
        """Ask for no more: it ends once nothing that it forked runs."""
        self.control.close()


_kept: Keeper | None = None
_earlier: list[Keeper] = []
"""Those that may not have ended yet."""
_starting = threading.Lock()


def _asker() -> tuple[int, tuple[str, ...]]:
    """Who asks: what was forked, or looks for modules elsewhere, asks a process of its own."""
    return os.getpid(), tuple(sys.path)


def folder() -> str:
    """Where relative paths begin; empty where that is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def reader(module: str, asking: int, sending: int) -> Reader:
    """A forked process that has a module loaded, and reads with what is asked of it."""
    global _kept
    with _starting:
        if _kept is not None and _kept.begun_by == _asker():
            with contextlib.suppress(OSError):
                return _kept.fork(module, asking, sending)
        if _kept is not None:
            _kept.close()
            _earlier.append(_kept)
        _earlier[:] = [each for each in _earlier if each.process.poll() is None]
        _kept = Keeper.start()
        return _kept.fork(module, asking, sending)


@atexit.register
def _end() -> None:
    """End with the process that asks, and not after it."""
    for each in (_kept, *_earlier):
        if each is not None and each.begun_by[0] == os.getpid():
            each.close()
            each.process.terminate()
            each.process.wait()


def keep(control_fd: int, serve: Serve) -> None:
    """What runs in the process that forks: a reader for every request, until nobody asks.

    serve: `apart.serve_fds`, given since that room looks into this one and not the other way round.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Whoever asks ends it.
    control = socket.socket(fileno=control_fd)
    running: dict[socket.socket, _Running] = {}
    with selectors.DefaultSelector() as asked:
        asked.register(control, selectors.EVENT_READ)
        while asked.get_map():
            for key, _ in asked.select():
                who = key.fileobj
                assert isinstance(who, socket.socket)
                if who is not control:
                    if not running[who].answers(who):
                        asked.unregister(who)
                        del running[who]
                        who.close()
                    continue
                module, fds = _request(control)
                if len(fds) < FDS:
                    asked.unregister(control)
                    continue
                life = _fork(serve, module, fds, (control, *running), running)
                if life is not None:
                    asked.register(life, selectors.EVENT_READ)


def _fork(
    serve: Serve,
    module: str,
    fds: list[int],
    others: Sequence[socket.socket],
    running: dict[socket.socket, _Running],
) -> socket.socket | None:
    """Fork a reader; None where no process can be had."""
    _load(module)
    life = socket.socket(fileno=fds[2])
    try:
        pid = os.fork()
    except OSError:
        pid = -1
    if pid == 0:
        for each in (*others, life):
            each.close()
        _read(serve, fds[0], fds[1])
    os.close(fds[0])
    os.close(fds[1])
    if pid < 0:
        life.close()
        return None
    running[life] = _Running(pid)
    return life


@dataclass(eq=False)
class _Running:
    """A forked process, as the one that forked it sees it."""

    pid: int
    status: int | None = None

    def answers(self, life: socket.socket) -> bool:
        """Whether who asks for it is still there; if not, it is ended."""
        try:
            asked = life.recv(1)
        except OSError:
            asked = b""
        if asked != HOW_IT_ENDED:
            self.end()
            return False
        self._wait(1.0)
        with contextlib.suppress(OSError):
            life.send(STILL_RUNS if self.status is None else str(self.status).encode())
        return True

    def end(self) -> None:
        if self.status is None:
            os.kill(self.pid, signal.SIGKILL)
            self.status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def _wait(self, longest_s: float) -> None:
        until = time.monotonic() + longest_s
        while self.status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.status = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > until:
                return
            else:
                time.sleep(0.001)


def _request(control: socket.socket) -> tuple[str, list[int]]:
    try:
        data, fds, _, _ = socket.recv_fds(control, LONGEST_REQUEST, FDS)
    except OSError:
        return "", []
    return data.decode(), fds


def _load(module: str) -> None:
    """Have a module loaded; what cannot be loaded is the reader's to tell."""
    with contextlib.suppress(Exception):
        for name in getattr(importlib.import_module(module), LOADED, ()):
            with contextlib.suppress(ImportError):
                importlib.import_module(name)


def _read(serve: Serve, asking: int, sending: int) -> None:
    """What the forked process does; it never returns."""
    try:
        serve(asking, sending)
    finally:
        os._exit(0)
