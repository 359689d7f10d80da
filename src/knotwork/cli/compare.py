"""The command `knotwork compare`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from knotwork.cli.parameters import PASSED, json_option

if TYPE_CHECKING:
    from knotwork.comparison import Comparison, Score

# Headings and how each column is shown.
_HEADINGS = {
    "position_miss": "position\nmiss",
    "velocity_miss": "velocity\nmiss",
    "acceleration_jump": "accel.\njump",
    "end_acceleration": "accel.\nat ends",
    "peak_velocity": "peak\nvelocity",
    "peak_acceleration": "peak\naccel.",
    "peak_jerk": "peak\njerk",
    "velocity_fluctuation": "velocity\nfluct.",
    "squared_acceleration": "integral\naccel.²",
    "squared_jerk": "integral\njerk²",
    "path_deviation": "off line\n[mm]",
    "path_turn": "turned\n[deg]",
    "tool_path_deviation": "off path\n[mm]",
    "tool_path_speed_error": "speed\noff [%]",
    "tool_paths_failed": "paths\nfailed",
    "limits_broken": "limits\nbroken",
    "time_to_plan": "time\n[ms]",
}
_FACTORS = {
    "path_deviation": 1e3,
    "path_turn": 57.29577951308232,
    "tool_path_deviation": 1e3,
    "tool_path_speed_error": 1e2,
    "time_to_plan": 1e3,
}
# Left out where there are tool paths: what is between them is of no interest then.
_STRAIGHT = ("path_deviation", "path_turn")


@click.command()
@click.argument("scenario")
@click.option(
    "--planners",
    metavar="A,B,…",
    help="Planners to compare, divided by commas; all by default. A rule may follow after a colon: "
    "septic:estimated.",
)
@click.option(
    "--out",
    "-o",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Write comparison.json and comparison.csv there.",
)
@json_option
def compare(scenario: str, planners: str | None, out: Path | None, as_json: bool) -> int:
    """Plan SCENARIO with several planners and show what each makes of it.

    Joint values are in rad or m, per second. A peak is that of the joint nearest its limit, with
    the part of the limit it uses, or the largest of all where no joint has a limit. The velocity
    fluctuation is the variation of velocity beyond the least that the task forces, of the worst
    joint; misses of position are no part of it. An arm that starts and stops at rest makes a step
    of its acceleration at the ends. Where the acceleration jumps, no bound holds for the jerk.
    The tool is compared with its paths: how far it is off them, how much its speed is off the one
    asked for, and how many of their tolerances are broken. Without paths it is compared with
    straight lines between the poses. The best of each column is marked with a star.
    """
    from knotwork.comparison import compare as compare_planners

    names = [name.strip() for name in planners.split(",")] if planners is not None else None
    comparison = compare_planners(scenario, names)
    written = comparison.save(out) if out is not None else []
    if as_json:
        click.echo(json.dumps(comparison.to_dict(), indent=1, allow_nan=False))
        return PASSED
    print_comparison(comparison)
    for path in written:
        click.echo(f"wrote {path}")
    return PASSED


@click.command()
@json_option
def planners(as_json: bool) -> int:
    """List the planners: what each guarantees, what it can not do, its options and rules."""
    from dataclasses import asdict

    from knotwork.interpolation import PLANNER_SPECS, rules

    rows = [asdict(spec) for spec in PLANNER_SPECS.values()]
    for row in rows:
        del row["makes"]
        row["rules"] = rules(row["name"])
    if as_json:
        click.echo(json.dumps(rows, indent=1))
        return PASSED
    from knotwork.cli import tables

    words = {"meets": "guarantees", "can not": "cannot", "options": "supports"}
    columns = {"name": "name", "degree": "degree", "C": "continuity", **words}
    tables.print_rows("Planners", rows, columns, wrapped=3)
    ruled = ", ".join(f"{name}:{rule}" for name in PLANNER_SPECS for rule in rules(name))
    tables.console(wrap=True).print(f"With a rule for an option after a colon: {ruled}.")
    return PASSED


def print_comparison(comparison: Comparison) -> None:
    """Print the table of a comparison, and below it why planners refused."""
    from rich.markup import escape

    from knotwork.cli import tables
    from knotwork.comparison import Refusal, best

    scores = comparison.scores
    paths = any(score.tool_paths_failed is not None for score in scores)
    shown = [
        column
        for column in _HEADINGS
        if any(getattr(score, column) is not None for score in scores)
        and not (paths and column in _STRAIGHT)
    ]
    table = tables.plain_table(
        f"{comparison.scenario}: {scores[0].duration:g} s" if scores else comparison.scenario,
        ["planner", *(_HEADINGS[column] for column in shown)],
    )
    winners = best(scores)
    for row in comparison.rows:
        if isinstance(row, Refusal):
            table.add_row(row.planner, "refused: see below")
        else:
            table.add_row(row.planner, *(_cell(row, column, winners) for column in shown))
    out = tables.console()
    out.print(table)
    for row in comparison.rows:
        if isinstance(row, Refusal):
            out.print(f"{row.planner} refused: {escape(row.reason)}")


def _cell(score: Score, column: str, winners: dict[str, set[str]]) -> str:
    from knotwork.metrics import Peak

    value = getattr(score, column)
    star = "*" if score.planner in winners.get(column, ()) else " "
    if value is None:
        return "unbounded " if "jerk" in column else "-"
    if isinstance(value, Peak):
        use = f" {100 * value.use:3.0f}%" if value.use is not None else ""
        return f"{_short(value.value)}{use}{star}"
    if isinstance(value, int):
        return f"{value}{star}"
    return f"{_short(value * _FACTORS.get(column, 1.0))}{star}"


def _short(value: float) -> str:
    """Three digits, and zero for what is only rounding."""
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 else f"{value:.1e}"
