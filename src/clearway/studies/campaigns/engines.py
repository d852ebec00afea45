"""Who flies the flights of a campaign: this process, processes of this machine, or a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from clearway.base.errors import ClearwayError, InputError, MissingExtraError
from clearway.studies import processes
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.task import Task, fly_task

Engine = Callable[[Sequence[Task]], Iterator[FlightRow]]
"""Rows of all tasks, each once, in any order."""
ANSWERS_WITHIN_S = 10.0
AGAIN = "flights so far are kept: the same command goes on"


def make_process_engine(workers: int) -> Engine:
    """Side by side in processes of this machine; with one worker in this very process."""

    def engine(tasks: Sequence[Task]) -> Iterator[FlightRow]:
        try:
            yield from processes.run_in_processes(fly_task, tasks, workers)
        except BrokenProcessPool as cause:
            raise ClearwayError(f"a worker process has died; {AGAIN}") from cause

    return engine


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
