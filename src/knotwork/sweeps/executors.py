"""Executors of chunks: this process, child processes, or Dask's workers."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from knotwork.documents import Document, Edits
from knotwork.errors import InputError
from knotwork.export.packages import needed
from knotwork.sweeps.child import (
    Child,
    ChildCrashedError,
    ChildTimeoutError,
    as_ready,
    by_children,
)
from knotwork.sweeps.folder import KEPT
from knotwork.sweeps.outcome import CRASHED, TIME_LIMIT, Outcome, outcome_of
from knotwork.sweeps.rows import HOW, own_version
from knotwork.sweeps.spec import StudySpec

AHEAD = 3
"""Number of chunks handed to each worker of Dask: one is planned, the others wait."""
CONNECT_TIMEOUT = 20.0
"""Timeout of the connection to a scheduler [s]."""
LONGEST_ABSENCE = 300.0
"""Longest time that chunks wait for a worker [s]."""


@dataclass(frozen=True)
class Chunk:
    """Rows that are planned together and written to one file.

    Attributes:
        index: Index of the chunk.
        document: The varied scenario.
        rows: Replaced values of each row.
        time_limit: Time limit of a row [s].
    """

    index: int
    document: Document
    rows: Mapping[int, Edits]
    time_limit: float


Planned = tuple[int, dict[int, Outcome]]
"""Index of a chunk, and the outcomes of its rows."""


def chunk_of(spec: StudySpec, index: int, size: int) -> Chunk:
    """Cut a chunk out of a study."""
    rows = range(index * size, min((index + 1) * size, len(spec)))
    return Chunk(index, spec.document, {row: spec.edits(row) for row in rows}, spec.time_limit)


def planned(chunks: Iterator[Chunk], workers: int, scheduler: str | None) -> Iterator[Planned]:
    """Plan chunks of rows, and give them in the order of completion.

    Args:
        chunks: Chunks to plan.
        workers: Number of child processes; 0 to plan in this process, which a crash of a row ends.
        scheduler: Address of a Dask scheduler, in place of child processes.

    Raises:
        InputError: The scheduler can't be reached, its workers can't plan, the scheduler or all
            workers are lost, or a chunk crashed its workers.
    """
    if scheduler is not None:
        yield from _on_scheduler(chunks, scheduler)
    elif workers:
        yield from by_children(_in_child, chunks, workers)
    else:
        for chunk in chunks:
            yield chunk.index, {row: outcome_of(chunk.document, e) for row, e in chunk.rows.items()}


def _in_child(child: Child, chunk: Chunk) -> Planned:
    """Plan a chunk in a child process, whatever happens to it."""

    def outcome(edits: Edits) -> Outcome:
        begin = time.perf_counter()
        try:
            found: Outcome = child.call(outcome_of, chunk.document, edits, limit=chunk.time_limit)
        except (ChildTimeoutError, ChildCrashedError) as error:
            what = TIME_LIMIT if isinstance(error, ChildTimeoutError) else CRASHED
            return Outcome(what, what, str(error), {}, time.perf_counter() - begin)
        return found

    return chunk.index, {row: outcome(edits) for row, edits in chunk.rows.items()}


def distributed() -> Any:
    """The package `distributed`, Dask's scheduler.

    Raises:
        InputError: The package can't be imported.
    """
    return needed("distributed", "a sweep with a scheduler", HOW)


def _on_scheduler(chunks: Iterator[Chunk], address: str) -> Iterator[Planned]:
    with _client(address) as client:
        _check_workers(client, address)
        pool = client.get_executor(pure=False)
        try:
            yield from as_ready(
                lambda chunk: pool.submit(_by_worker, chunk), chunks, lambda: _places(client)
            )
        except InputError:
            raise
        except (Exception, asyncio.CancelledError) as error:
            why = f"{type(error).__name__}: {error}"
            raise InputError(f"the scheduler was lost, or can't plan ({why}); {KEPT}") from error


def _places(client: Any) -> int:
    """Number of chunks to hand out, for the present number of workers."""
    count: int = sum(client.nthreads().values())
    if not count:
        try:
            client.wait_for_workers(1, timeout=LONGEST_ABSENCE)
        except TimeoutError as error:
            raise InputError(f"all workers are lost, and no new ones joined; {KEPT}") from error
    return AHEAD * max(1, count)


_own = threading.local()


def _by_worker(chunk: Chunk) -> Planned:
    """Plan a chunk in the child process of this thread of a Dask worker."""
    if not hasattr(_own, "child"):
        _own.child = Child()
    return _in_child(_own.child, chunk)


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
            f"scheduler {address}: its workers can't plan: {error}; install knotwork[sweep] there"
        ) from error
    if not versions:
        raise InputError(f"scheduler {address}: has no workers; start some with dask worker")
    for worker, version in versions.items():
        if version != own_version():
            raise InputError(
                f"scheduler {address}: worker {worker} has knotwork {version}, and here it is "
                f"{own_version()}; install the same version"
            )
