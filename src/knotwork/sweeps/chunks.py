"""Chunks of a study: rows that are planned in one go and written to one file."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol

from knotwork.documents import Document, Edits
from knotwork.sweeps.child import ChildCrashedError, ChildTimeoutError
from knotwork.sweeps.outcome import CRASHED, TIME_LIMIT, Outcome
from knotwork.sweeps.spec import StudySpec

BLOCK = 8
"""Rows whose poses are tested together: always the same ones, however a study is cut into chunks,
so that a row does not depend on that."""
BLOCK_LIMIT = 20.0
"""Time at least for reading the scenarios of a block and testing their poses [s]."""


@dataclass(frozen=True)
class Chunk:
    """Rows that are planned in one go.

    Attributes:
        index: Of the chunk.
        rows: Numbers of its rows.
        document: The scenario that is varied.
        blocks: All blocks that have rows of it: by row the values in place of the document's.
        time_limit: Of one row [s].
    """

    index: int
    rows: range
    document: Document
    blocks: tuple[Mapping[int, Edits], ...]
    time_limit: float


def chunk_of(spec: StudySpec, index: int, size: int) -> Chunk:
    """Cut a chunk out of a study."""
    rows = range(index * size, min((index + 1) * size, len(spec)))
    blocks = tuple(
        {row: spec.edits(row) for row in range(first, min(first + BLOCK, len(spec)))}
        for first in range(rows.start - rows.start % BLOCK, rows.stop, BLOCK)
    )
    return Chunk(index, rows, spec.document, blocks, spec.time_limit)


Planned = tuple[int, dict[int, Outcome]]
"""Index of a chunk, and the outcomes of its rows."""


class Caller(Protocol):
    """Calls methods of a `RowPlanner`."""

    def call(self, method: str, *arguments: Any, limit: float) -> Any:
        """Call one, within a time limit [s]."""


def planned(chunk: Chunk, by: Caller) -> Planned:
    """Plan a chunk, whatever happens to the process that does."""
    return chunk.index, dict(_outcomes(chunk, by))


def _outcomes(chunk: Chunk, by: Caller) -> Iterator[tuple[int, Outcome]]:
    for block in chunk.blocks:
        known: dict[int, Outcome] = {}
        limit = max(chunk.time_limit, BLOCK_LIMIT)
        with suppress(ChildTimeoutError, ChildCrashedError):  # else its rows go without the test
            known = by.call("tested", chunk.document, block, limit=limit)
        for row, edits in block.items():
            if row in chunk.rows:
                yield row, known.get(row) or _outcome(chunk, row, edits, by)


def _outcome(chunk: Chunk, row: int, edits: Edits, by: Caller) -> Outcome:
    begin = time.perf_counter()
    try:
        found: Outcome = by.call("outcome", row, chunk.document, edits, limit=chunk.time_limit)
    except (ChildTimeoutError, ChildCrashedError) as error:
        what = TIME_LIMIT if isinstance(error, ChildTimeoutError) else CRASHED
        return Outcome(what, what, str(error), {}, time.perf_counter() - begin)
    return found
