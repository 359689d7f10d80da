"""Saved results of the benchmarks, and tables of them for the terminal and for pages."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import rich.table
from rich.console import Console

FOLDER = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Table:
    """A table of a benchmark: cells are text already.

    Attributes:
        title: What stands above it.
        columns: Headings.
        rows: Cells of each row; a short row is filled up with empty ones.
        note: What follows the title, in ordinary letters.
        labels: How many columns, from the left, are labels; the others are aligned to the right.
    """

    title: str
    columns: tuple[str, ...]
    rows: list[list[str]]
    note: str = ""
    labels: int = 1

    def markdown(self) -> str:
        """Write the table in Markdown."""
        width = len(self.columns)
        lines = [f"**{self.title}** {self.note}".strip(), ""]
        lines += [
            f"| {' | '.join(self.columns)} |",
            "|---" * self.labels + "|---:" * (width - self.labels) + "|",
        ]
        lines += [f"| {' | '.join(row + [''] * (width - len(row)))} |" for row in self.rows]
        return "\n".join(lines)

    def show(self, console: Console) -> None:
        """Print the table."""
        shown = rich.table.Table(title=f"{self.title} {self.note}", title_justify="left")
        for i, column in enumerate(self.columns):
            shown.add_column(column, justify="right" if i >= self.labels else "left")
        for row in self.rows:
            shown.add_row(*row)
        console.print(shown)


def _made(context: click.Context, parameter: click.Parameter, folder: Path | None) -> Path | None:
    """Make the folder before anything is measured."""
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise click.BadParameter(f"{folder}: {error.strerror}") from None
    return folder


save_option = click.option(
    "--save",
    type=click.Path(file_okay=False, writable=True, path_type=Path),
    callback=_made,
    help="Folder for the results; made if it is not there.",
)


def save(folder: Path, name: str, data: dict[str, Any]) -> Path:
    """Write the results of a benchmark into a folder, a row a line; return the file."""
    path = folder / f"{name}.json"
    head = {key: value for key, value in data.items() if not isinstance(value, list)}
    lists = {key: value for key, value in data.items() if isinstance(value, list)}
    parts = [f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    for key, rows in lists.items():
        body = ",\n".join(f"    {json.dumps(row, ensure_ascii=False)}" for row in rows)
        parts.append(f"  {json.dumps(key)}: [\n{body}\n  ]")
    path.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")
    return path


def load(name: str) -> dict[str, Any]:
    """Read the saved results that the pages show."""
    data: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return data
