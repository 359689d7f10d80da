"""The rows of a chunk's file, within bounds: a few bytes from a stranger may fill all memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from knotwork.errors import InputError
from knotwork.sweeps.packages import arrow, arrow_compute

MOST_BYTES = 2_000_000_000
"""Of the rows of a study, unpacked; some ten million rows have as many."""


def read_rows(file: Path, schema: Any, most_rows: int, most_bytes: int) -> Any:
    """Read the rows of a Parquet file.

    Args:
        file: The file.
        schema: Columns and metadata that it must have, a `pyarrow.Schema`.
        most_rows: Rows that it may have.
        most_bytes: What they may take.

    Returns:
        A `pyarrow.Table`.

    Raises:
        InputError: It can't be read, is of another study, or holds more.
    """
    pa, parquet = arrow()
    texts = [field.name for field in schema if pa.types.is_string(field.type)]
    try:
        found = parquet.read_schema(file)
        if not found.equals(schema) or found.metadata != schema.metadata:
            raise InputError("its rows are of another study")
        # Texts are read once each, however many rows have them.
        with parquet.ParquetFile(file, read_dictionary=texts) as opened:
            metadata = opened.metadata
            if metadata.num_rows > most_rows:
                raise InputError("it has more rows than the study")
            groups = [metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups)]
            _check_size(max(sum(groups), 8 * metadata.num_rows * len(schema)), most_bytes)
            rows = opened.read()
        _check_size(sum(_text_size(rows.column(name)) for name in texts), most_bytes)
        return rows.cast(schema)
    except (OSError, pa.ArrowException, InputError) as error:
        raise InputError(
            f"{file}: can't be read ({error}); remove it, and go on with --resume"
        ) from error


def _check_size(size: int, most: int) -> None:
    if size > most:
        raise InputError(
            f"with it the study has more than {MOST_BYTES} bytes unpacked, as many as are read"
        )


def _text_size(column: Any) -> int:
    """Bytes of a column of texts that stand once each, where every row has its own."""
    compute = arrow_compute()
    sizes = [
        compute.sum(compute.binary_length(part.dictionary).take(part.indices)).as_py() or 0
        for part in column.chunks
    ]
    return int(sum(sizes))
