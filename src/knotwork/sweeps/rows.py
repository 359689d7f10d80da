"""Rows of a study as a Parquet file: columns, writing, and reading with size limits."""

from __future__ import annotations

import io
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from knotwork.documents.edits import flow
from knotwork.errors import InputError
from knotwork.export.packages import needed
from knotwork.sweeps.figures import FIGURES
from knotwork.sweeps.outcome import Outcome
from knotwork.sweeps.spec import StudySpec

HOW = "pip install 'knotwork[sweep]'"
WIDEST = 10**9
STUDY_KEY = "knotwork.study"
"""Metadata key of a file of rows: the digest of their study."""
MOST_BYTES = 2_000_000_000
"""Largest size of the rows of a study, unpacked; enough for some ten million rows."""


def arrow() -> tuple[Any, Any]:
    """The packages `pyarrow` and `pyarrow.parquet`.

    Raises:
        InputError: The packages can't be imported.
    """
    parquet = needed("pyarrow.parquet", "a sweep", HOW)
    return needed("pyarrow", "a sweep", HOW), parquet


def own_version() -> str:
    """Version of Knotwork; empty if it is not installed but only on the path."""
    try:
        return version("knotwork")
    except PackageNotFoundError:
        return ""


def schema_of(spec: StudySpec) -> Any:
    """Schema of a file of rows, with the digest of their study."""
    pa, _ = arrow()
    fields = [pa.field(name, pa.type_for_alias(kind)) for name, kind in spec.columns.items()]
    return pa.schema(fields, metadata={STUDY_KEY: spec.digest})


def to_parquet(spec: StudySpec, rows: Mapping[int, Outcome]) -> bytes:
    """Write some rows as a Parquet file."""
    pa, parquet = arrow()
    table, file = [], io.BytesIO()
    for row, done in rows.items():
        figures = (done.figures.get(name) for name in FIGURES)
        results = (done.verdict, done.reason, done.message, *figures, done.plan_time)
        cells = zip(spec.columns.items(), (row, *spec.values(row), *results), strict=True)
        table.append({name: _text(one) if kind == "string" else one for (name, kind), one in cells})
    made = pa.Table.from_pylist(table, schema=schema_of(spec))
    parquet.write_table(made, file, compression="zstd")
    return file.getvalue()


def _text(cell: Any) -> str:
    return cell if isinstance(cell, str) else flow(cell, width=WIDEST)


def read_rows(file: Any, spec: StudySpec, most_bytes: int) -> Any:
    """Read rows of a study within a size limit, as a small file may unpack to any size.

    Args:
        file: A Parquet file, or its path.
        spec: The study.
        most_bytes: Largest size of the rows.

    Returns:
        A `pyarrow.Table`.

    Raises:
        InputError: The file can't be read, is of another study, or too large.
    """
    pa, parquet = arrow()
    schema = schema_of(spec)
    texts = [field.name for field in schema if pa.types.is_string(field.type)]
    try:
        found = parquet.read_schema(file)
        if not found.equals(schema) or found.metadata != schema.metadata:
            raise InputError("its rows are of another study")
        # Each text is read once, for all rows that have it.
        with parquet.ParquetFile(file, read_dictionary=texts) as opened:
            metadata = opened.metadata
            if metadata.num_rows > len(spec):
                raise InputError("it has more rows than the study")
            groups = [metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups)]
            _check_size(max(sum(groups), 8 * metadata.num_rows * len(schema)), most_bytes)
            rows = opened.read()
        _check_size(sum(_text_size(rows.column(name)) for name in texts), most_bytes)
        return rows.cast(schema)
    except (OSError, pa.ArrowException, InputError) as error:
        raise InputError(
            f"{file}: can't be read ({error}); remove it, and continue with --resume"
        ) from error


def _check_size(size: int, most: int) -> None:
    if size > most:
        raise InputError(f"with it the study has more than {MOST_BYTES} bytes unpacked, the limit")


def _text_size(column: Any) -> int:
    """Size of a column of texts in bytes if every row has its own; here each is stored once."""
    compute = needed("pyarrow.compute", "a sweep", HOW)
    sizes = [
        compute.sum(compute.binary_length(part.dictionary).take(part.indices)).as_py() or 0
        for part in column.chunks
    ]
    return int(sum(sizes))
