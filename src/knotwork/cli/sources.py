"""What commands that show a motion have in common: a scenario to plan, or a stored trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.verification import Report

# What a failed check says before it only counts.
MOST_FAILURES = 3


def is_trajectory(source: str) -> bool:
    """Whether the path of a stored trajectory is given, and not a scenario."""
    from knotwork import resources

    if source.lower().endswith(".json"):
        return True
    return Path(source).is_dir() and source not in resources.names("scenarios")


def refuse(options: dict[str, Any], reason: str) -> None:
    """Refuse those options that are given.

    Raises:
        InputError: One is.
    """
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InputError(f"{reason}: leave out {', '.join(given)}")


def planned(source: str, planner: str | None, knots: Any, others: list[str]) -> list[Plan]:
    """Plan a scenario with its planner and with others; each planner once."""
    from knotwork import pipeline
    from knotwork.interpolation import get_planner

    for name in others:
        get_planner(name)
    plans = [pipeline.plan(source, planner=planner, knots=knots)]
    for name in dict.fromkeys(others):
        if name == plans[0].scenario.planner:
            continue
        try:
            plans.append(pipeline.plan(source, planner=name))
        except InputError as error:
            raise InputError(f"planner {name!r} can't be compared here: {error}") from error
    for plan in plans:
        which = f"{plan.scenario.name}, {plan.scenario.planner}"
        report_failure(which, plan.report)
    return plans


def report_failure(which: str, report: Report) -> None:
    """Say on standard error if a check has failed, and what first."""
    if report.ok:
        return
    failures = report.failures
    click.echo(f"note: {which}: the check FAILS", err=True)
    for failure in failures[:MOST_FAILURES]:
        click.echo(f"  {failure}", err=True)
    if len(failures) > MOST_FAILURES:
        click.echo(f"  and {len(failures) - MOST_FAILURES} more", err=True)
