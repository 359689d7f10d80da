"""The command `knotwork compare`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import click
from rich.table import Table

from knotwork.cli import tables
from knotwork.cli.parameters import (
    FAILED,
    PASSED,
    Listed,
    NewPath,
    json_option,
    package_path_option,
)
from knotwork.cli.progress_display import show_planning
from knotwork.cli.terminal import echo
from knotwork.planning.comparison import Comparison, Refusal, Score, best
from knotwork.planning.comparison import compare as compare_planners
from knotwork.spline.interpolation import PLANNER_SPECS, rules
from knotwork.units import readable
from knotwork.verification.metrics import Peak

# Columns, by figure: heading and unit. "joint" is the unit of the joints.
_COLUMNS = {
    "position_miss": ("pos.\nmiss", "joint"),
    "velocity_miss": ("vel.\nmiss", "joint"),
    "acceleration_jump": ("accel.\njump", "joint"),
    "peak_velocity": ("peak\nvel.", "joint"),
    "peak_acceleration": ("peak\naccel.", "joint"),
    "peak_jerk": ("peak\njerk", "joint"),
    "tool_path_deviation": ("off path\n[{length}]", "m"),
}


@click.command()
@click.argument("scenario")
@click.option(
    "--planners",
    type=Listed(),
    metavar="A,B,…",
    help="Planners to compare, separated by commas; all by default. A rule may follow a "
    "colon: septic:estimated.",
)
@click.option(
    "--out",
    "-o",
    metavar="DIR",
    type=NewPath(),
    help="Write comparison.json and comparison.csv there.",
)
@package_path_option
@json_option
def compare(scenario: str, planners: list[str] | None, out: Path | None, as_json: bool) -> int:
    """Plan SCENARIO with several planners and compare the motions.

    A planner passes if no check fails; the exit code is 1 if none passes. Joint values are in the
    units of the scenario, or in rad and m for both angles and lengths. A peak is that of
    the joint nearest its limit, in percent of the limit, or the largest without limits.
    Where the acceleration jumps, the jerk is unbounded. A star marks the best of each column among
    planners that pass, and those within 1 % of it. Free times are chosen once, for all planners.
    --json and --out give more figures.
    """
    with show_planning(scenario, as_json):
        comparison = compare_planners(scenario, planners)
    written = comparison.save(out) if out is not None else []
    if as_json:
        echo(json.dumps(comparison.to_dict(), indent=1, allow_nan=False))
    else:
        print_comparison(comparison)
        for path in written:
            echo(f"wrote {path}")
    return PASSED if any(score.passed for score in comparison.scores) else FAILED


@click.command()
@json_option
def planners(as_json: bool) -> int:
    """List the planners: their guarantees, limitations, options and rules."""
    rows = [asdict(spec) for spec in PLANNER_SPECS.values()]
    for row in rows:
        del row["makes"]
        row["rules"] = rules(row["name"])
    if as_json:
        echo(json.dumps(rows, indent=1))
        return PASSED
    for row in rows:
        tables.print_entry(
            row["name"],
            f"degree {row['degree']}, C{row['continuity']}",
            {
                "meets": row["guarantees"],
                "can not": row["cannot"],
                "options": ", ".join(row["supports"]),
                "rules": ", ".join(f"{row['name']}:{rule}" for rule in row["rules"]),
            },
        )
    return PASSED


def print_comparison(comparison: Comparison) -> None:
    """Print the table of a comparison, followed by the failures and refusals."""
    scores = comparison.scores
    duration = f": {scores[0].duration:g} s" if scores else ""
    out = tables.console()
    shown = {
        column: (heading.format(length=comparison.units.length), unit)
        for column, (heading, unit) in _COLUMNS.items()
        if any(getattr(score, column) is not None for score in scores)
    }
    tables.print_table(_table(comparison, shown, f"{comparison.scenario}{duration}"))
    out.print()
    out.print(f"{_joint_unit(comparison)[1]}, s; % of the limit; * best of all that pass")
    if comparison.times_chosen:
        out.print("Free times were chosen once, for all planners.")
        out.print("modified-hermite without a rule is the chosen motion.")
    for row in comparison.rows:
        if row.reason:
            verdict = "refused" if isinstance(row, Refusal) else "fails"
            tables.print_wrapped(row.reason, f"{row.planner} {verdict}: ", "    ", "red")


def _table(comparison: Comparison, shown: dict[str, tuple[str, str]], title: str) -> Table:
    table = tables.plain_table(
        title, ["planner", "verdict", *(heading for heading, _ in shown.values())], 2
    )
    table.padding = (0, 0, 0, 0)  # cells end in a star or a space
    winners = best(comparison.scores)
    factors = {column: _factor(unit, comparison) for column, (_, unit) in shown.items()}
    labels = _labels([row.planner for row in comparison.rows])
    for label, row in zip(labels, comparison.rows, strict=True):
        if isinstance(row, Refusal):
            table.add_row(label, "refused: see below")
        else:
            verdict = "passed" if row.passed else f"{row.failed} fail"
            table.add_row(
                label, verdict, *(_cell(row, column, winners, factors[column]) for column in shown)
            )
    return table


def _labels(planners: Sequence[str]) -> list[str]:
    """Names of planners; under its planner a rule is shown alone."""
    labels = []
    above = ""
    for name in planners:
        planner, colon, rule = name.partition(":")
        labels.append(f"  {colon}{rule}" if colon and planner == above else name)
        above = planner
    return labels


def _joint_unit(comparison: Comparison) -> tuple[float, str]:
    """Unit for figures of joints, and the size of an SI unit in it."""
    kinds = {unit for motion in comparison.trajectories.values() for unit in motion.joint_units}
    if len(kinds) != 1:
        return 1.0, "rad or m"
    return comparison.units.shown(1.0, kinds.pop())


def _factor(unit: str, comparison: Comparison) -> float:
    """Factor from a figure in SI to the unit shown."""
    return _joint_unit(comparison)[0] if unit == "joint" else comparison.units.shown(1.0, unit)[0]


def _cell(score: Score, column: str, winners: dict[str, set[str]], factor: float) -> str:
    value = getattr(score, column)
    star = "*" if score.planner in winners.get(column, ()) else " "
    if value is None:
        return "inf " if "jerk" in column else "- "
    if isinstance(value, Peak):
        if value.use is not None:
            percent = 100 * value.use
            return f"{percent:.0f} %{star}" if percent >= 10 else f"{percent:.2g} %{star}"
        return f"{_short(factor * value.value)}{star}"
    return f"{_short(factor * value)}{star}"


def _short(value: float) -> str:
    """Three digits, and zero for rounding errors."""
    if abs(value) < 1e-9:
        return "0"
    return readable(value, ".3g" if abs(value) >= 0.01 else ".1e")
