"""Planning of rows in this process, in child processes, or on Dask's workers."""

from __future__ import annotations

import asyncio
import multiprocessing
import threading
import time
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from knotwork.errors import InputError, PlanningCrashError, PlanningTimeoutError
from knotwork.files.documents import Document, Edits
from knotwork.files.export.packages import import_package
from knotwork.planning.sweeps.child import Child, map_in_children
from knotwork.planning.sweeps.folder import RESUME_ADVICE, own_version
from knotwork.planning.sweeps.outcome import ROW_CRASHED, ROW_TIME_LIMIT, Outcome, outcome_of
from knotwork.planning.sweeps.spec import StudySpec

CONNECT_TIMEOUT = 20.0
"""Timeout of the connection to a scheduler [s]."""

_NumberedEdits = tuple[int, Edits]
"""The number of a row, and the values that it changes in the scenario."""


def plan_rows(
    spec: StudySpec, rows: Sequence[int], workers: int, scheduler: str | None
) -> Iterator[tuple[int, Outcome]]:
    """Plan rows, and yield their numbers and outcomes in the order of completion.

    Args:
        spec: The study.
        rows: Numbers of the rows to plan.
        workers: Number of child processes; with 0, rows are planned in this process, which ends if
            one crashes.
        scheduler: Address of a Dask scheduler, in place of child processes.

    Raises:
        InputError: The scheduler can't be reached or is lost, or its workers can't plan.
    """
    numbered = ((row, spec.edits(row)) for row in rows)
    if scheduler is not None:
        yield from _plan_on_scheduler(spec, list(numbered), scheduler)
    elif workers:
        plan_row = partial(_plan_in_child, spec.document, spec.time_limit)
        yield from map_in_children(plan_row, numbered, workers)
    else:
        for row, edits in numbered:
            yield row, outcome_of(spec.document, edits)


def _plan_in_child(
    document: Document, time_limit: float, child: Child, numbered: _NumberedEdits
) -> tuple[int, Outcome]:
    """Plan a row in a child process, and report a timeout or crash."""
    row, edits = numbered
    begin = time.perf_counter()
    try:
        return row, child.call(outcome_of, document, edits, limit=time_limit)
    except (PlanningTimeoutError, PlanningCrashError) as error:
        verdict = ROW_TIME_LIMIT if isinstance(error, PlanningTimeoutError) else ROW_CRASHED
        plan_time = time.perf_counter() - begin
        return row, Outcome(verdict, verdict, str(error), plan_time=plan_time)


def distributed() -> Any:
    """The package `distributed`, Dask's scheduler.

    Raises:
        InputError: The package can't be imported.
    """
    advice = "pip install 'knotwork[sweep]'"
    return import_package("distributed", "a sweep with a scheduler", advice)


def _plan_on_scheduler(
    spec: StudySpec, rows: Sequence[_NumberedEdits], address: str
) -> Iterator[tuple[int, Outcome]]:
    with _client(address) as client:
        _check_workers(client, address)
        try:
            # a task has only the values of its row, because a whole study may be large
            fixed = {"document": spec.document, "time_limit": spec.time_limit}
            futures = client.map(_plan_on_worker, rows, **fixed, pure=False)
            for future in distributed().as_completed(futures):
                yield future.result()
        except (Exception, asyncio.CancelledError) as error:
            why = f"{type(error).__name__}: {error}".replace("\n", " ")
            raise InputError(
                f"the scheduler was lost, or can't plan ({why}); {RESUME_ADVICE}"
            ) from error


_thread = threading.local()


def _plan_on_worker(
    numbered: _NumberedEdits, document: Document, time_limit: float
) -> tuple[int, Outcome]:
    """Plan a row in the child process of this thread of a Dask worker."""
    # Dask's workers are daemons, for which Python allows no children. These children end with their
    # parent.
    multiprocessing.current_process()._config["daemon"] = False  # type: ignore[attr-defined]
    if not hasattr(_thread, "child"):
        _thread.child = Child()
    return _plan_in_child(document, time_limit, _thread.child, numbered)


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
                f"scheduler {address}: worker {worker} has knotwork {version}; accepted: "
                f"{own_version()}, the version of this process"
            )
