"""The rows of one chunk, whatever happens to the process that plans them."""

from __future__ import annotations

import atexit
import io
import re
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from knotwork.documents import Document
from knotwork.documents.edits import flow
from knotwork.sweeps.child import (
    Child,
    ChildCrashedError,
    ChildTimeoutError,
    again_if_ended,
)
from knotwork.sweeps.figures import FIGURES
from knotwork.sweeps.outcome import CRASHED, PASSED, TIME_LIMIT, Outcome
from knotwork.sweeps.packages import arrow
from knotwork.sweeps.row_planner import Block, RowPlanner
from knotwork.sweeps.spec import StudySpec

BLOCK = 8
"""Rows whose poses are tested together: always the same ones, however a study is cut into chunks,
so that a row does not depend on that."""
STUDY_KEY = "knotwork.study"
"""In the metadata of a file of rows: the digest of their study."""
BLOCK_LIMIT = 20.0
"""Time at least for reading the scenarios of a block and testing their poses [s]."""


@dataclass(frozen=True)
class Chunk:
    """Rows that are planned in one go and written to one file.

    Attributes:
        index: Of the chunk.
        first, last: Its first row, and the one after its last.
        blocks: All blocks that have rows of it.
        columns: Names and types of the columns.
        digest: Of the study, which the file of its rows carries.
        time_limit: Of one row [s].
    """

    index: int
    first: int
    last: int
    blocks: tuple[Block, ...]
    columns: tuple[tuple[str, str], ...]
    digest: str
    time_limit: float


def chunk_of(spec: StudySpec, columns: Mapping[str, str], index: int, size: int) -> Chunk:
    """Cut a chunk out of a study."""
    first, last = index * size, min((index + 1) * size, len(spec))
    blocks = []
    for begin in range(first - first % BLOCK, last, BLOCK):
        rows = range(begin, min(begin + BLOCK, len(spec)))
        blocks.append(Block(spec.document, spec.locations, {row: spec.values(row) for row in rows}))
    named = tuple(columns.items())
    return Chunk(index, first, last, tuple(blocks), named, spec.digest, spec.time_limit)


class Worker(Protocol):
    """What plans rows."""

    def begin(self, block: Block, limit: float) -> dict[int, Outcome]:
        """Take a block; outcomes of rows that need not be planned."""

    def outcome(self, row: int, limit: float) -> Outcome:
        """Plan a row of the block."""


class HereWorker:
    """Plans in this process, without a time limit."""

    def __init__(self) -> None:
        self._planner = RowPlanner()

    def begin(self, block: Block, limit: float) -> dict[int, Outcome]:
        """Take a block."""
        return self._planner.begin(block, True)

    def outcome(self, row: int, limit: float) -> Outcome:
        """Plan a row."""
        return self._planner.outcome(row)


class ChildWorker:
    """Plans in a child process; if that hangs or crashes, the row says so."""

    def __init__(self) -> None:
        self._child, self._held = Child(), set[int]()
        self._block = Block(Document(None), (), {})

    def begin(self, block: Block, limit: float) -> dict[int, Outcome]:
        """Take a block; if its test hangs or crashes, its rows go without it."""
        self._block = block
        try:
            return again_if_ended(lambda: self._given(block, True, limit))
        except (ChildTimeoutError, ChildCrashedError):
            return {}

    def outcome(self, row: int, limit: float) -> Outcome:
        """Plan a row."""
        begin = time.perf_counter()
        try:
            return again_if_ended(lambda: self._planned(row, limit))
        except (ChildTimeoutError, ChildCrashedError) as error:
            what = TIME_LIMIT if isinstance(error, ChildTimeoutError) else CRASHED
            return Outcome(what, what, str(error), {}, time.perf_counter() - begin)

    def _planned(self, row: int, limit: float) -> Outcome:
        if row not in self._held:
            block = self._block
            alone = Block(block.document, block.locations, {row: block.values[row]})
            self._given(alone, False, limit)
        return self._call("outcome", row, limit=limit)  # type: ignore[no-any-return]

    def _given(self, block: Block, tested: bool, limit: float) -> dict[int, Outcome]:
        """Give the child a block."""
        known = self._call("begin", block, tested, limit=max(limit, BLOCK_LIMIT))
        self._held = set(block.values)
        return known  # type: ignore[no-any-return]

    def _call(self, method: str, *arguments: Any, limit: float) -> Any:
        try:
            return self._child.call(method, *arguments, limit=limit)
        except (ChildTimeoutError, ChildCrashedError):
            self._held = set()
            raise

    def close(self) -> None:
        """End the process."""
        self._child.close()


