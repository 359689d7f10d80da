"""The command `knotwork sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knotwork.cli import tables
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    Seconds,
    exit_codes,
    folder_option,
    freeze_option,
    given_options,
    json_option,
    options_by_name,
    package_path_option,
    refuse,
)
from knotwork.cli.progress_display import show_sweep
from knotwork.cli.terminal import cell, echo, echo_json
from knotwork.errors import InputError
from knotwork.planning import sweeps
from knotwork.planning.sweeps import Study
from knotwork.planning.sweeps.figures import get_figure
from knotwork.planning.sweeps.folder import is_study
from knotwork.planning.sweeps.outcome import ROW_CRASHED, ROW_WRONG_INPUT
from knotwork.units import readable

MAX_REASONS = 12
"""Maximum number of reasons in the table; the others are counted."""


@click.command(
    epilog=f"{exit_codes('a row passes', 'none does')} --scheduler needs "
    "`pip install 'knotwork[sweep]'`.",
)
@click.argument("source", metavar="SCENARIO|STUDY")
@click.option(
    "--vary",
    metavar="PATH=VALUES",
    multiple=True,
    help="A value of the file and its variation: a range -200:200:41, values separated by commas, "
    "or uniform(-50, 50). May be repeated; all combinations are planned.",
)
@click.option(
    "--rows",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="CSV with paths of values as header; one scenario per row.",
)
@click.option(
    "--zip",
    "together",
    is_flag=True,
    help="Vary all together, row by row, in place of all combinations.",
)
@click.option(
    "--samples",
    metavar="N",
    type=click.IntRange(min=1),
    help="Number of random samples of uniform(…) values.",
)
@click.option(
    "--seed", metavar="N", type=int, help="Seed of the random samples. It is 0 by default."
)
@folder_option("Folder for the study.")
@click.option("--resume", is_flag=True, help="Continue the study in the folder.")
@click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(min=0),
    help="Number of processes, by default one per processor; 0 for this process only.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Plan on the workers of a Dask scheduler, for example tcp://host:8786.",
)
@click.option(
    "--stop-after",
    metavar="N",
    type=click.IntRange(min=1),
    help="Stop after this many passing rows.",
)
@click.option(
    "--time-limit",
    metavar="TIME",
    type=Seconds(),
    help="Time limit of a row, for example 20s. It is 60 s by default.",
)
@click.option(
    "--best",
    metavar="FIGURE",
    help="Figure by which the best row is chosen. By default it is the duration.",
)
@freeze_option
@package_path_option
@json_option
def sweep(
    source: str,
    out: Path | None,
    best: str | None,
    freeze: Path | None,
    as_json: bool,
    **planning_options: Any,
) -> int:
    """Plan and check SCENARIO many times with varied values, one row each.

    Values are selected by their path in the file, such as frames.block.position[0] or
    waypoints[pick].after, in the file's units. A row has the verdict, the reason of a failure,
    and figures of the motion; all rows are saved in the folder of the study, as lines of JSON. If
    STUDY is such a folder, nothing is planned: its rows are shown or frozen (--best, --freeze).
    `knotwork view STUDY` shows its map.
    """
    figure = best or "duration"
    get_figure(figure)
    if is_study(source):
        unfit = options_by_name(planning_options | {"out": out})
        unfit["--zip"] = unfit.pop("--together")
        reason = f"{source} is the folder of a study, which is not planned again"
        refuse(unfit, reason, "give its scenario, or leave out")
        study = sweeps.Study.open(source)
    else:
        vary = _values_by_path(planning_options.pop("vary"))
        options = given_options(planning_options)
        try:
            with show_sweep(as_json) as progress:
                study = sweeps.sweep(source, vary, out=out, progress=progress, **options)
        except KeyboardInterrupt:
            if out is not None:
                echo(f"finished rows are kept in {out}; continue with --resume", err=True)
            raise
    if not as_json:  # the planned rows are shown even if the rest fails
        print_study(study)
    best_row = study.best(figure) if study.passed else None
    if freeze is not None:
        if best_row is None:
            raise InputError(f"{freeze} was not written: no row passes")
        study.freeze(best_row["row"], freeze)
    if as_json:
        echo_json(study_to_dict(study, figure, best_row))
    else:
        print_best(study, figure, best_row)
        if freeze is not None:
            echo(f"wrote {freeze}")
    return PASSED if study.passed else FAILED


def _values_by_path(pairs: tuple[str, ...]) -> dict[str, str]:
    """Read `PATH=VALUES`, each path once."""
    values_of: dict[str, str] = {}
    for pair in pairs:
        path, mark, values = pair.partition("=")
        if not mark:
            raise InputError(
                f"--vary {pair}: has no values; accepted: PATH=VALUES, for example "
                "frames.block.position[0]=-200:200:41"
            )
        if path.strip() in values_of:
            raise InputError(f"--vary {path.strip()}: is given twice; leave out one")
        values_of[path.strip()] = values
    return values_of


def study_to_dict(study: Study, figure: str, best: dict[str, Any] | None) -> dict[str, Any]:
    """Return the printed results of a study as plain data, ready for JSON."""
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
    for reason, number in list(counted.items())[: 1 + MAX_REASONS]:
        style = "" if reason == "passed" else "[red]"
        table.add_row(f"{style}{cell(reason)}", str(number), f"{100 * number / max(1, count):.1f}")
    tables.print_table(table)
    if len(study.reasons) > MAX_REASONS:
        echo(f"and {len(study.reasons) - MAX_REASONS} more reasons")
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
        best_figure = study.figures[figure]
        shown = study.units.text(best[figure], best_figure.unit)
        tables.print_wrapped(
            f"best {best_figure.title}: {shown} in row {best['row']}, {values}", "", "  "
        )
