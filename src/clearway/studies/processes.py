"""Jobs side by side in processes of this machine, for studies that are the same for any number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")


def in_processes(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    workers: int,
    begin: Callable[..., None] | None = None,
    given: tuple[Any, ...] = (),
) -> Iterator[Result]:
    """Results as they come; with one worker all in this very process.

    begin, given: called once in each process, with these. What `work` raises ends it at once: jobs
    that have not begun are dropped.
    """
    if workers == 1:
        if begin is not None:
            begin(*given)
        yield from map(work, jobs)
        return
    # Fresh processes: forked ones would inherit the threads of a progress bar.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), begin, given)
    try:
        for done in as_completed([pool.submit(work, job) for job in jobs]):
            yield done.result()
    finally:
        pool.shutdown(cancel_futures=True)
