"""Full reports, as tables on a terminal."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.padding import Padding
from rich.table import Table

from knotwork.cli.short_report import describe_left_out
from knotwork.cli.tables import console, plain_table, print_entry, print_table, print_wrapped
from knotwork.cli.terminal import cell
from knotwork.planning.task_to_joint import knots_of
from knotwork.task.scenario import Scenario
from knotwork.units import Units
from knotwork.verification import Finding, Report

if TYPE_CHECKING:
    from knotwork.planning import Plan
    from knotwork.planning.task_to_joint import Choice, TaskSolution

REPORT_INDENT = " " * len("FAIL ")
MARKS = {
    "met": "[green]ok[/]",
    "failed": "[bold red]FAIL[/]",
    "undecided": "undecided",
    "warning": "[yellow]warning[/]",
    "information": "-",
}
"""Mark of a finding in a table, by its verdict."""


def print_plan(plan: Plan) -> None:
    """Print a plan in full: tables of waypoints, limits and all other findings."""
    trajectory, scenario = plan.trajectory, plan.scenario
    origin = trajectory.origin
    if plan.unsupported_options:
        origin += f" ({describe_left_out(plan)})"
    if isinstance(knots := knots_of(scenario), str):
        origin += f", knots {knots}"
    counts = f"{len(scenario.waypoints)} waypoints, {len(trajectory.breaks)} breaks"
    origin += f": {counts}, {trajectory.duration:g} s"
    print_report(plan.report, scenario, origin, plan.solution)


def print_report(
    report: Report,
    scenario: Scenario | None,
    origin: str = "",
    solution: TaskSolution | None = None,
) -> None:
    """Print a whole report as tables of waypoints and limits, and the verdict.

    Args:
        report: Report of the check.
        scenario: Scenario of the check, if any.
        origin: Planner and options; by default the trajectory's planner.
        solution: The IK solutions of the waypoints, if known.
    """
    out = console()
    description = "" if scenario is None else " ".join(scenario.task.description.split())
    head = f"{report.scenario}  " if description else report.scenario
    print_wrapped(description, head, REPORT_INDENT, "bold")
    robot = f"robot {report.robot}" if report.robot else "joints alone"
    print_wrapped(f"{robot}; {origin or report.origin}", "", REPORT_INDENT)
    for group, members in report.groups.items():
        measured = [f for f in members if not (_is_sentence(f) or f.hidden_in_tables)]
        if measured:
            print_table(_findings_table(group, measured, report.units))
            out.print()
    if solution is not None and solution.choices:
        _print_choices(solution.choices)
        out.print()
    information = [f for f in report.findings if _is_sentence(f) and f.verdict == "information"]
    for head, style, findings in (
        ("   ", "", tuple(information)),
        ("warning ", "yellow", report.warnings),
        ("FAIL ", "bold red", report.failures),
    ):
        for finding in findings:
            print_wrapped(str(finding), head, REPORT_INDENT if style else "    ", style)
    verdict = "[bold green]PASSED[/]" if report.ok else "[bold red]FAILED[/]"
    out.print(f"{verdict} {cell(report.scenario)}: {report.counts_text}")


def _is_sentence(finding: Finding) -> bool:
    """Whether to print the sentence of a finding, not its numbers."""
    return finding.value is None or (finding.verdict == "information" and bool(finding.highlight))


def _findings_table(title: str, findings: Sequence[Finding], units: Units) -> Table:
    """Table of findings by quantity; of findings without a limit, only the largest value."""
    table = plain_table(title, ["", "value", "limit", "margin", "at [s]", "", "off by\nat most"])
    table.columns[0].no_wrap = False

    for quantity in dict.fromkeys(finding.quantity_text for finding in findings):
        items = [finding for finding in findings if finding.quantity_text == quantity]
        names = dict.fromkeys(units.shown(0.0, finding.unit)[1] for finding in items)
        shown_units = " or ".join(filter(None, names))
        heading = f"{quantity} [{shown_units}]" if shown_units else quantity
        table.add_row(cell(heading), style="dim")
        unlimited = [finding for finding in items if finding.limit is None]
        limited = [finding for finding in items if finding.limit is not None]
        largest = sorted(unlimited, key=lambda finding: -abs(finding.value or 0.0))[:1]
        for finding in (*limited, *largest):
            name = cell(finding.name or finding.subject)
            prefix = "most: " if len(unlimited) > 1 and finding in largest else ""
            value, limit, margin = (
                units.number(number, finding.unit)
                for number in (finding.value, finding.limit, finding.margin)
            )
            proof_gap = units.number(finding.proof_gap, finding.unit, ".1g")
            table.add_row(
                Padding(prefix + name, (0, 0, 0, 2)),
                value if finding.ok else f"[bold red]{value}[/]",
                limit or "none",
                margin,
                finding.time_text,
                MARKS[finding.verdict],
                proof_gap if finding.proof == "bounded" else finding.proof,
            )
    return table


def _print_choices(choices: Sequence[Choice]) -> None:
    """Print the chosen solutions of poses; equal waypoints share an entry."""
    entries = {}
    for text, group in itertools.groupby(choices, key=_choice_text):
        names = [choice.waypoint for choice in group]
        entries[f"{names[0]} to {names[-1]}" if len(names) > 1 else names[0]] = text
    print_entry("Solutions chosen", "branch, turns, number of solutions", entries)


def _choice_text(choice: Choice) -> str:
    kind = "branch" if choice.branches == 1 else "branches"
    count = f"{choice.branches} {kind}, {choice.solutions} with turns"
    if choice.sampled:
        count = f"{choice.branches} samples of its self-motion"
    turns = (f"{joint} {turn:+d}" for joint, turn in choice.turns.items())
    return "; ".join(part for part in (choice.branch, *turns, count) if part)