def outcomes(chunk: Chunk, worker: Worker) -> Iterator[tuple[int, tuple[Any, ...], Outcome]]:
    """Plan the rows of a chunk: row, its values and its outcome."""
    for block in chunk.blocks:
        known = worker.begin(block, chunk.time_limit)
        for row, values in block.values.items():
            if chunk.first <= row < chunk.last:
                done = known[row] if row in known else worker.outcome(row, chunk.time_limit)
                yield row, values, done


@dataclass(frozen=True)
class FinishedChunk:
    """The rows of a chunk.

    Attributes:
        index: Of the chunk.
        content: Its Parquet file.
        rows: How many rows it has.
        passed: How many of them pass.
    """

    index: int
    content: bytes
    rows: int
    passed: int


def perform(chunk: Chunk, worker: Worker) -> FinishedChunk:
    """Plan the rows of a chunk."""
    rows = list(outcomes(chunk, worker))
    passed = sum(done.verdict == PASSED for _, _, done in rows)
    return FinishedChunk(chunk.index, to_parquet(chunk, rows), len(rows), passed)


_own = threading.local()


def perform_in_child(chunk: Chunk) -> FinishedChunk:
    """Plan the rows of a chunk in the child process of this thread."""
    if not hasattr(_own, "worker"):
        _own.worker = ChildWorker()
        atexit.register(_own.worker.close)
    return perform(chunk, _own.worker)


def to_parquet(chunk: Chunk, rows: Iterable[tuple[int, tuple[Any, ...], Outcome]]) -> bytes:
    """Write the rows of a chunk as a Parquet file.

    Args:
        chunk: Says the columns, those of the varied values after the row's number.
        rows: Number, varied values and outcome of each.
    """
    pa, parquet = arrow()
    schema = schema_of(dict(chunk.columns), chunk.digest)
    table: list[list[Any]] = [[] for _ in schema]
    for row, values, done in rows:
        cells = [
            row,
            *values,
            done.verdict,
            done.reason,
            done.message,
            *(done.figures.get(name) for name in FIGURES),
            done.plan_time,
        ]
        for column, cell, field in zip(table, cells, schema, strict=True):
            as_text = pa.types.is_string(field.type) and not isinstance(cell, str)
            column.append(re.sub(r"\n +", " ", flow(cell)) if as_text else cell)
    arrays = [pa.array(column, field.type) for column, field in zip(table, schema, strict=True)]
    file = io.BytesIO()
    parquet.write_table(pa.Table.from_arrays(arrays, schema=schema), file, compression="zstd")
    return file.getvalue()


def schema_of(columns: Mapping[str, str], digest: str) -> Any:
    """Schema of a file of rows, which says of which study they are."""
    pa, _ = arrow()
    fields = [pa.field(name, pa.type_for_alias(kind)) for name, kind in columns.items()]
    return pa.schema(fields, metadata={STUDY_KEY: digest})


def columns_of(spec: StudySpec) -> dict[str, str]:
    """Names and types of the columns of a study."""
    result = ("verdict", "reason", "message", *FIGURES, "plan_time")
    varied = {}
    for axis in spec.axes:
        for path, values in zip(axis.paths, axis.columns, strict=True):
            varied[f"given.{path}" if path in ("row", *result) else path] = _kind(values)
    text = ("verdict", "reason", "message")
    kinds = {name: "string" if name in text else "double" for name in result}
    return {"row": "int64", **varied, **kinds}


def _kind(values: Iterable[Any]) -> str:
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return "bool"
    if kinds == {int} and all(abs(value) < 2**62 for value in values):
        return "int64"
    return "double" if kinds <= {int, float} else "string"
