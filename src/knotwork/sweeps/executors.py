"""Executors of rows: this process, child processes, or Dask's workers."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any, NamedTuple

from knotwork.errors import InputError
from knotwork.export.packages import import_package
from knotwork.files.documents import Document, Edits
from knotwork.sweeps.child import (
    Child,
    ChildCrashedError,
    ChildTimeoutError,
    as_ready,
    by_children,
)
from knotwork.sweeps.folder import RESUME_ADVICE, own_version
from knotwork.sweeps.outcome import ROW_CRASHED, ROW_TIME_LIMIT, Outcome, outcome_of

BATCHES_PER_THREAD = 3
"""Batches handed to each thread of a Dask worker: one is planned, the others wait."""
LARGEST_BATCH, FEWEST_BATCHES = 8, 32
"""Rows in a batch, and number of batches, of which small studies have smaller ones."""
CONNECT_TIMEOUT = 20.0
"""Timeout of the connection to a scheduler [s]."""
LONGEST_ABSENCE = 300.0
"""Longest time that rows wait for a worker [s]."""


class RowTask(NamedTuple):
    """A row to plan.

    Attributes:
        row: Its number.
        document: The varied scenario.
        edits: The row's values.
        time_limit: Its time limit [s].
    """

    row: int
    document: Document
    edits: Edits
    time_limit: float


def plan_rows(
    tasks: Iterable[RowTask], count: int, workers: int, scheduler: str | None
) -> Iterator[tuple[int, Outcome]]:
    """Plan rows, and give their numbers and outcomes in the order of completion.

    Args:
        tasks: Rows to plan.
        count: Their number.
        workers: Number of child processes; 0 to plan in this process, which a crash of a row ends.
        scheduler: Address of a Dask scheduler, in place of child processes.

    Raises:
        InputError: The scheduler can't be reached, its workers can't plan, or the scheduler or all
            workers are lost.
    """
    if scheduler is not None:
        size = max(1, min(LARGEST_BATCH, count // FEWEST_BATCHES))
        rows = iter(tasks)
        batches: Iterator[list[RowTask]] = iter(lambda: list(islice(rows, size)), [])
        for outcomes in _on_scheduler(batches, scheduler):
            yield from outcomes
    elif workers:
        yield from by_children(_in_child, tasks, workers)
    else:
        for task in tasks:
            yield task.row, outcome_of(task.document, task.edits)


def _in_child(child: Child, task: RowTask) -> tuple[int, Outcome]:
    """Plan a row in a child process, and report a timeout or crash."""
    begin = time.perf_counter()
    try:
        limit = task.time_limit
        return task.row, child.call(outcome_of, task.document, task.edits, limit=limit)
    except (ChildTimeoutError, ChildCrashedError) as error:
        verdict = ROW_TIME_LIMIT if isinstance(error, ChildTimeoutError) else ROW_CRASHED
        plan_time = time.perf_counter() - begin
        return task.row, Outcome(verdict, verdict, str(error), plan_time=plan_time)


def distributed() -> Any:
    """The package `distributed`, Dask's scheduler.

    Raises:
        InputError: The package can't be imported.
    """
    advice = "pip install 'knotwork[sweep]'"
    return import_package("distributed", "a sweep with a scheduler", advice)


def _on_scheduler(
    batches: Iterable[Sequence[RowTask]], address: str
) -> Iterator[list[tuple[int, Outcome]]]:
    with _client(address) as client:
        _check_workers(client, address)
        pool = client.get_executor(pure=False)
        try:
            yield from as_ready(
                lambda batch: pool.submit(_by_worker, batch), batches, lambda: _capacity(client)
            )
        except InputError:
            raise
        except (Exception, asyncio.CancelledError) as error:
            why = f"{type(error).__name__}: {error}"
            raise InputError(
                f"the scheduler was lost, or can't plan ({why}); {RESUME_ADVICE}"
            ) from error


def _capacity(client: Any) -> int:
    """Number of batches to hand out, for the present number of workers."""
    threads: int = sum(client.nthreads().values())
    if not threads:
        try:
            client.wait_for_workers(1, timeout=LONGEST_ABSENCE)
        except TimeoutError as error:
            raise InputError(
                f"all workers are lost, and no new ones joined; {RESUME_ADVICE}"
            ) from error
    return BATCHES_PER_THREAD * max(1, threads)


_thread = threading.local()


def _by_worker(batch: Sequence[RowTask]) -> list[tuple[int, Outcome]]:
    """Plan rows in the child process of this thread of a Dask worker."""
    if not hasattr(_thread, "child"):
        _thread.child = Child()
    return [_in_child(_thread.child, task) for task in batch]


def _client(address: str) -> Any:
    try:
        return distributed().Client(address, timeout=CONNECT_TIMEOUT)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"scheduler {address}: can't be reached ({error or type(error).__name__}); accepted: "
            "the address that dask scheduler prints, for example tcp://host:8786"
        ) from error


def _check_workers(client: Any, address: str) -> None:
    try:
        versions = client.run(own_version)
    except Exception as error:
        raise InputError(
            f"scheduler {address}: its workers can't plan: {error}; install knotwork there"
        ) from error
    if not versions:
        raise InputError(f"scheduler {address}: has no workers; start some with dask worker")
    for worker, version in versions.items():
        if version != own_version():
            raise InputError(
                f"scheduler {address}: worker {worker} has knotwork {version}, and here it is "
                f"{own_version()}; install the same version"
            )
