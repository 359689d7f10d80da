"""Plans, reports and robots as tables on a terminal."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from knotwork.interpolation import PLANNER_SPECS
from knotwork.scenario import Scenario
from knotwork.verification import LimitUse, Report, Requirement

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
    return Console(width=width, highlight=False)


def plain_table(title: str, columns: Sequence[str], left: int = 1) -> Table:
    """Make a table whose first columns are text and all others numbers."""
    table = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        header_style="dim",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, column in enumerate(columns):
        table.add_column(escape(column), justify="left" if i < left else "right", no_wrap=True)
    return table


def _mark(ok: bool) -> str:
    return "[green]ok[/]" if ok else "[bold red]FAIL[/]"


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
    out.print(f"[bold]{escape(report.scenario)}[/]  {escape(scenario.description.strip())}")
    robot = f"robot {report.robot}" if report.robot else "joints alone"
    out.print(f"{escape(robot)}; {escape(made or report.planner)}")
    joints = [item for item in report.requirements if item.quantity.startswith("joint")]
    tool = [item for item in report.requirements if not item.quantity.startswith("joint")]
    for title, items in (("Tool at the waypoints", tool), ("Joints at the waypoints", joints)):
        if items:
            out.print(_waypoint_table(title, items))
            out.print()
    if solution is not None and solution.choices:
        out.print(_choice_table(solution.choices))
        out.print()
        if any(choice.alternative is not None for choice in solution.choices):
            out.print(_alternative_table(solution.choices))
            out.print()
    out.print(_limit_table(report.limits))
    out.print()
    for infeasible in solution.infeasibilities if solution is not None else ():
        out.print(f"[bold red]too fast[/] {escape(str(infeasible))}", soft_wrap=True)
    for jump in report.jumps:
        size = f"{jump.relative:.1e} of its peak" if jump.relative else "within rounding"
        state = "" if jump.required else " (not required)"
        out.print(
            f"{_mark(jump.ok)} {jump.quantity} continuity: largest jump {jump.value:.2e} "
            f"{jump.unit}, {size}{state}"
        )
    if report.singularity is not None:
        near = report.singularity
        out.print(
            f"   smallest singular value {near.smallest_singular_value:.4f} at {near.time:.3f} s, "
            f"sampled at {near.samples} times"
        )
    failures = report.failures
    for failure in failures[:MOST_FAILURES]:
        out.print(f"{_mark(False)} {escape(str(failure))}")
    if len(failures) > MOST_FAILURES:
        out.print(f"   and {len(failures) - MOST_FAILURES} more")
    met = sum(item.ok for item in report.requirements)
    verdict = "[bold green]PASSED[/]" if report.ok else "[bold red]FAILED[/]"
    out.print(
        f"{verdict} {escape(report.scenario)}: {met} of {len(report.requirements)} requirements "
        f"met, {len(failures)} failures"
    )


def _waypoint_table(title: str, requirements: Sequence[Requirement]) -> Table:
    """One row a waypoint: the tool speed asked for, and how far off the trajectory is."""
    quantities = list(dict.fromkeys(item.quantity for item in requirements))
    columns, allowed = ["waypoint", "time\n[s]"], ["allowed error", ""]
    if "linear_velocity" in quantities:
        columns.append("speed\n[m/s]")
        allowed.append("")
    for quantity in quantities:
        items = [item for item in requirements if item.quantity == quantity]
        units = " or ".join(dict.fromkeys(item.unit for item in items))
        columns.append(quantity.removeprefix("joint_").replace("_", "\n") + f"\n[{units}]")
        allowed.append(f"{items[0].tolerance:.1e}")
    table = plain_table(title, [*columns, ""])
    by_waypoint: dict[tuple[str, float], dict[str, Requirement]] = {}
    for item in requirements:
        by_waypoint.setdefault((item.waypoint, item.time), {})[item.quantity] = item
    for (name, time), found in by_waypoint.items():
        cells = [escape(name), f"{time:.3f}"]
        if "linear_velocity" in found:
            cells.append(f"{np.linalg.norm(found['linear_velocity'].requested):.3f}")
        cells += [_error(found.get(key)) for key in quantities]
        table.add_row(*cells, _mark(all(item.ok for item in found.values())))
    table.add_row(*allowed, "", style="dim")
    return table


def _choice_table(choices: Sequence[Choice]) -> Table:
    """One row a waypoint given by a pose: which of its solutions was taken, and why."""
    table = plain_table("Solutions chosen", ["waypoint", "branch", "turns", "of", "why"], 5)
    for choice in choices:
        kind = "branch" if choice.branches == 1 else "branches"
        count = f"{choice.branches} {kind}, {choice.solutions} with turns"
        if choice.sampled:
            count = f"{choice.branches} samples of its free motion"
        cells = (choice.waypoint, choice.branch or "-", _turns(choice.turns), count, choice.reason)
        table.add_row(*map(escape, cells))
    return table


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"


def _alternative_table(choices: Sequence[Choice]) -> Table:
    """What the next best sequence has, and costs: one row for waypoints where that is the same."""
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
            table.add_row(*map(escape, (span, *cells)))
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


def _limit_table(limits: Sequence[LimitUse]) -> Table:
    """One row a joint and quantity; where no limit is given, one row for the worst joint."""
    title = "Joint limits: exact over all time, unless marked as sampled"
    table = plain_table(title, ["joint", "value", "limit", "margin", "at [s]", ""])
    for quantity in dict.fromkeys(item.quantity for item in limits):
        items = [item for item in limits if item.quantity == quantity]
        units = " or ".join(dict.fromkeys(item.unit for item in items))
        sampled = ", sampled" if items[0].sampled else ""
        table.add_row(escape(f"{quantity} [{units}]{sampled}"), style="dim")
        for item in items:
            if item.limit is not None and item.margin is not None:
                numbers = (item.value, item.limit, item.margin)
                cells = [_coloured(f"{number:.3f}", item.ok) for number in numbers]
                table.add_row(f"  {escape(item.joint)}", *cells, f"{item.time:.3f}", _mark(item.ok))
        free = [item for item in items if item.limit is None]
        if free:
            worst = max(free, key=lambda item: abs(item.value))
            cells = [f"{worst.value:.3f}", "none given", "", f"{worst.time:.3f}", "-"]
            most = "  " if len(free) == 1 else "  most: "
            table.add_row(most + escape(worst.joint), *cells)
    return table


def _error(item: Requirement | None) -> str:
    return _coloured(f"{item.error:.1e}", item.ok) if item is not None else ""


def _coloured(text: str, ok: bool) -> str:
    return text if ok else f"[bold red]{text}[/]"


def print_summary(rows: Sequence[tuple[str, str]]) -> None:
    """Print one line a scenario."""
    table = plain_table("Scenarios", ["scenario", "verdict"], 2)
    for name, word in rows:
        colour = "green" if word == "passed" else "bold red"
        table.add_row(escape(name), f"[{colour}]{word}[/]")
    console(wrap=True).print(table)
