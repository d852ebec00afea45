"""Who flies the flights of a campaign: this process, processes of this machine, or a cluster."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import Any

from clearway.base.errors import ClearwayError, InputError, MissingExtraError
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.task import Task, fly_task

Engine = Callable[[Sequence[Task]], Iterator[FlightRow]]
"""Rows of all tasks, each once, in any order."""
ANSWERS_WITHIN_S = 10.0
AGAIN = "flights so far are kept: the same command goes on"


def in_processes(workers: int) -> Engine:
    """Side by side in processes of this machine; with one worker in this very process."""

    def engine(tasks: Sequence[Task]) -> Iterator[FlightRow]:
        if workers == 1:
            yield from map(fly_task, tasks)
            return
        # Fresh processes: forked ones would inherit the threads of a progress bar.
        pool = ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=_end_with_parent
        )
        try:
            for done in as_completed([pool.submit(fly_task, task) for task in tasks]):
                yield done.result()
        except BrokenProcessPool as cause:
            raise ClearwayError(f"a worker process has died; {AGAIN}") from cause
        finally:
            pool.shutdown(cancel_futures=True)

    return engine


def _end_with_parent() -> None:
    """A killed campaign must not leave workers behind that wait for it for ever."""
    parent = parent_process()
    if parent is not None:
        sentinel = parent.sentinel
        threading.Thread(target=lambda: (wait([sentinel]), os._exit(1)), daemon=True).start()


def on_cluster(scheduler: str) -> Engine:
    """On the workers of a dask scheduler; flights of a lost worker are flown by another.

    The engine raises InputError where no scheduler answers, MissingExtraError without dask.
    """

    def engine(tasks: Sequence[Task]) -> Iterator[FlightRow]:
        distributed = _dask()
        try:
            client = distributed.Client(scheduler, timeout=ANSWERS_WITHIN_S)
        except (OSError, ValueError) as cause:
            raise InputError("--scheduler", f"no scheduler answers at {scheduler}") from cause
        with client:
            keys = [f"{task.settings_id}:{task.key}" for task in tasks]
            futures = client.map(fly_task, tasks, key=keys)
            try:
                for _, row in distributed.as_completed(futures, with_results=True):
                    yield row
            except distributed.KilledWorker as cause:
                raise ClearwayError(f"worker after worker died over one flight; {AGAIN}") from cause

    return engine


def _dask() -> Any:
    try:
        import distributed
    except ImportError as cause:
        raise MissingExtraError("--engine dask", "dask") from cause
    return distributed
