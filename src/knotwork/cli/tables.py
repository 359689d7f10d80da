"""Plans, reports and robots as tables on a terminal."""

from __future__ import annotations

import itertools
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

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

Row = TypeVar("Row")

# Numbers are never cut short: a table takes the width it needs, and a terminal wraps what is more.
ANY_WIDTH = 1000
# For tables with text that can be wrapped.
FILE_WIDTH = 120
MOST_FAILURES = 20
MOST_ROWS = 50
"""Of a table, unless all of it is asked for."""


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


def print_plan(plan: Plan, *, full: bool = False) -> None:
    """Print a plan: what was planned, the waypoints, the limits, and the verdict.

    Args:
        plan: The plan.
        full: Long tables are shown whole.
    """
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
    if plan.scenario.chosen and plan.trajectory.planner == "modified-hermite":
        made += ", times as chosen"
    if plan.left_out:
        made += f" (without the scenario's {', '.join(plan.left_out)})"
    print_report(
        plan.report,
        plan.scenario,
        f"{made}: {len(plan.scenario.waypoints)} waypoints, {len(trajectory.breaks)} breaks, "
        f"{trajectory.duration:g} s",
        plan.solution,
        full=full,
    )


def print_report(
    report: Report,
    scenario: Scenario | None,
    made: str = "",
    solution: TaskSolution | None = None,
    *,
    full: bool = False,
) -> None:
    """Print a report as tables of waypoints and limits, and the verdict.

    Args:
        report: What the check found.
        scenario: What it was checked against, if anything.
        made: How the trajectory was made; by default what it says itself.
        solution: How the solutions of the poses were chosen, if that is known.
        full: Long tables are shown whole; by default of more than `MOST_ROWS` rows those that fail
            and the first ones.
    """
    out = console()
    most = sys.maxsize if full else MOST_ROWS
    description = scenario.description.strip() if scenario is not None else ""
    out.print(f"[bold]{cell(report.scenario)}[/]  {cell(description, lines=True)}")
    robot = f"robot {report.robot}" if report.robot else "joints alone"
    out.print(f"{cell(robot)}; {cell(made or report.planner)}")
    for group, findings in report.groups.items():
        numbers = [found for found in findings if found.value is not None and not found.detail]
        if numbers:
            # what is found of a waypoint at one time fits one row
            cells = {(found.name, found.when, found.quantity) for found in numbers}
            waypoints = all(found.subject == "waypoint" for found in numbers)
            at_once = waypoints and len(cells) == len(numbers)
            make = _row_table if at_once else _list_table
            _print_cut(out, *make(group, numbers, most))
    if solution is not None and solution.choices:
        _print_cut(out, *_choice_table(solution.choices, most))
        if any(choice.alternative is not None for choice in solution.choices):
            _print_cut(out, *_alternative_table(solution.choices, most))
    silent = [found for found in report.findings if found.value is None]
    _print_lines(out, [one for one in silent if one.verdict == "information"], "  ", most)
    _print_lines(out, report.warnings, "[yellow]warning[/]", most)
    _print_lines(out, report.failures, "[bold red]FAIL[/]", most if full else MOST_FAILURES)
    met, required = report.counts
    verdict = "[bold green]PASSED[/]" if report.ok else "[bold red]FAILED[/]"
    failed = f", {required - met} failed" if required > met else ""
    out.print(f"{verdict} {cell(report.scenario)}: {met} of {required} requirements met{failed}")


def _cut(rows: Sequence[Row], fails: Callable[[Row], bool], most: int) -> list[Row]:
    """Keep so many rows in their order, those that fail before others."""
    if len(rows) <= most:
        return list(rows)
    first = sorted(range(len(rows)), key=lambda i: (not fails(rows[i]), i))[:most]
    return [rows[i] for i in sorted(first)]


