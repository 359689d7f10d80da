"""Plans, reports and robots as tables on a terminal."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from knotwork.cli.terminal import cell
from knotwork.interpolation import PLANNER_SPECS
from knotwork.scenario import Scenario
from knotwork.verification import Finding, Report

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.task_to_joint import Choice, TaskSolution

# Numbers are never cut short: a table takes the width it needs, and a terminal wraps what is more.
ANY_WIDTH = 1000
# For tables with text that can be wrapped.
FILE_WIDTH = 120
MOST_FAILURES = 20


def console(*, wrap: bool = False) -> Console:
    """Console on standard output, that wraps text at the terminal's width or not at all."""
    width = ANY_WIDTH
    if wrap:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else FILE_WIDTH
    return Console(width=width, highlight=False, emoji=False)


def plain_table(title: str, columns: Sequence[str], left: int = 1) -> Table:
    """Make a table whose first columns are text and all others numbers."""
    table = Table(
        title=cell(title),
        title_justify="left",
        title_style="bold",
        header_style="dim",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, column in enumerate(columns):
        table.add_column(
            cell(column, lines=True), justify="left" if i < left else "right", no_wrap=True
        )
    return table


def print_rows(
    title: str, rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], wrapped: int = 1
) -> None:
    """Print plain data, a line for each row; where several columns wrap, lines divide the rows.

    Args:
        title: Title of the table.
        rows: Values by key.
        columns: The key of each column, by its heading.
        wrapped: Number of columns, the last ones, with text that can be wrapped.
    """
    table = plain_table(title, list(columns), len(columns))
    for column in table.columns[-wrapped:]:
        column.no_wrap = False
    for column, key in zip(table.columns, columns.values(), strict=True):
        if any(isinstance(row[key], int | float) for row in rows):
            column.justify = "right"
    for row in rows:
        table.add_row(*(cell(_plain_text(row[key])) for key in columns.values()))
        if wrapped > 1:
            table.add_section()
    console(wrap=True).print(table)


def _plain_text(value: Any) -> str:
    """A value of plain data in a cell; of a mapping how many there are."""
    if isinstance(value, list | tuple):
        return ", ".join(value) or "-"
    if isinstance(value, float):
        return f"{value:g}"
    return str(len(value) if isinstance(value, Mapping) else value or "-").strip()


def print_plan(plan: Plan) -> None:
    """Print a plan: what was planned, the waypoints, the limits, and the verdict."""
    trajectory = plan.trajectory
    knots = plan.scenario.knots
    placed = knots if isinstance(knots, str) else "as given"
    if isinstance(knots, int | float):
        placed = f"balanced, c = {knots:g}"
    made = trajectory.planner
    if (
        made in PLANNER_SPECS and "knots" in PLANNER_SPECS[made].supports
    ):  # a rule in its name says it already
        made += f", knots {placed}"
    if plan.left_out:
        made += f" (without the scenario's {', '.join(plan.left_out)})"
    print_report(
        plan.report,
        plan.scenario,
        f"{made}: {len(plan.scenario.waypoints)} waypoints, {len(trajectory.breaks)} breaks, "
        f"{trajectory.duration:g} s",
        plan.solution,
    )


def print_report(
    report: Report, scenario: Scenario, made: str = "", solution: TaskSolution | None = None
) -> None:
    """Print a report as tables of waypoints and limits, and the verdict.

    Args:
        report: What the check found.
        scenario: What it was checked against.
        made: How the trajectory was made; by default what it says itself.
        solution: How the solutions of the poses were chosen, if that is known.
    """
    out = console()
    out.print(f"[bold]{cell(report.scenario)}[/]  {cell(scenario.description.strip(), lines=True)}")
    robot = f"robot {report.robot}" if report.robot else "joints alone"
    out.print(f"{cell(robot)}; {cell(made or report.planner)}")
    for group, findings in report.groups.items():
        numbers = [found for found in findings if found.value is not None]
        if numbers:
            # what is found of a waypoint at one time fits one row
            cells = {(found.name, found.when, found.quantity) for found in numbers}
            waypoints = all(found.subject == "waypoint" for found in numbers)
            at_once = waypoints and len(cells) == len(numbers)
            out.print(_row_table(group, numbers) if at_once else _list_table(group, numbers))
            out.print()
    if solution is not None and solution.choices:
        out.print(_choice_table(solution.choices))
        out.print()
        if any(choice.alternative is not None for choice in solution.choices):
            out.print(_alternative_table(solution.choices))
            out.print()
    for found in report.findings:
        if found.value is None and found.verdict == "information":
            out.print(f"   {cell(str(found))}", soft_wrap=True)
    for warning in report.warnings:
        out.print(f"[yellow]warning[/] {cell(str(warning))}", soft_wrap=True)
    failures = report.failures
    for failure in failures[:MOST_FAILURES]:
        out.print(f"{_mark(failure)} {cell(str(failure))}", soft_wrap=True)
    if len(failures) > MOST_FAILURES:
        out.print(f"   and {len(failures) - MOST_FAILURES} more")
    met, required = report.counts
    verdict = "[bold green]PASSED[/]" if report.ok else "[bold red]FAILED[/]"
    failed = f", {required - met} failed" if required > met else ""
    out.print(f"{verdict} {cell(report.scenario)}: {met} of {required} requirements met{failed}")


