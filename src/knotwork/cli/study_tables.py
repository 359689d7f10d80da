"""Printed results of a study: passing rows, reasons of failures, and the best row."""

from __future__ import annotations

from typing import Any

from knotwork.cli import tables
from knotwork.cli.terminal import cell, echo
from knotwork.sweeps import Study
from knotwork.sweeps.outcome import ROW_CRASHED, ROW_WRONG_INPUT
from knotwork.units import readable

MOST_REASONS = 12


def study_to_dict(study: Study, figure: str, best: dict[str, Any] | None) -> dict[str, Any]:
    """The printed results of a study as plain data, ready for JSON."""
    return {
        "ok": study.passed > 0,
        "scenario": study.name,
        "rows": len(study.spec),
        "finished": len(study),
        "passed": study.passed,
        "reasons": study.reasons,
        "best": None if best is None else {"figure": figure, "row": best},
        "folder": str(study.folder) if study.folder is not None else None,
    }


def print_study(study: Study) -> None:
    """Print the number of passing rows, and the reasons of the others."""
    count, total = len(study), len(study.spec)
    done = f"{count} rows" if count == total else f"{count} of {total} rows are finished"
    table = tables.plain_table(f"{study.name}: {done}, {study.passed} pass", ["", "rows", "%"])
    counted = {"passed": study.passed, **study.reasons}
    for reason, number in list(counted.items())[: 1 + MOST_REASONS]:
        style = "" if reason == "passed" else "[red]"
        table.add_row(f"{style}{cell(reason)}", str(number), f"{100 * number / max(1, count):.1f}")
    tables.print_table(table)
    if len(study.reasons) > MOST_REASONS:
        echo(f"and {len(study.reasons) - MOST_REASONS} more reasons")
    for reason in (ROW_WRONG_INPUT, ROW_CRASHED):  # faults of the study, or of Knotwork
        if reason in study.reasons:
            row = study["reason"].index(reason)
            line = f"{reason}, first in row {study['row'][row]}: {study['message'][row]}"
            tables.print_wrapped(line, "", "  ")
    if study.folder is not None:
        echo(f"{study.folder}: {count} of {total} rows")


def print_best(study: Study, figure: str, best: dict[str, Any] | None) -> None:
    """Print the best row by a figure, if there is one."""
    if best is not None:
        pairs = ((name, best[name]) for name in study.varied)
        values = ", ".join(
            f"{name} = {readable(value, '.6g') if isinstance(value, float) else value}"
            for name, value in pairs
        )
        known = study.figures[figure]
        shown = study.units.text(best[figure], known.unit)
        tables.print_wrapped(
            f"best {known.title}: {shown} in row {best['row']}, {values}", "", "  "
        )