def _print_cut(out: Console, table: Table, left: int) -> None:
    """Print a table and an empty line, and how many of its rows were left out."""
    out.print(table)
    if left:
        out.print(f"and {left} more rows; --full shows them")
    out.print()


def _print_lines(out: Console, findings: Sequence[Finding], mark: str, most: int) -> None:
    """Print findings as text, and of more than so many how many more there are."""
    for found in findings[:most]:
        out.print(f"{mark} {cell(str(found))}", soft_wrap=True)
    if len(findings) > most:
        out.print(f"   and {len(findings) - most} more")


def _row_table(title: str, findings: Sequence[Finding], most: int) -> tuple[Table, int]:
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
    kept = _cut(list(rows.items()), lambda row: not all(f.ok for f in row[1].values()), most)
    for (name, when), row in kept:
        cells = [_cell(row[key], ".1e") if key in row else "" for key in quantities]
        worst = min(row.values(), key=lambda found: found.ok)
        table.add_row(cell(name), when, *cells, _mark(worst))
    table.add_row(*limits, "", style="dim")
    return table, len(rows) - len(kept)


def _list_table(title: str, findings: Sequence[Finding], most: int) -> tuple[Table, int]:
    """One row for each finding, by quantity; of those nothing is required of, the largest alone."""
    table = plain_table(title, ["", "value", "limit", "margin", "at [s]", "", ""])
    table.columns[-1].justify = "left"
    rows: list[tuple[Finding, str, str]] = []
    for quantity in dict.fromkeys(found.title for found in findings):
        items = [found for found in findings if found.title == quantity]
        free = [found for found in items if found.limit is None]
        units = " or ".join(dict.fromkeys(found.unit for found in items if found.unit))
        head = cell(f"{quantity} [{units}]" if units else quantity)
        rows += [(found, head, "") for found in items if found.limit is not None]
        if free:
            largest = max(free, key=lambda found: abs(found.value or 0.0))
            rows.append((largest, head, "most: " if len(free) > 1 else ""))
    kept = _cut(rows, lambda row: not row[0].ok, most)
    for head, group in itertools.groupby(kept, key=lambda row: row[1]):
        table.add_row(head, style="dim")
        for found, _, of_all in group:
            table.add_row(
                f"  {of_all}{cell(found.name or found.subject)}",
                _cell(found, ".4g"),
                _number(found.limit, ".4g") or "none given",
                _number(found.margin, ".4g"),
                found.when,
                _mark(found),
                _proof(found),
            )
    return table, len(rows) - len(kept)


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


def _choice_table(choices: Sequence[Choice], most: int) -> tuple[Table, int]:
    """One row a waypoint given by a pose: which of its solutions was taken, and why."""
    table = plain_table("Solutions chosen", ["waypoint", "branch", "turns", "of", "why"], 5)
    for choice in choices[:most]:
        kind = "branch" if choice.branches == 1 else "branches"
        count = f"{choice.branches} {kind}, {choice.solutions} with turns"
        if choice.sampled:
            count = f"{choice.branches} samples of its self-motion"
        cells = (choice.waypoint, choice.branch or "-", _turns(choice.turns), count, choice.reason)
        table.add_row(*map(cell, cells))
    return table, max(0, len(choices) - most)


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"


def _alternative_table(choices: Sequence[Choice], most: int) -> tuple[Table, int]:
    """The next best sequence and its cost; waypoints where both are the same share a row."""
    columns = ["waypoints", "next best", "against the one chosen"]
    table = plain_table("Best sequence with another solution there", columns, 3)
    rows: list[tuple[list[str], tuple[str, str] | None]] = []
    for choice in choices:
        cells = _alternative(choice)
        if not rows or rows[-1][1] != cells:
            rows.append(([], cells))
        rows[-1][0].append(choice.waypoint)
    found = [(names, cells) for names, cells in rows if cells is not None]
    for names, cells in found[:most]:
        span = names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"
        table.add_row(*map(cell, (span, *cells)))
    return table, max(0, len(found) - most)


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