def _row_table(title: str, findings: Sequence[Finding]) -> Table:
    """One row for each name and time, one column for each quantity."""
    quantities = list(dict.fromkeys(found.title for found in findings))
    columns, limits = ["", "at\n[s]"], ["allowed", ""]
    rows: dict[tuple[str, str], dict[str, Finding]] = {}
    for found in findings:
        rows.setdefault((found.name, found.when), {})[found.title] = found
    for quantity in quantities:
        items = [found for found in findings if found.title == quantity]
        units = " or ".join(dict.fromkeys(found.unit for found in items))
        columns.append(quantity.removeprefix("joint ").replace(" ", "\n") + f"\n[{units}]")
        limits.append(_number(items[0].limit, ".1e"))
    table = plain_table(title, [*columns, ""])
    for (name, when), row in rows.items():
        cells = [_cell(row[key], ".1e") if key in row else "" for key in quantities]
        worst = min(row.values(), key=lambda found: found.ok)
        table.add_row(cell(name), when, *cells, _mark(worst))
    table.add_row(*limits, "", style="dim")
    return table


def _list_table(title: str, findings: Sequence[Finding]) -> Table:
    """One row for each finding, by quantity; of those nothing is required of, the largest alone."""
    table = plain_table(title, ["", "value", "limit", "margin", "at [s]", "", ""])
    table.columns[-1].justify = "left"
    for quantity in dict.fromkeys(found.title for found in findings):
        items = [found for found in findings if found.title == quantity]
        free = [found for found in items if found.limit is None]
        shown = [found for found in items if found.limit is not None]
        if free:
            shown.append(max(free, key=lambda found: abs(found.value or 0.0)))
        units = " or ".join(dict.fromkeys(found.unit for found in items if found.unit))
        table.add_row(cell(f"{quantity} [{units}]" if units else quantity), style="dim")
        for found in shown:
            most = "most: " if found.limit is None and len(free) > 1 else ""
            table.add_row(
                f"  {most}{cell(found.name or found.subject)}",
                _cell(found, ".4g"),
                _number(found.limit, ".4g") or "none given",
                _number(found.margin, ".4g"),
                found.when,
                _mark(found),
                _proof(found),
            )
    return table


def _mark(found: Finding) -> str:
    marks = {
        "met": "[green]ok[/]",
        "failed": "[bold red]FAIL[/]",
        "warning": "[yellow]warning[/]",
        "information": "-",
    }
    return marks[found.verdict]


def _proof(found: Finding) -> str:
    """How a value was found; for a bound, also how far the truth may lie beyond it."""
    return f"{found.proof} +{found.excess:.1g}" if found.proof == "bounded" else found.proof


def _cell(found: Finding, form: str) -> str:
    text = _number(found.value, form)
    return text if found.ok else f"[bold red]{text}[/]"


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def _choice_table(choices: Sequence[Choice]) -> Table:
    """One row a waypoint given by a pose: which of its solutions was taken, and why."""
    table = plain_table("Solutions chosen", ["waypoint", "branch", "turns", "of", "why"], 5)
    for choice in choices:
        kind = "branch" if choice.branches == 1 else "branches"
        count = f"{choice.branches} {kind}, {choice.solutions} with turns"
        if choice.sampled:
            count = f"{choice.branches} samples of its self-motion"
        cells = (choice.waypoint, choice.branch or "-", _turns(choice.turns), count, choice.reason)
        table.add_row(*map(cell, cells))
    return table


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"


def _alternative_table(choices: Sequence[Choice]) -> Table:
    """The next best sequence and its cost; waypoints where both are the same share a row."""
    columns = ["waypoints", "next best", "against the one chosen"]
    table = plain_table("Best sequence with another solution there", columns, 3)
    rows: list[tuple[list[str], tuple[str, str] | None]] = []
    for choice in choices:
        cells = _alternative(choice)
        if not rows or rows[-1][1] != cells:
            rows.append(([], cells))
        rows[-1][0].append(choice.waypoint)
    for names, cells in rows:
        if cells is not None:
            span = names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"
            table.add_row(*map(cell, (span, *cells)))
    return table


def _alternative(choice: Choice) -> tuple[str, str] | None:
    """The next best branch, or the turns where it is the same one, and what is against it."""
    other = choice.alternative
    if other is None:
        return None
    way = other.branch
    if other.branch == choice.branch:
        way = f"turns {_turns(other.turns)}" if other.turns != choice.turns else "another"
    return way, other.hindrance or f"{other.extra:.3g} s more"


def print_summary(rows: Sequence[tuple[str, str]]) -> None:
    """Print one line a scenario."""
    table = plain_table("Scenarios", ["scenario", "verdict"], 2)
    for name, word in rows:
        colour = "green" if word == "passed" else "bold red"
        table.add_row(cell(name), f"[{colour}]{word}[/]")
    console(wrap=True).print(table)
