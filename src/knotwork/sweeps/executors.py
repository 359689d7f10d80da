"""Where chunks are planned: in this process, in children of it, or by the workers of Dask."""

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
"""Chunks that are handed over for each worker of Dask: one is planned, the next ones wait."""
CONNECT_TIMEOUT = 20.0
"""To a scheduler [s]."""
LONGEST_ABSENCE = 300.0
"""Longest time that chunks wait for a worker [s]."""


@dataclass(frozen=True)
class Chunk:
    """Rows that are planned in one go and written to one file.

    Attributes:
        index: Of the chunk.
        document: The scenario that is varied.
        rows: By row the values in place of the document's.
        time_limit: Of one row [s].
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
    """Plan chunks of rows, in the order in which they are ready.

    Args:
        chunks: What to plan.
        workers: Number of child processes; 0 to plan in this one, which a crash of a row ends.
        scheduler: Address of a Dask scheduler whose workers plan in place of these.

    Raises:
        InputError: There is no scheduler at the address, its workers can't plan for it, the
            scheduler or all workers are lost, or a chunk ended the workers it was given to.
    """
    if scheduler is not None:
        yield from _on_scheduler(chunks, scheduler)
    elif workers:
        yield from by_children(_in_child, chunks, workers)
    else:
        for chunk in chunks:
            yield chunk.index, {row: outcome_of(chunk.document, e) for row, e in chunk.rows.items()}


def _in_child(child: Child, chunk: Chunk) -> Planned:
    """Plan a chunk in a child process, whatever happens to that."""

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
        InputError: It can't be imported.
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
    """How many chunks may be under way by the workers that there are, as they come and go."""
    count: int = sum(client.nthreads().values())
    if not count:
        try:
            client.wait_for_workers(1, timeout=LONGEST_ABSENCE)
        except TimeoutError as error:
            raise InputError(f"all workers are lost, and no others came; {KEPT}") from error
    return AHEAD * max(1, count)


_own = threading.local()


def _by_worker(chunk: Chunk) -> Planned:
    """Plan a chunk in the child process of this thread of one of Dask's workers."""
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
