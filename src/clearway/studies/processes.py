"""Jobs side by side in processes of this machine, for studies that are the same for any number."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from typing import Any, TypeVar

from clearway.base.own_code import list_looked_beside, look_beside

SAFE_PATH = "PYTHONSAFEPATH"
"""Of the environment: as `-P` of Python, for all that multiprocessing starts."""
Job = TypeVar("Job")
Result = TypeVar("Result")


def run_in_processes(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int,
    begin: Callable[..., None] | None = None,
    given: tuple[Any, ...] = (),
) -> Iterator[Result]:
    """Results as they come; with one worker all in this very process.

    begin, given: called once in each process, with these. What `work` raises ends it at once, as
    Ctrl-C does: jobs that are under way are given up, those that have not begun are dropped.
    """
    if workers == 1:
        if begin is not None:
            begin(*given)
        yield from map(work, jobs)
        return
    others = set(active_children())
    # Fresh processes: forked ones would inherit the threads of a progress bar.
    initargs = (list_looked_beside(), begin, given)
    with _own_modules_only():
        pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin, initargs)
    try:
        # Processes begin with the first jobs, and inherit both.
        with _own_modules_only(), _interrupts_held():
            waiting = [pool.submit(work, job) for job in jobs]
        for done in as_completed(waiting):
            yield done.result()
    except BaseException:
        with _interrupts_held():
            for worker in set(active_children()) - others:
                worker.terminate()
            pool.shutdown(cancel_futures=True)
        raise
    pool.shutdown()


@contextmanager
def _own_modules_only() -> Iterator[None]:
    """Processes that begin in the block take no module from the working folder, where a file of
    anybody's may have the name of one of Python's own."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits until the block ends. A terminal sends it to workers too: they never see it,
    since it is for the process that began them to end them."""
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)


def _begin(
    folders: tuple[str, ...], begin: Callable[..., None] | None, given: tuple[Any, ...]
) -> None:
    """In each worker, which ends with its parent: one that was killed must not leave workers behind
    that wait for it for ever."""
    look_beside(folders)
    parent = parent_process()
    if parent is not None:
        sentinel = parent.sentinel
        threading.Thread(target=lambda: (wait([sentinel]), os._exit(1)), daemon=True).start()
    if begin is not None:
        begin(*given)
