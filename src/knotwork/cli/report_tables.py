"""Full reports, as tables on a terminal."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.padding import Padding
from rich.table import Table

from knotwork.cli.short_report import without
from knotwork.cli.tables import console, plain_table, print_table, print_wrapped
from knotwork.cli.terminal import cell
from knotwork.scenario import Scenario
from knotwork.units import Units, readable
from knotwork.verification import Finding, Report

if TYPE_CHECKING:
    from knotwork.planning import Plan
    from knotwork.planning.task_to_joint import Choice, TaskSolution

INDENT = " " * len("FAIL ")


def print_plan(plan: Plan) -> None:
    """Print a plan in full: tables of waypoints, limits and all other findings."""
    trajectory, scenario = plan.trajectory, plan.scenario
    made = f"{trajectory.planner} ({without(plan)})" if plan.left_out else trajectory.planner
    if isinstance(scenario.knots, str):
        made += f", knots {scenario.knots}"
    counts = f"{len(scenario.waypoints)} waypoints, {len(trajectory.breaks)} breaks"
    made += f": {counts}, {trajectory.duration:g} s"
    print_report(plan.report, scenario, made, plan.solution)


def print_report(
    report: Report, scenario: Scenario | None, made: str = "", solution: TaskSolution | None = None
) -> None:
    """Print a whole report as tables of waypoints and limits, and the verdict.

    Args:
        report: Report of the check.
        scenario: Scenario of the check, if any.
        made: Planner and options; by default the trajectory's planner.
        solution: Choice of the solutions, if known.
    """
    out = console()
    units = report.units
    description = scenario.task.description.strip() if scenario is not None else ""
    gap = "  " if description else ""
    print_wrapped(" ".join(description.split()), f"{report.scenario}{gap}", INDENT, "bold")
    robot = f"robot {report.robot}" if report.robot else "joints alone"
    print_wrapped(f"{robot}; {made or report.planner}", "", INDENT)
    for group, findings in report.groups.items():
        numbers = [one for one in findings if not (_in_words(one) or one.detail)]
        if numbers:
            print_table(_list_table(group, numbers, units))
            out.print()
    if solution is not None and solution.choices:
        print_table(choice_table(solution.choices))
        out.print()
    for found in report.findings:
        if _in_words(found) and found.verdict == "information":
            print_wrapped(str(found), "   ", "    ")
    for found in report.warnings:
        print_wrapped(str(found), "warning ", INDENT, "yellow")
    for found in report.failures:
        print_wrapped(str(found), "FAIL ", INDENT, "bold red")
    met, required = report.counts
    verdict = "[bold green]PASSED[/]" if report.ok else "[bold red]FAILED[/]"
    failed = f", {required - met} failed" if required > met else ""
    failed += report.reservations
    out.print(f"{verdict} {cell(report.scenario)}: {met} of {required} requirements met{failed}")


def _in_words(found: Finding) -> bool:
    """Whether to print a sentence: no number, or detail without a limit."""
    return found.value is None or (found.verdict == "information" and bool(found.brief))


def _list_table(title: str, findings: Sequence[Finding], units: Units) -> Table:
    """One row for each finding, by quantity; of those without a limit only the largest."""
    table = plain_table(title, ["", "value", "limit", "margin", "at [s]", "", "off by\nat most"])
    table.columns[0].no_wrap = False
    for quantity in dict.fromkeys(found.title for found in findings):
        items = [found for found in findings if found.title == quantity]
        names = _unit_names(items, units)
        table.add_row(cell(f"{quantity} [{names}]" if names else quantity), style="dim")
        free = [found for found in items if found.limit is None]
        shown = [(found, "") for found in items if found.limit is not None]
        if free:
            largest = max(free, key=lambda found: abs(found.value or 0.0))
            shown.append((largest, "most: " if len(free) > 1 else ""))
        for found, of_all in shown:
            table.add_row(
                Padding(f"{of_all}{cell(found.name or found.subject)}", (0, 0, 0, 2)),
                _cell(found, ".4g", units),
                _number(found.limit, found, ".4g", units) or "none",
                _number(found.margin, found, ".4g", units),
                found.when,
                _mark(found),
                _proof(found, units),
            )
    return table


def _unit_names(findings: Sequence[Finding], units: Units) -> str:
    """Units of the values shown."""
    names = (units.shown(0.0, found.unit)[1] for found in findings)
    return " or ".join(dict.fromkeys(name for name in names if name))


def _mark(found: Finding) -> str:
    marks = {
        "met": "[green]ok[/]",
        "failed": "[bold red]FAIL[/]",
        "undecided": "undecided",
        "warning": "[yellow]warning[/]",
        "information": "-",
    }
    return marks[found.verdict]


def _proof(found: Finding, units: Units) -> str:
    """Largest distance of the true value beyond the given one, or `exact` or `sampled`."""
    return found.proof if found.proof != "bounded" else _number(found.excess, found, ".1g", units)


def _cell(found: Finding, form: str, units: Units) -> str:
    text = _number(found.value, found, form, units)
    return text if found.ok else f"[bold red]{text}[/]"


def _number(value: float | None, found: Finding, form: str, units: Units) -> str:
    """A value in the displayed unit of a finding."""
    return "" if value is None else readable(units.shown(value, found.unit)[0], form)


def choice_table(choices: Sequence[Choice]) -> Table:
    """Chosen solutions of poses, with reasons; equal waypoints share a row."""
    columns = ["waypoints", "branch", "turns", "of", "why"]
    table = plain_table("Solutions chosen", columns, len(columns))
    for column in table.columns:
        column.no_wrap, column.overflow = False, "fold"
    for taken, group in itertools.groupby(choices, key=_taken):
        first, *others = (one.waypoint for one in group)
        span = f"{first} to {others[-1]}" if others else first
        table.add_row(*map(cell, (span, *taken)))
    return table


def _taken(choice: Choice) -> tuple[str, ...]:
    kind = "branch" if choice.branches == 1 else "branches"
    count = f"{choice.branches} {kind}, {choice.solutions} with turns"
    if choice.sampled:
        count = f"{choice.branches} samples of its self-motion"
    return choice.branch or "-", _turns(choice.turns), count, choice.reason


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"
