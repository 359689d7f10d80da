"""The command `knotwork report`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from knotwork.cli.parameters import knots_option, planner_option

PASSED, FAILED = 0, 1

_EPILOG = """
Exit codes: 0 every check passes, 1 a check fails (the page is written, too), 2 the input is wrong.
"""


@click.command(epilog=_EPILOG)
@click.argument("scenario")
@click.option(
    "--html",
    "out",
    metavar="FILE",
    required=True,
    type=click.Path(path_type=Path),
    help="Page to write; an existing one is replaced, a folder that is missing is made.",
)
@planner_option
@knots_option
def report(scenario: str, out: Path, planner: str | None, knots: Any) -> int:
    """Plan SCENARIO and write a page about it to print or send: verdict, tables, plots, 3D view.

    The page is one file that needs no network.
    """
    from knotwork import pipeline
    from knotwork.view.files import checked_page_path
    from knotwork.view.report_page import report_page

    checked_page_path(out)
    plan = pipeline.plan(scenario, planner=planner, knots=knots)
    page = report_page(plan)
    for warning in page.warnings:
        click.echo(f"warning: {warning}", err=True)
    written = page.save(out)
    word = "passed" if plan.report.ok else "FAILED"
    click.echo(f"{plan.scenario.name}: {word}; wrote {written}")
    return PASSED if plan.report.ok else FAILED
