"""The command `knotwork report`."""

from __future__ import annotations

from pathlib import Path

import click

from knotwork.cli.logs import LogOptions, log_options
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    PlanOptions,
    html_option,
    motion_options,
    package_path_option,
)
from knotwork.cli.sources import read_motions
from knotwork.cli.terminal import echo
from knotwork.errors import InputError

_EPILOG = """
Exit codes: 0 every check passes, 1 a check fails (the page is written, too), 2 the input is wrong.
"""


@click.command(epilog=_EPILOG)
@html_option(required=True)
@package_path_option
@log_options
@motion_options("which it is checked against")
def report(
    source: str,
    out: Path,
    options: PlanOptions,
    reference: str | None,
    log: LogOptions | None,
) -> int:
    """Write a page about a motion to print or send: verdict, tables, plots, 3D view.

    SCENARIO is the name of a shipped scenario or the path of a file; it is planned first.
    TRAJECTORY is what `knotwork check` reads, and needs --scenario. The page is one file that needs
    no network.
    """
    from knotwork.trajectory import JointTrajectory
    from knotwork.view.files import checked_page_path
    from knotwork.view.report import report_page

    checked_page_path(out)
    motion = read_motions(source, reference, options, log=log)[0]
    if isinstance(motion, JointTrajectory):
        raise InputError(f"give the scenario that {source} is for with --scenario")
    page = report_page(motion)
    for warning in page.warnings:
        echo(f"warning: {warning}", err=True)
    written = page.save(out)
    word = "passed" if motion.report.ok else "FAILED"
    echo(f"{motion.scenario.name}: {word}; wrote {written}")
    return PASSED if motion.report.ok else FAILED
